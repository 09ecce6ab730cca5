"""Access control and content security policy of the studio: the outermost layer of the server.

Every request needs a key. A browser enters with a single-use address and receives a cookie that expires. A program
sends the token in an ``Authorization: Bearer`` header (`keys`). Requests for a host name other than the loopback's
(DNS rebinding) and requests from other sites (cross-site request forgery) are refused before any other code sees
them.

The content policy allows only the studio's own files, with two exceptions for NiceGUI. Its inline scripts and styles
get a nonce, which is new for every page. It sends component calls as text that the page evaluates, which requires
``unsafe-eval``. This text arrives only through the guarded connection.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Callable
from contextlib import suppress

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from leafcut.studio.folder import LARGEST_UPLOAD
from leafcut.studio.keys import COOKIE_SECONDS, StudioKeys

#: Maximum size of a request body without files, bytes. Uploads have a different limit (`LARGEST_UPLOAD`).
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
    """A request is too large. The code that reads the request receives this exception."""


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
    """An ASGI application that protects another application.

    Hosts and origins must match `port`, which is the port of this server. When a browser has entered with an access
    key, `on_entry` is called with this key.
    """

    def __init__(
        self,
        app: ASGIApp,
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
        """Forward permitted requests, and refuse all other requests."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        scope["headers"] = [(k, v) for k, v in scope["headers"] if not k.startswith(b"x-forwarded-")]
        asked = _RequestHead(scope)
        refusal = self._reason_to_refuse(asked)
        if scope["type"] == "websocket":
            if refusal or not self._is_authorised(asked):
                await send({"type": "websocket.close", "code": 1008, "reason": ""})
            else:
                await self.app(scope, receive, send)
            return
        if refusal:
            await _refusal_response(asked, 403, refusal)(scope, receive, send)
        elif asked.token is not None:
            await self._exchange_key_for_cookie(asked, scope, receive, send)
        elif self._is_authorised(asked):
            await self._forward_request(asked, scope, receive, send)
        else:
            line = "Open the address that leafcut studio printed last: it contains the key to this page."
            await _refusal_response(asked, 401, line)(scope, receive, send)

    def _reason_to_refuse(self, asked: _RequestHead) -> str:
        """Return why a request is refused regardless of its key, or an empty string if it is permitted."""
        if asked.host not in self.hosts:
            return "This address is not the studio's: use 127.0.0.1 and the port that it printed."
        own_origin = f"http://{asked.host}"
        if asked.origin is not None and asked.origin != own_origin:
            return "A page of another origin must not access the studio."
        # Without a key, the missing key is reported instead.
        if asked.changes and asked.origin is None and self._is_authorised(asked) and not self._has_token(asked):
            return "A request that changes something needs its origin, or the token in an Authorization header."
        if asked.site in ("cross-site", "same-site") and asked.mode != "navigate":
            return "A page of another origin may not load from the studio."
        return ""

    def _is_authorised(self, asked: _RequestHead) -> bool:
        return self._has_token(asked) or self._has_cookie(asked)

    def _has_cookie(self, asked: _RequestHead) -> bool:
        return self.keys.is_cookie(asked.cookies.get(self.cookie, ""))

    def _has_token(self, asked: _RequestHead) -> bool:
        return self.keys.is_token(asked.bearer)

    async def _exchange_key_for_cookie(self, asked: _RequestHead, scope: Scope, receive: Receive, send: Send) -> None:
        """Replace the key in the address with a cookie that scripts cannot read."""
        key = asked.token or ""
        if self.keys.redeem_entry(key):
            self.on_entry(key)
        elif not self._has_cookie(asked):
            line = "This address was used already, or its studio has ended: open the one that leafcut printed last."
            await _refusal_response(asked, 401, line)(scope, receive, send)
            return
        answer = _add_headers(RedirectResponse("/", 303))
        self._set_cookie(answer.headers)
        await answer(scope, receive, send)

    def _set_cookie(self, headers: MutableHeaders) -> None:
        value = self.keys.new_cookie()
        headers.append(
            "set-cookie", f"{self.cookie}={value}; Path=/; Max-Age={COOKIE_SECONDS}; HttpOnly; SameSite=Strict"
        )

    async def _forward_request(self, asked: _RequestHead, scope: Scope, receive: Receive, send: Send) -> None:
        limit = self.largest if asked.path.startswith(UPLOADS) else min(self.largest, LARGEST_REQUEST)
        too_large = _refusal_response(asked, 413, f"This is larger than {limit >> 20} MiB, the studio's limit.")
        if asked.length > limit:
            await too_large(scope, receive, send)
            return
        exchange = _Exchange(receive, send, asked, limit)
        # Reloading the page renews its cookie, so that active users remain logged in.
        if asked.path == "/" and not self._has_token(asked):
            exchange.on_headers = self._set_cookie
        with suppress(RequestRefused):
            await self.app(scope, exchange.receive, exchange.send)
        if exchange.refused and not exchange.begun:
            await too_large(scope, receive, send)


class _RequestHead:
    def __init__(self, scope: Scope) -> None:
        connection = HTTPConnection(scope)
        headers, self.path, self.cookies = connection.headers, str(scope["path"]), connection.cookies
        hosts = headers.getlist("host")
        self.host = hosts[0].lower() if len(hosts) == 1 else ""
        self.origin = headers.get("origin")
        self.site, self.mode = headers.get("sec-fetch-site", ""), headers.get("sec-fetch-mode", "")
        method = scope.get("method", "")
        #: Whether the request may change any state. A websocket may do so, because browsers always send its origin.
        self.changes = scope["type"] == "websocket" or method not in _READING
        kind, _, word = headers.get("authorization", "").partition(" ")
        self.bearer = word.strip() if kind.lower() == "bearer" else ""
        #: The key in the address of the page.
        self.token = connection.query_params.get("token") if (method, self.path) == ("GET", "/") else None
        length = headers.get("content-length", "")
        self.length = int(length) if length.isdecimal() and len(length) < 20 else 0


class _Exchange:
    """Forwards a request and its response. Limits the size of the request, adds headers, and gives each page its nonce.

    At most `limit` bytes of the body are forwarded, regardless of its declared length. If the body is larger, the
    response of the application is dropped.
    """

    def __init__(self, receive: Receive, send: Send, asked: _RequestHead, limit: int) -> None:
        self._receive, self._send, self._asked = receive, send, asked
        self._left = limit
        self.on_headers: Callable[[MutableHeaders], None] = lambda _: None
        self.refused = self.begun = False
        self._held: Message | None = None
        self._nonce = secrets.token_urlsafe(16)
        self._body = bytearray()

    async def receive(self) -> Message:
        """Forward a message that was received. Raises `RequestRefused` if the request is too large."""
        message = await self._receive()
        self._left -= len(message.get("body", b""))
        if self._left < 0:
            self.refused = True
            raise RequestRefused
        return message

    async def send(self, message: Message) -> None:
        """Forward a message. The parts of a page are held back and sent together when the page is complete."""
        if self.refused and not self.begun:
            return
        if message["type"] == "http.response.start":
            self.begun = True
            headers = MutableHeaders(scope=message)
            is_page = headers.get("content-type", "").startswith("text/html")
            if "content-security-policy" not in headers:
                headers["content-security-policy"] = content_policy(self._nonce, self._asked.host)
                self._held = message if is_page else None
            for name, value in {**_FIXED, "cache-control": "no-store"}.items():
                headers.setdefault(name, value)
            self.on_headers(headers)
            if self._held is not None:
                return
        elif self._held is not None and message["type"] == "http.response.body":
            self._body += message.get("body", b"")
            if message.get("more_body", False):
                return
            page = _TAG.sub(rb'<\1 nonce="' + self._nonce.encode() + rb'"', bytes(self._body))
            MutableHeaders(scope=self._held)["content-length"] = str(len(page))
            await self._send(self._held)
            message = {"type": "http.response.body", "body": page}
        await self._send(message)


def _refusal_response(asked: _RequestHead, status: int, line: str) -> Response:
    """Create a response of the guard itself. It is a line of text, or a JSON error for routes of the API."""
    if asked.path.startswith(UPLOADS):
        return _add_headers(JSONResponse({"error": line}, status))
    return _add_headers(PlainTextResponse(line, status))


def _add_headers(answer: Response) -> Response:
    policy = "default-src 'none'; frame-ancestors 'none'"
    own = {"content-security-policy": policy, "cache-control": "no-store", "connection": "close"}
    answer.headers.update({**_FIXED, **own})
    return answer
