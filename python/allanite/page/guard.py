"""Access control of the page: only browsers on this computer with the current token. Pure ASGI."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, MutableMapping

    Scope = MutableMapping[str, Any]
    Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
    Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
    App = Callable[[Scope, Receive, Send], Awaitable[None]]

#: Content security policy: nothing external is loaded, run, framed or contacted. Plotly needs inline styles.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
#: With "no-referrer", Firefox would send the message of a closed page without an origin, which is refused.
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


class Guard:
    """ASGI middleware that refuses foreign hosts (DNS rebinding), foreign origins (other sites) and missing tokens.

    The token is the first part of every path; it is removed before the application receives the request.
    """

    def __init__(self, app: App, token: str, hosts: frozenset[str]) -> None:
        self.app = app
        self.token = token
        self.hosts = hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass allowed HTTP requests on without the token in the path; answer others with status 403; ignore WebSockets."""
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return
        reason = self._refusal(scope)
        if reason is not None:
            await _refuse(send, reason)
            return
        rest = scope["path"][len(self.token) + 1 :] or "/"
        inner = {**scope, "path": rest, "raw_path": rest.encode()}

        async def answer(message: MutableMapping[str, Any]) -> None:
            """Send an ASGI message; the message that starts a response gets the headers `HEADERS`."""
            if message["type"] == "http.response.start":
                extra = [(k.encode(), v.encode()) for k, v in HEADERS.items()]
                message = {**message, "headers": [*message.get("headers", []), *extra]}
            await send(message)

        await self.app(inner, receive, answer)

    def _refusal(self, scope: Scope) -> str | None:
        """One line with the reason to refuse a request; None if the request is allowed."""
        headers: dict[str, str] = {
            k.decode().lower(): v.decode("latin-1") for k, v in scope["headers"]
        }
        host = headers.get("host", "")
        if host not in self.hosts:
            return f"host {host[:80]!r} refused: the page is only served at {sorted(self.hosts)[0]}"
        origin = headers.get("origin")
        if origin is not None and origin not in {f"http://{h}" for h in self.hosts}:
            return f"origin {origin[:80]!r} refused: only the page itself may contact its server"
        if headers.get("sec-fetch-site") == "cross-site" and scope["method"] != "GET":
            return "a request from another site was refused"
        given = scope["path"].split("/", 2)[1] if "/" in scope["path"] else ""
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return "the token is missing or wrong: open the address that allanite explore printed"
        return None


async def _refuse(send: Send, reason: str) -> None:
    """Send a response with status 403 and one line: ``refused:`` and the reason."""
    body = f"refused: {reason}\n".encode()
    head = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
    ]
    await send({"type": "http.response.start", "status": 403, "headers": head})
    await send({"type": "http.response.body", "body": body})
