"""The browser of the page's tests."""

from pathlib import Path

import pytest

CHROMIUM = Path("/usr/bin/chromium")
#: Nothing is at work, the figure is drawn, and a verdict given.
READY = "body[data-busy=false][data-drawn] #verdict b"

needs_chromium = pytest.mark.skipif(
    not CHROMIUM.exists(), reason="no /usr/bin/chromium (apt-get install chromium)"
)
