"""The page's server: routes, uploads, refusals. Starlette and uvicorn are only imported here."""

from __future__ import annotations

import json
import secrets
import socket
import threading
import time
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from allanite.common.errors import AllaniteError, InputError
from allanite.page import documents
from allanite.page.guard import Guard
from allanite.page.source import MOST_BYTES, Source, Uploads, check_name
from allanite.page.state import act, state, work
from allanite.page.tab import Tab
from allanite.page.views import finite, view
from allanite.page.words import WORDS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from starlette.requests import Request
    from starlette.responses import Response

__all__ = ["Desk", "Page", "make_app"]

MOST_TABS = 32
#: Largest body of an action (a study of many rungs).
MOST_ACTION = 4_000_000
STATIC = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/draw.js": ("draw.js", "text/javascript; charset=utf-8"),
}


@cache
def _plotly() -> bytes:
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).encode()


class Desk:
    """All tabs and uploads of one server; `most_bytes` is the largest upload."""

    def __init__(self, sources: Sequence[Source], most_bytes: int = MOST_BYTES) -> None:
        self.sources = tuple(sources)
        self.most_bytes = most_bytes
        self.uploads = Uploads()
        self.tabs: dict[str, Tab] = {}
        self.lock = threading.Lock()

    def open(self) -> str:
        """A new tab, at work on the first log."""
        with self.lock:
            if len(self.tabs) >= MOST_TABS:
                # The oldest is most likely one that was closed long ago.
                self.tabs.pop(next(iter(self.tabs))).cancel()
            key = secrets.token_urlsafe(9)
            tab = self.tabs[key] = Tab(self.sources, len(self.tabs) + 1)
        if self.sources:
            tab.open(0)
        return key

    def close(self, key: str) -> None:
        """Forget a tab that was closed or reloaded: its work ends, its samples go."""
        with self.lock:
            tab = self.tabs.pop(key, None)
        if tab is not None:
            tab.cancel()

    def tab(self, request: Request) -> Tab:
        """The tab that a request speaks of."""
        found = self.tabs.get(request.path_params["tab"])
        if found is None:
            raise InputError("this tab is not known any more: reload the page")
        return found


def make_app(desk: Desk, token: str, hosts: frozenset[str]) -> Guard:
    """Build the guarded ASGI application.

    Parameters
    ----------
    desk : Desk
        Logs given at the start (the first is opened by every new tab), tabs, uploads.
    token : str
        First part of every path.
    hosts : frozenset of str
        Accepted values of the Host header.
    """
    from starlette.applications import Starlette
    from starlette.concurrency import run_in_threadpool
    from starlette.responses import JSONResponse
    from starlette.responses import Response as Plain
    from starlette.routing import Route

    def reply(document: Any, status: int = 200) -> Response:
        text = json.dumps(
            finite(document), ensure_ascii=False, allow_nan=False, separators=(",", ":")
        )
        return Plain(text, status, media_type="application/json")

    def guarded(handler: Callable[[Request], Any]) -> Callable[[Request], Any]:
        async def safe(request: Request) -> Response:
            try:
                answer = await handler(request)
            except AllaniteError as error:
                return JSONResponse({"error": " ".join(error.worded(WORDS).split())}, 400)
            return answer if isinstance(answer, Plain) else reply(answer)

        return safe

    async def static(request: Request) -> Response:
        name, kind = STATIC[
            request.url.path if request.url.path in STATIC else request.scope["path"]
        ]
        return Plain(
            resources.files("allanite.page").joinpath("static", name).read_bytes(), media_type=kind
        )

    async def plotly(_request: Request) -> Response:
        return Plain(await run_in_threadpool(_plotly), media_type="text/javascript; charset=utf-8")

    async def open_tab(_request: Request) -> Any:
        return {"tab": await run_in_threadpool(desk.open)}

    async def close_tab(request: Request) -> Any:
        desk.close(request.path_params["tab"])
        return {}

    async def get_state(request: Request) -> Any:
        tab = desk.tab(request)
        if request.query_params.get("seen") == str(tab.version):
            return work(tab)
        return await run_in_threadpool(state, tab)

    async def get_view(request: Request) -> Any:
        tab, name = desk.tab(request), request.path_params["name"]
        return await run_in_threadpool(view, tab, name, request.query_params.get("theme", "light"))

    async def post_act(request: Request) -> Any:
        tab = desk.tab(request)
        body = await _bounded(request, MOST_ACTION)
        try:
            order = json.loads(body)
        except ValueError:
            raise InputError("an action must be JSON") from None
        await run_in_threadpool(act, tab, order)
        return await run_in_threadpool(state, tab)

    async def upload(request: Request) -> Any:
        tab = desk.tab(request)
        name = check_name(request.query_params.get("name", ""))
        said = request.headers.get("content-length", "0")
        if said.isdigit() and int(said) > desk.most_bytes:
            return reply({"error": _too_large(name, desk.most_bytes)}, 413)
        path = desk.uploads.place(name)
        size = 0
        try:
            with path.open("wb") as file:
                async for piece in request.stream():
                    size += len(piece)
                    if size > desk.most_bytes:
                        path.unlink()
                        return reply({"error": _too_large(name, desk.most_bytes)}, 413)
                    await run_in_threadpool(file.write, piece)
            source = Source(name, path)
            await run_in_threadpool(
                documents.accept, tab, source, request.query_params.get("as", "log")
            )
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        return await run_in_threadpool(state, tab)

    async def download(request: Request) -> Response:
        tab, name = desk.tab(request), request.path_params["name"]
        theme = request.query_params.get("theme", "light")
        body, kind = await run_in_threadpool(documents.make, tab, name, theme)
        return Plain(
            body, media_type=kind, headers={"content-disposition": f'attachment; filename="{name}"'}
        )

    routes = [
        *(Route(path, guarded(static)) for path in STATIC),
        Route("/plotly.js", guarded(plotly)),
        Route("/tabs", guarded(open_tab), methods=["POST"]),
        Route("/tabs/{tab}", guarded(get_state)),
        Route("/tabs/{tab}/close", guarded(close_tab), methods=["POST"]),
        Route("/tabs/{tab}/act", guarded(post_act), methods=["POST"]),
        Route("/tabs/{tab}/upload", guarded(upload), methods=["POST"]),
        Route("/tabs/{tab}/view/{name}", guarded(get_view)),
        Route("/tabs/{tab}/file/{name}", guarded(download)),
    ]
    return Guard(Starlette(routes=routes), token, hosts)


def _too_large(name: str, most: int) -> str:
    return (
        f"{name} is larger than {most / 1e9:g} GB: start with it instead (allanite explore {name}),"
        " which reads it where it lies"
    )


async def _bounded(request: Request, most: int) -> bytes:
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > most:
            raise InputError(f"an action larger than {most / 1e6:g} MB is refused")
    return body


class Page:
    """A running page.

    Attributes
    ----------
    url : str
        Address with port and token; only this computer can reach it.
    """

    def __init__(self, sources: Sequence[Source]) -> None:
        import uvicorn

        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.bind(("127.0.0.1", 0))
        port = self._socket.getsockname()[1]
        token = secrets.token_urlsafe(18)
        hosts = frozenset({f"127.0.0.1:{port}", f"localhost:{port}"})
        self.url = f"http://127.0.0.1:{port}/{token}/"
        self._desk = Desk(sources)
        app = make_app(self._desk, token, hosts)
        config = uvicorn.Config(
            app, log_level="critical", access_log=False, lifespan="off", ws="none"
        )
        self._server = uvicorn.Server(config)
        self._thread: threading.Thread | None = None

    def serve(self) -> None:
        """Serve until interrupted."""
        try:
            self._server.run([self._socket])
        finally:
            self._desk.uploads.close()
            self._socket.close()

    def start(self) -> Page:
        """Serve in a thread."""
        self._thread = threading.Thread(target=self.serve, daemon=True)
        self._thread.start()
        for _ in range(500):
            if self._server.started or not self._thread.is_alive():
                break
            time.sleep(0.01)
        return self

    def close(self) -> None:
        """End; uploaded logs are deleted."""
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join(10)

    def __repr__(self) -> str:
        return f"Page({self.url})"

    def _repr_html_(self) -> str:
        return f'<a href="{self.url}" target="_blank" rel="noopener">open the page</a>'
