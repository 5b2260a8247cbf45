"""What every handler needs: the service's parts, the caller, and the caller's right to what the path names."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path as FilePath
from typing import Annotated, Any

from fastapi import Depends, Path, Query, Request
from pydantic import BaseModel, TypeAdapter
from pydantic_core import to_json
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from stillroom.documents import api
from stillroom.errors import Fault, Forbidden, InvalidInput, Unauthenticated
from stillroom.pipeline.update import ResolverName
from stillroom.service import access, accounts
from stillroom.service.access import Action, Person, Principal, Robot
from stillroom.service.intake import Intake
from stillroom.service.people.sessions import Browser
from stillroom.service.people.throttling import network
from stillroom.service.planning import Means
from stillroom.service.signals import Signals
from stillroom.settings import Messaging, Provider, QueueLimits
from stillroom.store.database import Database
from stillroom.store.grids import GridStore

SESSION_COOKIE = "stillroom_session"
DEVICE_COOKIE = "stillroom_device"
"""Says that somebody has signed in with this browser before."""
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")


@dataclass(frozen=True)
class Parts:
    """Opened when first used, so that the schema can be printed without a database."""

    database_url: str
    grid_store_url: str
    admin_token: str | None
    resolvers: tuple[ResolverName, ...]
    static: FilePath
    signals: Signals
    messaging: Messaging
    queue: QueueLimits
    provider: Provider | None = None
    """Who else vouches for people."""

    @cached_property
    def intake(self) -> Intake:
        return Intake(lambda: self.database, self.queue)

    @cached_property
    def database(self) -> Database:
        return Database(self.database_url, self.signals.hear)

    @cached_property
    def grids(self) -> GridStore:
        return GridStore(self.grid_store_url)

    @property
    def means(self) -> Means:
        """To work out what a decision comes to."""
        return Means(self.database, self.grids, self.resolvers)


def parts_of(request: Request) -> Parts:
    found: Parts = request.app.state.parts
    return found


async def parts(request: Request) -> Parts:
    # Dependencies that wait for nothing are async: each of the others takes a thread. None has others of its own that it can do
    # without: those are looked up again for each that has them.
    return parts_of(request)


Service = Annotated[Parts, Depends(parts)]


def caller(request: Request) -> Principal:
    """Who calls. Raises Unauthenticated, or Forbidden for a request that another site made a browser send."""
    who = request.state.caller = _caller(request, parts_of(request))
    return who


def caller_of(request: Request) -> Principal | None:
    """Who was found to call, by now."""
    found: Principal | None = getattr(request.state, "caller", None)
    return found


def _caller(request: Request, service: Parts) -> Principal:
    scheme, _, token = request.headers.get("Authorization", "").partition(" ")
    if scheme:
        if scheme.lower() != "bearer" or not token.strip():
            raise Unauthenticated("The Authorization header has no bearer token.")
        return accounts.by_token(service.database, token.strip(), service.admin_token)
    cookie = request.cookies.get(SESSION_COOKIE)
    if cookie is None:
        raise Unauthenticated("Send a bearer token, or sign in.")
    if request.method not in SAFE_METHODS:
        same_origin(request)
    return accounts.by_session(service.database, cookie)


def same_origin(request: Request) -> None:
    """Browsers say where a request comes from; those that don't know Sec-Fetch-Site send an Origin.

    Raises Forbidden for a request that another site made a browser send, or that may be one.
    """
    site = request.headers.get("Sec-Fetch-Site")
    origin, host = request.headers.get("Origin"), request.headers.get("Host")
    from_here = origin is not None and origin.partition("://")[2] == host
    if site not in ("same-origin", "none") and not (site is None and from_here):
        raise Forbidden("The request comes from another site.")


def is_from_elsewhere(request: Request) -> bool:
    """Whether a browser came here from a page of another site."""
    return request.headers.get("Sec-Fetch-Site") in ("cross-site", "same-site")


def source_of(request: Request) -> str:
    """Where a request comes from, for counting how often something is tried."""
    return network(request.client.host if request.client else "")


def browser_of(request: Request) -> Browser:
    return Browser(
        source_of(request),
        request.headers.get("User-Agent", ""),
        request.cookies.get(SESSION_COOKIE),
        request.cookies.get(DEVICE_COOKIE),
    )


Caller = Annotated[Principal, Depends(caller)]


async def human(who: Caller) -> Person:
    """Who calls, where `may` lets no robot pass. Raises Forbidden."""
    if isinstance(who, Robot):
        raise Forbidden("A robot may not do this.")
    return who


HumanCaller = Annotated[Person, Depends(human)]
RobotId = Annotated[str, Path(alias="robot", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
MapName = Annotated[str, Path(alias="map", pattern=r"^[A-Za-z0-9._-]{1,64}$")]
MissionId = Annotated[str, Path(alias="mission", pattern=r"^[A-Za-z0-9._-]{1,64}$")]
AnyMissionId = Annotated[str, Path(alias="mission", pattern=r"^[A-Za-z0-9._~-]{1,130}$")]
"""A robot's own, or that of a mission that was placed."""
FeatureId = Annotated[str, Path(pattern=r"^[^\x00-\x1f\x7f]{1,64}$")]
VersionNumber = Annotated[int, Path(alias="version", ge=0, le=2**31 - 1)]
Limit = Annotated[int, Query(ge=1, le=1000)]


def allowed(action: Action) -> Callable[..., Awaitable[None]]:
    """A dependency that lets only those pass who may do `action` to the robot that the path names."""

    async def check(request: Request, who: Caller, robot_id: RobotId) -> None:
        database = parts_of(request).database
        if isinstance(who, Robot):  # its token says all
            access.authorise(database, who, action, robot_id)
        else:
            await run_in_threadpool(access.authorise, database, who, action, robot_id)

    return check


def may(action: Action) -> Callable[..., Awaitable[None]]:
    """A dependency that lets only those pass who may do `action` in this service."""

    async def check(who: Caller) -> None:
        access.authorise_service(who, action)

    return check


async def number_cursor(cursor: Annotated[str | None, Query(max_length=100)] = None) -> int | None:
    """A cursor as `next` gave it. Raises InvalidInput for any other."""
    if cursor is None:
        return None
    if not cursor.isdecimal() or len(cursor) > 18:
        raise InvalidInput("This cursor was not given out here.", (Fault("/cursor", "not a cursor"),))
    return int(cursor)


NumberCursor = Annotated[int | None, Depends(number_cursor)]


def document(body: BaseModel, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """A document that was validated when it was made."""
    return Response(body.model_dump_json(), status, headers, "application/json")


def plain_document(body: Mapping[str, object], headers: Mapping[str, str]) -> Response:
    """The same, of which no model was made."""
    return Response(to_json(body), headers=headers, media_type="application/json")


def etag(version: object) -> dict[str, str]:
    return {"ETag": f'"v{version}"'}


def page(request: Request, body: api.Page[Any]) -> Response:
    headers = {}
    if body.next is not None:
        headers["Link"] = f'<{request.url.include_query_params(cursor=body.next)}>; rel="next"'
    return document(body, headers=headers)


def bare_array(items: list[Any]) -> Response:
    return Response(TypeAdapter(list[Any]).dump_json(items), media_type="application/json")


def is_known(request: Request, tag: str) -> bool:
    """Whether the caller says that it has what is tagged so."""
    known = [one.strip().removeprefix("W/") for one in request.headers.get("If-None-Match", "").split(",")]
    return tag in known or "*" in known


def png(request: Request, content: bytes) -> Response:
    """Browsers keep it, and ask each time whether they may show it: the robot may have changed hands, and the address then names another home's."""
    headers = {"Cache-Control": "private, no-cache", "ETag": f'"{sha256(content).hexdigest()[:32]}"'}
    if is_known(request, headers["ETag"]):
        return Response(status_code=304, headers=headers)
    return Response(content, media_type="image/png", headers=headers)


PNG_RESPONSE: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/png": {"schema": {"type": "string", "format": "binary"}}}},
    304: {"description": "The caller has this picture already"},
}
