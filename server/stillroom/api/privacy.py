"""What is kept of a home, for those whose it is."""

import tempfile
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from stillroom.api.context import (
    SAFE_METHODS,
    SESSION_COOKIE,
    Caller,
    HumanCaller,
    Limit,
    NumberCursor,
    RobotId,
    Service,
    allowed,
    caller_of,
    document,
    may,
    page,
    parts_of,
    source_of,
)
from stillroom.documents.api import Page
from stillroom.documents.archives import Archive
from stillroom.documents.privacy import Erased, Imported, ImportedHome, LogEntry, Retention, RetentionDocument
from stillroom.errors import Unavailable, UnsupportedFormat
from stillroom.service import archiving, erasing, importing, looking, retaining
from stillroom.service.access import Person
from stillroom.service.looking import Log

router = APIRouter(prefix="/api/v1")


class Turns:
    """So many archives at once in this process: each takes a thread for long, and those that come up to 512 MiB of disk.

    Raises Unavailable for more.
    """

    def __init__(self, most: int) -> None:
        self._free = threading.Semaphore(most)

    @contextmanager
    def turn(self) -> Iterator[None]:
        if not self._free.acquire(blocking=False):
            raise Unavailable("The service has enough archives in hand at the moment.", 30)
        try:
            yield
        finally:
            self._free.release()


READING, WRITING = Turns(2), Turns(8)


async def noted(request: Request) -> AsyncIterator[None]:
    """People's requests about a robot stand in its log, once they were allowed and answered."""
    yield
    who, robot = caller_of(request), request.path_params.get("robot")
    if isinstance(who, Person) and robot is not None:
        did = "look" if request.method in SAFE_METHODS else "change"
        log: Log = request.app.state.log
        database = parts_of(request).database
        await run_in_threadpool(log.note, database, who, robot, did, _what(request), source_of(request))


def _what(request: Request) -> str:
    """The map, and what of it: as the route is called."""
    route: str = request.scope["route"].path
    of_map = request.path_params.get("map")
    rest = [part for part in route.split("/")[5 if of_map is None else 7 :] if not part.startswith("{")]
    return " ".join(rest) or "robot" if of_map is None else f"{of_map}: {' '.join(rest) or 'map'}"


Confirm = Annotated[str | None, Query(max_length=320, description="The name of what is to be deleted, typed again")]


ZIP = "application/zip"
_IN_MEMORY = 2**20
_FILE: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_ZIPPED: dict[int | str, dict[str, Any]] = {200: {"content": {ZIP: _FILE}}}
_SENDS_ZIP = {"requestBody": {"required": True, "content": {ZIP: _FILE}}}
_MANAGE = [Depends(allowed("manage"))]
_NOTED = [*_MANAGE, Depends(noted)]


@router.get("/robots/{robot}/log", response_model=Page[LogEntry], dependencies=_MANAGE)
def list_log(request: Request, service: Service, robot: RobotId, cursor: NumberCursor, limit: Limit = 100) -> Response:
    """Who looked at the robot's maps and who changed something, the newest first; kept for 400 days."""
    return page(request, looking.entries(service.database, robot, cursor, limit))


@router.get("/home/retention", response_model=RetentionDocument, dependencies=[Depends(may("household"))])
def show_retention(service: Service, who: Caller) -> Response:
    """How long what one's robots sensed is kept."""
    assert isinstance(who, Person)
    return document(retaining.show(service.database, who))


@router.put("/home/retention", response_model=RetentionDocument, dependencies=[Depends(may("household"))])
def choose_retention(
    service: Service, who: Caller, wanted: Retention, dry_run: Annotated[bool, Query()] = False
) -> Response:
    """From now on; `dry_run`: only says what it would come to."""
    assert isinstance(who, Person)
    return document(retaining.choose(service.database, who, wanted, dry_run))


@router.get(
    "/robots/{robot}/archive",
    response_class=Response,
    responses=_ZIPPED,
    dependencies=[Depends(allowed("archive")), Depends(noted)],
)
def archive(service: Service, robot: RobotId) -> Response:
    """All that is known of a robot's maps as a zip: every version, mission and grid, decisions, events, who looked."""
    return _sent(archiving.archive(service.database, service.grids, robot), robot)


@router.get("/home/archive", response_class=Response, responses=_ZIPPED, dependencies=[Depends(may("archive"))])
def archive_home(request: Request, service: Service, who: HumanCaller) -> Response:
    """That of all robots of one's home as one zip, with its people and what it has chosen."""
    assert who.email is not None
    log: Log = request.app.state.log
    log.note_home(service.database, who, "look", "home archive", source_of(request))
    return _sent(archiving.archive_home(service.database, service.grids, who.email), "home")


def _sent(pieces: Iterator[bytes], name: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}.zip"', "Cache-Control": "no-store"}
    return _Zipped(pieces, media_type=ZIP, headers=headers)


class _Zipped(StreamingResponse):
    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        with WRITING.turn():
            await super().__call__(scope, receive, send)


@router.post(
    "/robots/{robot}/archive",
    status_code=201,
    response_model=Imported,
    openapi_extra=_SENDS_ZIP,
    dependencies=_NOTED,
)
async def bring_in(request: Request, service: Service, robot: RobotId) -> Response:
    """An archive's maps become maps of the robot, all or none; it must have none of the same names. At most 512 MiB."""
    return await _read(request, lambda found: importing.import_archive(service.database, service.grids, robot, found))


@router.post(
    "/home/archive",
    status_code=201,
    response_model=ImportedHome,
    openapi_extra=_SENDS_ZIP,
    dependencies=[Depends(may("household"))],
)
async def bring_home_in(request: Request, service: Service, who: HumanCaller) -> Response:
    """An archive's maps, of a robot or of a home, all or none. Those of robots that are one's own become maps of theirs, others are kept
    without a robot. People, settings and logs are not brought in. At most 512 MiB."""
    owner = who.email
    assert owner is not None
    return await _read(request, lambda found: importing.import_home(service.database, service.grids, owner, found))


async def _read(request: Request, bring: Callable[[Archive], BaseModel]) -> Response:
    if request.headers.get("Content-Type", "").partition(";")[0].strip().lower() != ZIP:
        raise UnsupportedFormat(f"An archive is {ZIP}.")
    with READING.turn(), tempfile.SpooledTemporaryFile(_IN_MEMORY) as file:
        async for chunk in request.stream():
            await run_in_threadpool(file.write, chunk)
        made = await run_in_threadpool(lambda: bring(Archive(file)))
    return document(made, 201)


@router.delete("/robots/{robot}/maps", response_model=Erased, dependencies=_MANAGE)
def erase_robot(service: Service, robot: RobotId, confirm: Confirm = None) -> Response:
    """Deletes for good all that is known of a robot, which begins anew; `confirm` is its id. The fleet's figures keep their counts."""
    return document(erasing.erase_robot(service.database, service.grids, robot, confirm))


@router.delete("/home", response_model=Erased, dependencies=[Depends(may("household"))])
def erase_home(service: Service, who: Caller, confirm: Confirm = None) -> Response:
    """Deletes for good all robots' data and the account; `confirm` is the e-mail address. The robots are nobody's afterwards."""
    assert isinstance(who, Person)
    answer = document(erasing.erase_home(service.database, service.grids, who, confirm))
    answer.delete_cookie(SESSION_COOKIE)
    return answer
