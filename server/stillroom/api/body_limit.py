"""No request is larger than 32 MiB, but for archives."""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAX_BODY = 32 * 2**20
MAX_ARCHIVE = 512 * 2**20
_ARCHIVES = "/archive"
"""What paths of requests that bring an archive end with. They are not read before it is known who sends them."""


class BodyLimit:
    """Ends reading a larger body with a 413, whatever its Content-Length says.

    What is too much is read on for a while and thrown away: a client that is cut off in the middle of sending may never see
    the answer.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit = MAX_ARCHIVE if scope["path"].endswith(_ARCHIVES) else MAX_BODY
        announced = Headers(scope=scope).get("Content-Length", "")
        received = 0

        async def receive_within_limit() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > limit or (announced.isdecimal() and int(announced) > limit):
                while message.get("more_body") and received < 2 * MAX_BODY:
                    message = await receive()
                    received += len(message.get("body", b""))
                raise HTTPException(413, f"A body has at most {limit} bytes.")
            return message

        await self._app(scope, receive_within_limit, send)
