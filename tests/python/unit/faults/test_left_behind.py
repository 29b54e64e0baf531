"""What a killed process leaves in the temporary folder is removed by the next start, and nothing else is."""

import os
import signal
import tempfile

import pytest

from allanite.common.files import OwnedFolder
from command_line import started

pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
UPLOADS = """
import sys
from allanite.page.source import Uploads
uploads = Uploads()
path = uploads.new_path("log.csv")
path.write_text("1")
print(path, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.mark.slow
def test_uploads_of_a_killed_page_go_with_the_next_start(temporary):
    pytest.importorskip("starlette")
    from allanite.page.source import Uploads

    other = temporary / "allanite-page-of-somebody-else"
    other.mkdir()
    with started(code=UPLOADS, stdin=-1) as living, started(code=UPLOADS, stdin=-1) as killed:
        paths = [process.stdout.readline().decode().strip() for process in (living, killed)]
        killed.send_signal(signal.SIGKILL)
        killed.wait(60)
        assert os.path.exists(paths[1])  # noqa: PTH110
        uploads = Uploads()
        mine = uploads.new_path("x.csv")
        mine.write_text("2")
        assert [os.path.exists(path) for path in paths] == [True, False]  # noqa: PTH110
        assert other.is_dir()
        assert uploads.files() == [mine]
        uploads.close()
        assert not mine.parent.exists()


def test_a_link_is_not_followed(temporary, tmp_path_factory):
    target = tmp_path_factory.mktemp("precious")
    (target / OwnedFolder.LOCK).touch()
    (temporary / "allanite-page-link").symlink_to(target)
    OwnedFolder.remove_abandoned("page")
    assert (target / OwnedFolder.LOCK).exists()
