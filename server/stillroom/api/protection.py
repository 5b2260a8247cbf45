"""What every answer says to browsers, and how much one caller may ask at once."""

from collections import Counter
from hashlib import sha256

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from stillroom.api.problems import problem_of
from stillroom.errors import Fault, InvalidInput, StillroomError, TooMany, Unavailable

CONTENT_SECURITY_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self' 'unsafe-inline'",  # Mantine and OpenLayers place things by style attributes
        "img-src 'self' blob: data:",
        "font-src 'self'",
        "connect-src 'self'",
        "worker-src 'self'",
        "manifest-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": CONTENT_SECURITY_POLICY,
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
HTTPS_ONLY = {"Strict-Transport-Security": "max-age=31536000"}
PRIVATE = {"Cache-Control": "no-store"}
"""Of the API's answers that say nothing else: what is somebody's stays in no cache."""
_API = "/api/"

MOST_OF_ONE = 256
"""Requests of one caller that are being answered by this process."""
MOST_OF_ALL = 2048
_AGAIN_S = 1


class SecurityHeaders:
    """Adds the headers to every answer; streams pass untouched."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        said = HEADERS | (HTTPS_ONLY if scope["scheme"] == "https" else {})
        said |= PRIVATE if scope["path"].startswith(_API) else {}

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in said.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers)


class FairShare:
    """Refuses what one caller asks beyond its share, with 429, so that nobody else waits for it; with 503 what is too much at all; and
    with 422 a query that no text of a database can be.

    A caller is who sends a credential, right or wrong, else the address that asks.
    """

    def __init__(self, app: ASGIApp, most_of_one: int = MOST_OF_ONE, most_of_all: int = MOST_OF_ALL) -> None:
        self._app, self._most_of_one, self._most_of_all = app, most_of_one, most_of_all
        self._asking: Counter[bytes] = Counter()
        self._all = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        caller = _caller(scope)
        if self._all >= self._most_of_all:
            refusal: StillroomError | None = Unavailable("The service has too much to do at the moment.", _AGAIN_S)
        elif self._asking[caller] >= self._most_of_one:
            refusal = TooMany(
                f"{self._most_of_one} requests of this caller are being answered; wait for them.", _AGAIN_S
            )
        elif b"%00" in scope["query_string"]:
            refusal = InvalidInput("A query can't hold a NUL.", (Fault("", "%00"),))
        else:
            refusal = None
        if refusal is not None:
            await problem_of(refusal)(scope, receive, send)
            return
        self._asking[caller] += 1
        self._all += 1
        try:
            await self._app(scope, receive, send)
        finally:
            self._all -= 1
            self._asking[caller] -= 1
            if not self._asking[caller]:
                del self._asking[caller]


def _caller(scope: Scope) -> bytes:
    headers = Headers(scope=scope)
    address = (scope.get("client") or ("",))[0]
    said = headers.get("Authorization") or headers.get("Cookie") or str(address)
    return sha256(said.encode("latin-1", "replace")).digest()[:16]
