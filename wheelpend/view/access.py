"""Who may ask the workbench anything: whoever has the token of its address, from this machine, from its own page.

A browser lets every page send requests to 127.0.0.1. So a request counts only where it names this machine as its host
(a name that was bent to 127.0.0.1 is another), comes from no other page, and carries the token, which only the address
in the terminal holds; the first answer puts it into a cookie.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, NamedTuple
from urllib.parse import parse_qs

LOOPBACK_HOST = "127.0.0.1"
HOST_NAMES = (LOOPBACK_HOST, "localhost")
TOKEN_BYTES = 32
TOKEN_PARAMETER = "token"
OWN_FETCH_SITES = ("same-origin", "none")  # of Sec-Fetch-Site: from its own page, or typed by the user
# The first answer sends the browser on from the workbench's own site, so that the cookie comes along, to an address
# without the token, which it need not remember.
FIRST_PAGE = (
    b"<!doctype html><title>wheelpend</title><link rel='icon' href='data:,'>"
    b"<meta http-equiv='refresh' content='0;url=/'>"
)
HTML_TYPE, TEXT_TYPE = "text/html; charset=utf-8", "text/plain; charset=utf-8"
POLICY_REFUSAL = 1008  # the code with which a websocket is closed

SECURITY_HEADERS = {
    "content-security-policy": "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]


class Access(NamedTuple):
    """The port of a workbench and the token that its address holds."""

    port: int
    token: str

    @classmethod
    def new(cls, port: int) -> Access:
        """Access by a token that nobody can guess."""
        return cls(port, secrets.token_urlsafe(TOKEN_BYTES))

    @property
    def address(self) -> str:
        """The address that opens the workbench."""
        return f"http://{LOOPBACK_HOST}:{self.port}/?{TOKEN_PARAMETER}={self.token}"

    @property
    def cookie_name(self) -> str:
        """The cookie's name: those of two workbenches differ, since a browser shares cookies among ports."""
        return f"wheelpend_{self.port}"

    @property
    def cookie(self) -> str:
        """The header that gives a browser the token: for this machine's own page, and not for its scripts."""
        return f"{self.cookie_name}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def has_token(self, query: str) -> bool:
        """True where the token stands in the address."""
        return any(map(self._is_token, parse_qs(query).get(TOKEN_PARAMETER, [])))

    def has_cookie(self, header: str) -> bool:
        """True where the token stands in the cookie."""
        try:
            found = SimpleCookie(header).get(self.cookie_name)
        except CookieError:
            return False
        return found is not None and self._is_token(found.value)

    def refusal(self, headers: Mapping[str, str], query: str) -> str:
        """Why a request is refused, in a sentence; empty where it may be answered."""
        own = [f"{name}:{self.port}" for name in HOST_NAMES]
        host, origin, site = headers.get("host", ""), headers.get("origin"), headers.get("sec-fetch-site")
        if host not in own:
            return f"The host must be {own[0]}, this machine itself, but it is another."
        if origin is not None and origin not in [f"http://{name}" for name in own]:
            return "The workbench answers its own page alone, but another page asks."
        if self.has_token(query):
            return ""
        if site is not None and site not in OWN_FETCH_SITES:
            return "The workbench answers its own page alone. Open the address that the terminal shows."
        if not self.has_cookie(headers.get("cookie", "")):
            return "The address must hold the token that the terminal shows. Open it as it stands there."
        return ""

    def _is_token(self, text: str) -> bool:
        return secrets.compare_digest(text.encode(), self.token.encode())


class Guard:
    """An ASGI application behind the access: pages, files and websockets alike."""

    def __init__(self, app: Application, access: Access) -> None:
        self.app, self.access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer what may be answered, and refuse the rest with 403."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        query = scope["query_string"].decode("latin-1")
        why = self.access.refusal(_headers(scope), query)
        if why and scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": POLICY_REFUSAL, "reason": ""})
        elif why:
            await _answer(send, 403, f"{why}\n".encode(), {})
        elif scope["type"] == "http" and scope["path"] == "/" and self.access.has_token(query):
            await _answer(send, 200, FIRST_PAGE, {"content-type": HTML_TYPE, "set-cookie": self.access.cookie})
        else:
            await self.app(scope, receive, _with_security_headers(send))


def _headers(scope: Scope) -> dict[str, str]:
    """The headers of a request; of one that comes twice both, which is then no known value."""
    found: dict[str, str] = {}
    for name, value in scope["headers"]:
        key, text = name.decode("latin-1").lower(), value.decode("latin-1")
        found[key] = f"{found[key]}; {text}" if key in found else text
    return found


async def _answer(send: Send, status: int, body: bytes, headers: Mapping[str, str]) -> None:
    said = {"content-type": TEXT_TYPE, "cache-control": "no-store", **SECURITY_HEADERS, **headers}
    await send({"type": "http.response.start", "status": status, "headers": _encoded(said)})
    await send({"type": "http.response.body", "body": body})


def _with_security_headers(send: Send) -> Send:
    """What sends an answer with what the browser is to forbid the page."""

    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *_encoded(SECURITY_HEADERS)]
        await send(message)

    return sending


def _encoded(headers: Mapping[str, str]) -> list[tuple[bytes, bytes]]:
    return [(name.encode("latin-1"), value.encode("latin-1")) for name, value in headers.items()]
