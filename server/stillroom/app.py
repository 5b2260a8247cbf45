"""The web application: routers, errors and headers put together."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

from fastapi import APIRouter, Depends, FastAPI

from stillroom import __version__
from stillroom.api import (
    account,
    alerts,
    conflicts,
    edits,
    events,
    exports,
    fleet,
    health,
    homes,
    inspection,
    maps,
    missions,
    notifications,
    people,
    privacy,
    problems,
    provider,
    robots,
    rollouts,
    schema,
    signing_in,
    web,
    webhooks,
)
from stillroom.api.body_limit import BodyLimit
from stillroom.api.context import Parts
from stillroom.api.intake import IntakeGate
from stillroom.api.protection import FairShare, SecurityHeaders
from stillroom.api.request_log import RequestLog
from stillroom.service.looking import Log
from stillroom.service.signals import Signals
from stillroom.settings import Settings

STATIC = Path(__file__).parent / "static"
NOTED = (robots, missions, maps, conflicts, edits, exports)
"""What people do there stands in the log of the robot."""


PARTS = (
    missions,
    maps,
    robots,
    signing_in,
    provider,
    account,
    homes,
    people,
    conflicts,
    edits,
    exports,
    privacy,
    events,
    notifications,
    webhooks,
    fleet,
    inspection,
    rollouts,
    alerts,
    health,
    problems,
)
"""In the order in which their paths are tried: first what robots ask all the time."""


def _routes() -> APIRouter:
    routes = APIRouter()
    for part in PARTS:
        noted = [Depends(privacy.noted)] if part in NOTED else []
        routes.include_router(part.router, dependencies=noted)
    return routes


_ROUTES = _routes()
"""All apps share them: what a request has to be checked for is found out at the first one, and takes a tenth of a second."""


def create_app(settings: Settings, signals: Signals | None = None, static: Path = STATIC) -> FastAPI:
    """Nothing is opened before the app is started or the first request needs it."""
    parts = Parts(
        settings.database_url,
        settings.grid_store_url,
        settings.admin_token,
        settings.resolvers,
        static,
        signals or Signals(),
        settings.messaging,
        settings.queue,
        settings.provider,
    )
    app = FastAPI(
        title="stillroom",
        version=__version__,
        description="Keeps a home's rooms still while the robot's map under them moves.",
        docs_url=None,
        redoc_url=None,
        lifespan=partial(_listening, parts),
    )
    app.state.parts, app.state.log = parts, Log()
    problems.install(app)
    app.add_middleware(BodyLimit)
    app.add_middleware(IntakeGate, intake=parts.intake)
    app.add_middleware(FairShare)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(RequestLog)
    app.router.routes.extend(_ROUTES.routes)
    schema.install(app)
    app.include_router(web.router)  # last: it takes every path that is left
    return app


@asynccontextmanager
async def _listening(parts: Parts, _app: FastAPI) -> AsyncIterator[None]:
    """While the app runs, it hears what other processes do to the same database."""
    with parts.database.listening(parts.signals.hear, parts.signals.catch_up):
        yield
