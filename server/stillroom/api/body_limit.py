"""No request is larger than what its route is for, none is sent endlessly slowly, and together they fit into memory."""

import asyncio
import re
from contextlib import suppress
from typing import NamedTuple

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAX_BODY = 32 * 2**20
"""Of an upload."""
MAX_ARCHIVE = 512 * 2**20
MAX_DOCUMENT = 4 * 2**20
"""Of everything else."""
MAX_HELD = 768 * 2**20
"""Of all bodies that a process holds in memory: what comes beyond is put off."""
PATIENCE_S = 30.0
"""A body's next piece has to come within."""
_LARGER = (
    (re.compile(r"/api/v1/robots/[^/]+/maps/[^/]+/missions/[^/]+"), MAX_BODY),
    (re.compile(r"/api/v1/(robots/[^/]+|home)/archive"), MAX_ARCHIVE),
)
_AGAIN = {"Retry-After": "2"}


class _Allowed(NamedTuple):
    size: int
    held: bool
    """Whether it is kept in memory: archives go to a file."""


class BodyLimit:
    """Ends reading a larger body with a 413, whatever its Content-Length says; with 408 one that stops coming, and with 503 one for
    which there is no room now.

    What is too much is read on for a while and thrown away: a client that is cut off in the middle of sending may never see
    the answer.
    """

    def __init__(self, app: ASGIApp, max_held: int = MAX_HELD, patience_s: float = PATIENCE_S) -> None:
        self._app, self._max_held, self._patience_s = app, max_held, patience_s
        self._held = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        allowed = _allowed(scope["path"])
        announced = Headers(scope=scope).get("Content-Length", "")
        received, held, ended = 0, 0, False

        async def receive_within_limit() -> Message:
            nonlocal received, held, ended
            message = await receive() if ended else await self._in_time(receive)
            size = len(message.get("body", b""))
            received, ended = received + size, not message.get("more_body")
            if received > allowed.size or (announced.isdecimal() and int(announced) > allowed.size):
                with suppress(HTTPException):
                    while message.get("more_body") and received < 2 * MAX_BODY:
                        message = await self._in_time(receive)
                        received += len(message.get("body", b""))
                raise HTTPException(413, f"A body has at most {allowed.size} bytes here.")
            if allowed.held and size:
                if self._held + size > self._max_held:
                    raise HTTPException(503, "The service reads too much at the moment.", _AGAIN)
                held, self._held = held + size, self._held + size
            return message

        try:
            await self._app(scope, receive_within_limit, send)
        finally:
            self._held -= held

    async def _in_time(self, receive: Receive) -> Message:
        try:
            async with asyncio.timeout(self._patience_s):
                return await receive()
        except TimeoutError:
            raise HTTPException(408, f"Nothing came for {self._patience_s:g} s.") from None


def _allowed(path: str) -> _Allowed:
    size = next((most for known, most in _LARGER if known.fullmatch(path)), MAX_DOCUMENT)
    return _Allowed(size, held=size != MAX_ARCHIVE)
