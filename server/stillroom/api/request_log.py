"""A line for each request in the log, and an id that answers, log lines and those who ask about them have in common."""

import re
import secrets
from time import perf_counter

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADER = "X-Request-Id"
_GIVEN = re.compile(r"[A-Za-z0-9._-]{1,64}")
_LOGGED = ("/api/", "/login")
"""What else is asked are the web app's files, and how the service is, all the time."""

log = structlog.get_logger()


class RequestLog:
    """Takes the id that a request brings, or gives it one."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        request = given if _GIVEN.fullmatch(given) else secrets.token_hex(8)
        status, began = 0, perf_counter()

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[HEADER] = request
            await send(message)

        with structlog.contextvars.bound_contextvars(request=request):
            try:
                await self._app(scope, receive, send_with_id)
            finally:
                if scope["path"].startswith(_LOGGED):
                    ms = round((perf_counter() - began) * 1000, 1)
                    # without the query: it may hold what signs somebody in
                    log.info("request", method=scope["method"], path=scope["path"], status=status, ms=ms)
