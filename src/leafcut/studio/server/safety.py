"""Access control and content policy of the studio: the outermost layer of the server.

Every request needs a key. A browser enters with a single-use address and receives a cookie that expires. A program
sends the token in an ``Authorization: Bearer`` header (`keys`). Requests for a host name other than the loopback's
(DNS rebinding) and requests from other sites (cross-site request forgery) are refused before any other code sees
them.

The content policy allows only the studio's own files, with two exceptions for NiceGUI. Its inline scripts and styles
get a nonce, which is new for every page. Its component calls are text that the page evaluates, which requires
``unsafe-eval``; this text arrives only through the guarded connection.
"""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from contextlib import suppress
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

from leafcut.studio.folder import LARGEST_UPLOAD
from leafcut.studio.keys import COOKIE_SECONDS, StudioKeys

Scope = MutableMapping[str, Any]
AsgiMessage = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[AsgiMessage]]
Send = Callable[[AsgiMessage], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

#: Maximum body of a request without files, bytes. Uploads may have `LARGEST_UPLOAD`.
LARGEST_REQUEST = 1024 * 1024
UPLOADS = "/api/"

_FIXED = {
    "x-frame-options": "DENY",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), usb=(), serial=(), payment=()",
}
_TAG = re.compile(rb"<(script|style)(?=[\s>])")
_READING = ("GET", "HEAD", "OPTIONS")


class RequestRefused(Exception):
    """A request is too large. The exception ends the request wherever it is being read."""


def content_policy(nonce: str, host: str) -> str:
    """Return the content security policy for a page of the studio."""
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src 'self' 'nonce-{nonce}' 'unsafe-eval'",
            f"style-src 'self' 'nonce-{nonce}'",
            "style-src-attr 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self'",
            f"connect-src 'self' ws://{host}",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    )


class Guard:
    """An ASGI application that guards another application.

    `port` is the port of this server; hosts and origins are checked against it. `on_entry` is called with the access
    key of a URL once a browser has used that URL.
    """

    def __init__(
        self,
        app: App,
        *,
        keys: StudioKeys,
        port: int,
        largest: int = LARGEST_UPLOAD,
        on_entry: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.app = app
        self.keys, self.on_entry = keys, on_entry
        self.cookie = f"leafcut-{port}"
        self.hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
        self.largest = largest

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward permitted requests; answer all others with a refusal."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        scope["headers"] = [(k, v) for k, v in scope["headers"] if not k.startswith(b"x-forwarded-")]
        asked = _RequestHead(scope)
        refusal = self._refusal(asked)
        if scope["type"] == "websocket":
            if refusal or not self._known(asked):
                await send({"type": "websocket.close", "code": 1008, "reason": ""})
            else:
                await self.app(scope, receive, send)
            return
        if refusal:
            await _answer(asked, send, 403, refusal)
        elif asked.method == "GET" and asked.path == "/" and asked.token is not None:
            await self._enter(asked, send)
        elif not self._known(asked):
            await _answer(
                asked, send, 401, "Open the address that leafcut studio printed last: it contains the key to this page."
            )
        else:
            await self._pass(asked, scope, receive, send)

    def _refusal(self, asked: _RequestHead) -> str:
        """Return the reason why a request is refused regardless of its key; empty if it is not refused."""
        if asked.host not in self.hosts:
            return "This address is not the studio's: use 127.0.0.1 and the port that it printed."
        own_origin = f"http://{asked.host}"
        if asked.origin is not None and asked.origin != own_origin:
            return "A page of another origin must not access the studio."
        # Without a key, the missing key is reported instead.
        if asked.changes and asked.origin is None and self._known(asked) and not self._bearer(asked):
            return "A request that changes something needs its origin, or the token in an Authorization header."
        if asked.site in ("cross-site", "same-site") and asked.mode != "navigate":
            return "A page of another origin may not load from the studio."
        return ""

    def _known(self, asked: _RequestHead) -> bool:
        return self._bearer(asked) or self._has_cookie(asked)

    def _has_cookie(self, asked: _RequestHead) -> bool:
        return any(self.keys.is_cookie(value) for value in asked.cookies(self.cookie))

    def _bearer(self, asked: _RequestHead) -> bool:
        return self.keys.is_token(asked.bearer)

    async def _enter(self, asked: _RequestHead, send: Send) -> None:
        """Exchange the key in the address for a cookie that scripts cannot read."""
        key = asked.token or ""
        if self.keys.redeem_entry(key):
            self.on_entry(key)
        elif not self._has_cookie(asked):
            line = "This address was used already, or its studio has ended: open the one that leafcut printed last."
            await _answer(asked, send, 401, line)
            return
        await _answer(asked, send, 303, "", (("location", "/"), ("set-cookie", self._new_cookie())))

    def _new_cookie(self) -> str:
        value = self.keys.new_cookie()
        return f"{self.cookie}={value}; Path=/; Max-Age={COOKIE_SECONDS}; HttpOnly; SameSite=Strict"

    async def _pass(self, asked: _RequestHead, scope: Scope, receive: Receive, send: Send) -> None:
        limit = self.largest if asked.path.startswith(UPLOADS) else min(self.largest, LARGEST_REQUEST)
        if asked.length > limit:
            await _answer(asked, send, *_too_large(limit))
            return
        # Reloading the page renews its cookie, so that active users remain logged in.
        renewed = self._new_cookie() if asked.path == "/" and not self._bearer(asked) else ""
        exchange = _Exchange(receive, send, asked, limit, renewed)
        with suppress(RequestRefused):
            await self.app(scope, exchange.receive, exchange.send)
        if exchange.refused and not exchange.begun:
            await _answer(asked, send, *_too_large(limit))


def _too_large(limit: int) -> tuple[int, str]:
    return 413, f"This is larger than {limit >> 20} MiB, the studio's limit."


class _RequestHead:
    def __init__(self, scope: Scope) -> None:
        self.headers: dict[bytes, list[bytes]] = {}
        for name, value in scope["headers"]:
            self.headers.setdefault(name.lower(), []).append(value)
        self.path: str = scope["path"]
        self.method: str = scope.get("method", "")
        hosts = self.headers.get(b"host", [])
        self.host = self._text(b"host").lower() if len(hosts) == 1 else ""
        self.origin = self._text(b"origin") if b"origin" in self.headers else None
        self.site, self.mode = self._text(b"sec-fetch-site"), self._text(b"sec-fetch-mode")
        #: A websocket changes state as well, and browsers always send its origin.
        self.changes = scope["type"] == "websocket" or self.method not in _READING
        kind, _, word = self._text(b"authorization").partition(" ")
        self.bearer = word.strip() if kind.lower() == "bearer" else ""
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        #: The key in the address.
        self.token = query["token"][0] if "token" in query else None
        length = self._text(b"content-length")
        self.length = int(length) if length.isdecimal() and len(length) < 20 else 0

    def _text(self, name: bytes) -> str:
        return self.headers.get(name, [b""])[0].decode("latin-1")

    def cookies(self, name: str) -> Iterable[str]:
        """Yield the values of a cookie; a malformed header has none."""
        for header in self.headers.get(b"cookie", []):
            try:
                cookie = SimpleCookie(header.decode("latin-1"))
            except CookieError:
                continue
            if name in cookie:
                yield cookie[name].value


class _Exchange:
    """A request and its answer in transit: limits the request, adds headers, and gives a page its nonce.

    Whatever the declared length, at most `limit` bytes of the body are forwarded. If there are more, the application's
    answer is dropped.
    """

    def __init__(self, receive: Receive, send: Send, asked: _RequestHead, limit: int, cookie: str) -> None:
        self._receive, self._send, self._asked = receive, send, asked
        self._left = limit
        self._cookie = cookie
        self.refused = self.begun = False
        self._held: AsgiMessage | None = None
        self._nonce = secrets.token_urlsafe(16)
        self._body = bytearray()

    async def receive(self) -> AsgiMessage:
        """Forward a received message, or raise `RequestRefused`."""
        message = await self._receive()
        self._left -= len(message.get("body", b""))
        if self._left < 0:
            self.refused = True
            raise RequestRefused
        return message

    async def send(self, message: AsgiMessage) -> None:
        """Forward a message. A page is held until it is complete."""
        if self.refused and not self.begun:
            return
        if message["type"] == "http.response.start":
            self.begun = True
            headers = {k.decode("latin-1").lower(): v.decode("latin-1") for k, v in message["headers"]}
            has_policy = "content-security-policy" in headers
            message["headers"] = [*message["headers"], *self._added_headers(headers)]
            if headers.get("content-type", "").startswith("text/html") and not has_policy:
                self._held = message
                return
        elif self._held is not None and message["type"] == "http.response.body":
            self._body += message.get("body", b"")
            if message.get("more_body", False):
                return
            page = _TAG.sub(rb'<\1 nonce="' + self._nonce.encode() + rb'"', bytes(self._body))
            kept = [(k, v) for k, v in self._held["headers"] if k.lower() != b"content-length"]
            self._held["headers"] = [*kept, (b"content-length", str(len(page)).encode())]
            await self._send(self._held)
            message = {"type": "http.response.body", "body": page}
        await self._send(message)

    def _added_headers(self, headers: dict[str, str]) -> list[tuple[bytes, bytes]]:
        added = dict(_FIXED)
        if "content-security-policy" not in headers:
            added["content-security-policy"] = content_policy(self._nonce, self._asked.host)
        if "cache-control" not in headers:
            added["cache-control"] = "no-store"
        if self._cookie:
            added["set-cookie"] = self._cookie
        return [(k.encode(), v.encode()) for k, v in added.items() if k not in headers]


async def _answer(
    asked: _RequestHead, send: Send, status: int, line: str, extra: Iterable[tuple[str, str]] = ()
) -> None:
    """Send an answer of the guard itself: one line of text, or a JSON error for routes of the API."""
    api = asked.path.startswith(UPLOADS)
    body = (json.dumps({"error": line}) if api else line).encode()
    headers = {
        **_FIXED,
        "content-type": "application/json" if api else "text/plain; charset=utf-8",
        "content-length": str(len(body)),
        "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
        "cache-control": "no-store",
        "connection": "close",
        **dict(extra),
    }
    await send(
        {
            "type": "http.response.start",
            "status": status,
            "headers": [(k.encode(), v.encode()) for k, v in headers.items()],
        }
    )
    await send({"type": "http.response.body", "body": body})
