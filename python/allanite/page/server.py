"""Server of the page: routes, uploads and error answers. Only this module imports Starlette and uvicorn."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
import time
from functools import cache
from importlib import resources
from pathlib import PurePath
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response
from starlette.routing import Route

from allanite.common.documents import jsonable
from allanite.common.errors import AllaniteError, InputError
from allanite.page.guard import Guard
from allanite.page.orders import carry_out
from allanite.page.sessions import GRACE_S, Sessions
from allanite.page.shown import documents
from allanite.page.shown.parts import page_data
from allanite.page.shown.views import view
from allanite.page.source import Source, check_name
from allanite.page.state import job_state, state
from allanite.page.words import WORDS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from starlette.requests import Request

#: Maximum size of an action in bytes, enough for a study with many steps.
MAX_ACTION_BYTES = 4_000_000
#: Preferred port. With a constant port the browser finds its stored studies again.
PORT = 47113
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
STATIC = sorted(p.name for p in resources.files("allanite.page").joinpath("static").iterdir())


@cache
def _plotly_source() -> bytes:
    """JavaScript source of plotly as bytes (UTF-8), cached."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).encode()


def _json_response(document: Any, status: int = 200) -> Response:
    """JSON response with this document and status; floats have seven digits, NaN and ±∞ become null."""
    text = json.dumps(
        jsonable(document, figures=7), ensure_ascii=False, allow_nan=False, separators=(",", ":")
    )
    return Response(text, status, media_type="application/json")


class _UploadTooLargeError(InputError):
    """An upload exceeds the maximum size; the response has status 413."""


def _guarded(handler: Callable[[Request], Any]) -> Callable[[Request], Any]:
    """Request handler that calls `handler` and returns its result as JSON, or an error of the input as ``{"error": …}``.

    The status of an error is 400, or 413 if an upload is too large.
    """

    async def safe(request: Request) -> Response:
        """Response of the handler, its result as JSON, or the error of bad input as JSON with status 400 or 413."""
        try:
            answer = await handler(request)
            return answer if isinstance(answer, Response) else _json_response(answer)
        except AllaniteError as error:
            status = 413 if isinstance(error, _UploadTooLargeError) else 400
            return _json_response({"error": " ".join(error.worded(WORDS).split())}, status)
        except (ValueError, TypeError, KeyError, RecursionError, OverflowError) as error:
            kind = type(error).__name__
            return _json_response({"error": f"The request is invalid ({kind})"}, 400)

    return safe


async def _static(request: Request) -> Response:
    """Response with the page's own file of the path (one of `STATIC`); ``index.html`` for ``/``."""
    name = request.scope["path"].removeprefix("/") or "index.html"
    kind = KINDS[PurePath(name).suffix]
    body = resources.files("allanite.page").joinpath("static", name).read_bytes()
    return Response(body, media_type=f"{kind}; charset=utf-8")


async def _plotly(_request: Request) -> Response:
    """Response with the JavaScript source of plotly."""
    return Response(
        await run_in_threadpool(_plotly_source), media_type="text/javascript; charset=utf-8"
    )


def _query_options(request: Request) -> dict[str, str]:
    """Dict of the query parameters of a request, each cut to 80 characters."""
    return {k: v[:80] for k, v in request.query_params.items()}


async def _json_body(request: Request) -> Any:
    """JSON document in the body of a request; raises `InputError` for over 4 MB, other text and deep nesting."""
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > MAX_ACTION_BYTES:
            raise InputError(f"An action larger than {MAX_ACTION_BYTES / 1e6:g} MB is refused")
    try:
        order = json.loads(body)
        json.dumps(order, ensure_ascii=False).encode()
    except RecursionError:
        raise InputError("An action is nested too deeply") from None
    except UnicodeError:
        raise InputError("The request contains an invalid character") from None
    except ValueError:
        raise InputError("An action must be JSON") from None
    return order


async def _save_body(request: Request, path: Path, name: str, max_bytes: int) -> None:
    """Write the body of a request to `path`; `name` is that of the upload in the error message.

    Raises `_UploadTooLargeError` if the body has more than `max_bytes`. A part of the file may then exist.
    """
    refusal = _UploadTooLargeError(
        f"{name} is larger than {max_bytes / 1e9:g} GB: start the page with it instead"
        f" (allanite explore {name}), which reads the file directly"
    )
    said = request.headers.get("content-length", "0")
    if said.isdigit() and int(said) > max_bytes:
        raise refusal
    size = 0
    with path.open("wb") as file:
        async for piece in request.stream():
            size += len(piece)
            if size > max_bytes:
                raise refusal
            await run_in_threadpool(file.write, piece)


class _TabHandlers:
    """Handlers of the requests on tabs. Each returns a `Response`, or data that `_guarded` converts to JSON."""

    def __init__(self, sessions: Sessions) -> None:
        self.sessions = sessions

    async def open(self, _request: Request) -> Any:
        """Dict with the key of a new tab (``tab``), which opens the first log given at the start."""
        return {"tab": await run_in_threadpool(self.sessions.open)}

    async def close(self, request: Request) -> Any:
        """Delete a tab; returns an empty dict, also for an unknown tab."""
        await run_in_threadpool(self.sessions.close, request.path_params["tab"])
        return {}

    async def leave(self, request: Request) -> Any:
        """Note that a page was left, and delete its tab after 16 s unless it is resumed; returns an empty dict."""
        self.sessions.leave(request.path_params["tab"])
        loop = asyncio.get_running_loop()
        loop.call_later(
            GRACE_S + 1.0, lambda: loop.run_in_executor(None, self.sessions.delete_silent_tabs)
        )
        return {}

    async def copy(self, request: Request) -> Any:
        """Dict with the key of a new tab (``tab``), a copy of the tab whose key is in the URL."""
        return {"tab": await run_in_threadpool(self.sessions.copy, request.path_params["tab"])}

    async def resume(self, request: Request) -> Any:
        """Continue the tab of a reloaded page; returns an empty dict."""
        await run_in_threadpool(self.sessions.resume, request.path_params["tab"])
        return {}

    async def state(self, request: Request) -> Any:
        """Dict with the complete state of a tab; only that of its job if the browser has seen this version."""
        tab = self.sessions.tab(request)
        if request.query_params.get("seen") == str(tab.version):
            return job_state(tab)
        return await run_in_threadpool(state, tab)

    async def view(self, request: Request) -> Any:
        """Dict with plotly's data and layout of one view; the query has the theme and the options of the view."""
        tab, name = self.sessions.tab(request), request.path_params["name"]
        options = _query_options(request)
        return await run_in_threadpool(view, tab, name, options.pop("theme", "light"), options)

    async def part(self, request: Request) -> Any:
        """Data for JSON from `page_data`, for the name in the URL and with the query parameters as options."""
        tab, name = self.sessions.tab(request), request.path_params["name"]
        return await run_in_threadpool(page_data, tab, name, _query_options(request))

    async def act(self, request: Request) -> Any:
        """Dict with the state of the tab after carrying out the action of the user in the body of the request."""
        tab = self.sessions.tab(request)
        await run_in_threadpool(carry_out, tab, await _json_body(request))
        return await run_in_threadpool(state, tab)

    async def upload(self, request: Request) -> Any:
        """Dict with the state of the tab after a log or data sheet was uploaded; a file that is not accepted is deleted.

        Raises `_UploadTooLargeError` above the permitted size, and `InputError` if the file cannot be used.
        """
        tab, uploads = self.sessions.tab(request), self.sessions.uploads
        name = check_name(request.query_params.get("name", ""))
        path = uploads.new_path(name)
        try:
            await _save_body(request, path, name, self.sessions.max_bytes)
            role = request.query_params.get("as", "log")
            await run_in_threadpool(documents.open_upload, tab, Source(name, path), role)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        return await run_in_threadpool(state, tab)

    async def download(self, request: Request) -> Response:
        """Response with a generated file as an attachment; the header ``x-note`` has a remark for the user."""
        tab, name = self.sessions.tab(request), request.path_params["name"]
        options = _query_options(request)
        theme = options.pop("theme", "light")
        made = await run_in_threadpool(documents.generated_file, tab, name, theme, options)
        said = {
            "content-disposition": f"attachment; filename*=UTF-8''{quote(made.name)}",
            "x-note": quote(made.note),
        }
        return Response(made.body, media_type=made.kind, headers=said)


def make_app(sessions: Sessions, token: str, hosts: frozenset[str]) -> Guard:
    """ASGI application of the page behind its access control (`Guard`); it serves files, tabs, views and uploads.

    `token` is the first part of every path, and `hosts` are the accepted values of the Host header.
    """
    tabs = _TabHandlers(sessions)
    requests = {"/": _static, **{f"/{name}": _static for name in STATIC}, "/plotly.js": _plotly}
    requests |= {
        "/tabs/{tab}": tabs.state,
        "/tabs/{tab}/part/{name}": tabs.part,
        "/tabs/{tab}/view/{name}": tabs.view,
        "/tabs/{tab}/file/{name}": tabs.download,
    }
    changes = {
        "/tabs": tabs.open,
        "/tabs/{tab}/close": tabs.close,
        "/tabs/{tab}/leave": tabs.leave,
        "/tabs/{tab}/resume": tabs.resume,
        "/tabs/{tab}/copy": tabs.copy,
        "/tabs/{tab}/act": tabs.act,
        "/tabs/{tab}/upload": tabs.upload,
    }
    routes = [
        *(Route(path, _guarded(handler)) for path, handler in requests.items()),
        *(Route(path, _guarded(handler), methods=["POST"]) for path, handler in changes.items()),
    ]
    return Guard(Starlette(routes=routes), token, hosts)


def _listening_socket() -> socket.socket:
    """Listening socket at port 47113 of this computer (127.0.0.1), or at any port if that one is in use."""
    for port in (PORT, 0):
        found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            found.bind(("127.0.0.1", port))
            found.listen(128)
        except OSError:
            found.close()
            if port == 0:
                raise
        else:
            return found
    raise AssertionError


class Page:
    """The page with its server.

    Attributes
    ----------
    url : str
        Address with port and token, reachable only from this computer.
    """

    def __init__(self, sources: Sequence[Source]) -> None:
        self._socket = _listening_socket()
        port = self._socket.getsockname()[1]
        token = secrets.token_urlsafe(18)
        hosts = frozenset({f"127.0.0.1:{port}", f"localhost:{port}"})
        self.url = f"http://127.0.0.1:{port}/{token}/"
        self._sessions = Sessions(sources)
        app = make_app(self._sessions, token, hosts)
        config = uvicorn.Config(
            app, log_level="critical", access_log=False, lifespan="off", ws="none"
        )
        self._server = uvicorn.Server(config)
        self._thread: threading.Thread | None = None

    def serve(self) -> None:
        """Serve the page in this thread until it is interrupted or closed; then delete uploads and close the socket."""
        try:
            self._server.run([self._socket])
        finally:
            self._sessions.uploads.close()
            self._socket.close()

    def start(self) -> Page:
        """Serve the page in a daemon thread; returns this page when the server has started, after 5 s at the latest."""
        self._thread = threading.Thread(target=self.serve, daemon=True)
        self._thread.start()
        for _ in range(500):
            if self._server.started or not self._thread.is_alive():
                break
            time.sleep(0.01)
        return self

    def close(self) -> None:
        """Stop the server of the page, and wait up to 10 s until its thread ends. This thread deletes the uploaded logs."""
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join(10)

    def __repr__(self) -> str:
        return f"Page({self.url})"

    def _repr_html_(self) -> str:
        """HTML link to the page, for notebooks."""
        return f'<a href="{self.url}" target="_blank" rel="noopener">open the page</a>'
