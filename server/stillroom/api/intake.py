"""Uploads that can't be taken now are refused before they are read."""

import re

from starlette.types import ASGIApp, Receive, Scope, Send

from stillroom.api.problems import problem_of
from stillroom.errors import Unavailable
from stillroom.service.intake import Intake

_UPLOAD = re.compile(r"/api/v1/robots/[^/]+/maps/[^/]+/missions/[^/]+")


class IntakeGate:
    """Answers uploads with 503 where the intake does not take any; costs next to nothing, however many there are."""

    def __init__(self, app: ASGIApp, intake: Intake) -> None:
        self._app, self._intake = app, intake

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] == "PUT" and _UPLOAD.fullmatch(scope["path"]):
            try:
                await self._intake.check()
            except Unavailable as error:
                await problem_of(error)(scope, receive, send)
                return
        await self._app(scope, receive, send)
