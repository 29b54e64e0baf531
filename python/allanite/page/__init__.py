"""Local page of `allanite explore`: the steps of measuring, fitting and improving in a browser.

Add what the browser can request in `orders.py` and `tab.py`, and what it displays in `shown/` and `static/`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.validation import require_recording

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.page.server import Page
    from allanite.page.source import Source
    from allanite.recording import Recording

__all__ = ["explore", "open_page"]


def open_page(sources: Sequence[Source]) -> Page:
    """`Page` (a local web server, not yet running) for some logs; raises `InputError` if a library is not installed."""
    try:
        import plotly  # noqa: F401
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
    except ModuleNotFoundError as error:
        raise InputError(
            f"the page needs {error.name}, which is not installed: pip install 'allanite[page]'"
        ) from None
    from allanite.page.server import Page

    return Page(sources)


def explore(recording: Recording, *, open_browser: bool = True) -> Page:
    """Open the page for a recording. A thread serves the page until it is closed.

    Parameters
    ----------
    recording : Recording
        Any number of columns.
    open_browser : bool
        True to start a browser. The address is the attribute ``url`` of the result.

    Returns
    -------
    Page
        With ``url`` and ``close()``.

    Raises
    ------
    InputError
        A library of the page is not installed.

    Examples
    --------
    >>> log = al.AngleRandomWalk(N=0.1).simulate(duration=60, rate=10, seed=1)
    >>> page = al.explore(log, open_browser=False)
    >>> page.url.startswith("http://127.0.0.1:")
    True
    >>> page.close()
    """
    from pathlib import Path

    from allanite.page.source import Source

    require_recording(recording)
    name = Path(recording.path).name if recording.path else "recording"
    page = open_page([Source(name, recording=recording)]).start()
    if open_browser:
        import webbrowser

        webbrowser.open(page.url)
    return page
