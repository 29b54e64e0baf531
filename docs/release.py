"""Check the files before a release, and link the README to the web.

    python docs/release.py 1.2.3     # says what is missing; changes nothing
    python docs/release.py --links   # rewrites README.md of this folder; only for a copy that is built

The README is also the page on PyPI, where a path of the repository leads nowhere.
"""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"


def problems(version: str) -> list[str]:
    """Reasons why `version` cannot be released."""
    found = []
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        return [
            f"VERSION={version!r}: three numbers are needed, such as 1.2.3 (semantic versioning)"
        ]
    crate = tomllib.loads((ROOT / "Cargo.toml").read_text())["package"]["version"]
    if crate != version:
        found.append(f'Cargo.toml says {crate}: set version = "{version}" and run cargo check')
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    if [p["version"] for p in lock if p["name"] == "allanite"] != [version]:
        found.append("Cargo.lock is of another version: run cargo check")
    if f"version: {version}\n" not in (ROOT / "CITATION.cff").read_text():
        found.append(f"CITATION.cff does not say version: {version}")
    first = re.search(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    if first is None or not re.fullmatch(rf"{re.escape(version)} \(\d{{4}}-\d\d-\d\d\)", first[1]):
        found.append(f"CHANGELOG.md does not begin with '## {version} (YYYY-MM-DD)'")
    if not address():
        found.append(
            "pyproject.toml has no Source in [project.urls]: state the folder of the files on the web"
        )
    return found


def address() -> str:
    """Address of the folder of the repository's files, as `pyproject.toml` states it; empty if it does not."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project.get("urls", {}).get("Source", ""))


def linked(text: str, source: str) -> str:
    """Markdown in which paths of the repository are links below `source`; a picture becomes a link to it."""
    text = re.sub(r"!(\[[^\]]*\]\((?!https?://))", r"\1", text)
    return re.sub(r"\]\((?!https?://|#)", f"]({source.rstrip('/')}/", text)


if __name__ == "__main__":
    if sys.argv[1:] == ["--links"]:
        README.write_text(linked(README.read_text(encoding="utf-8"), address()), encoding="utf-8")
        sys.exit()
    found = problems(sys.argv[1] if len(sys.argv) > 1 else "")
    print("\n".join(found) or f"{sys.argv[1]}: the files agree")
    sys.exit(1 if found else 0)
