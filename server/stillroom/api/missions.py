"""A robot uploads missions."""

import asyncio
import re
from contextlib import suppress
from time import monotonic
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from stillroom.api.context import (
    PNG_RESPONSE,
    AnyMissionId,
    Caller,
    Limit,
    MapName,
    MissionId,
    NumberCursor,
    Parts,
    RobotId,
    Service,
    allowed,
    document,
    page,
    parts_of,
    png,
)
from stillroom.api.multipart import Part, read_parts
from stillroom.documents import api
from stillroom.errors import Fault, InvalidInput
from stillroom.service import missions, placements, uploads
from stillroom.service.signals import NONE_YET, Watch

MAX_WAIT_S = 60.0
_RECHECK_S = 2.0
"""A waiter looks again this often, in case the word that its mission is done was lost with a worker."""

PLACEMENT_WAIT_S = 30.0
PREFER: dict[str, Any] = {
    "name": "Prefer",
    "in": "header",
    "schema": {"type": "string"},
    "description": "wait=SECONDS: answer when the mission is done, or after that long (at most 60; RFC 7240)",
}

router = APIRouter(prefix="/api/v1/robots/{robot}/maps/{map}/missions")
_UPLOAD: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["grid", "meta"],
                    "properties": {
                        "grid": {"type": "string", "format": "binary", "description": "The occupancy grid"},
                        "meta": {"$ref": "#/components/schemas/MissionMeta"},
                    },
                },
                "encoding": {
                    "grid": {"contentType": "image/png, image/x-portable-graymap, application/json"},
                    "meta": {"contentType": "application/json"},
                },
            }
        },
    },
    "parameters": [PREFER],
}


@router.put(
    "/{mission}",
    response_model=api.MissionDocument,
    responses={201: {"model": api.MissionDocument}, 202: {"model": api.MissionDocument}},
    openapi_extra=_UPLOAD,
    dependencies=[Depends(allowed("upload"))],
)
async def upload(request: Request, robot: RobotId, map_name: MapName, key: MissionId) -> Response:
    """Stores a mission durably and queues it."""
    service = parts_of(request)
    wait_s = wait_preference(request.headers.getlist("Prefer"))
    headers = {"Location": request.url.path}
    with service.signals.watch(NONE_YET) as watch:
        received = await _receive(request, service, robot, map_name, key, watch)
        with service.intake.waiting() as may_wait:
            if wait_s is not None and may_wait:
                headers["Preference-Applied"] = f"wait={wait_s:g}"
            wait_s = wait_s or 0.0 if may_wait else 0.0
            mission = await _wait(service, watch, received.mission_id, wait_s, look_first=not received.made)
    return document(mission, _status(received, mission), headers)


@router.post(
    "/{mission}/placement",
    response_model=api.MissionDocument,
    responses={202: {"model": api.MissionDocument}},
    openapi_extra={"parameters": [PREFER]},
    dependencies=[Depends(allowed("edit"))],
)
async def place(
    request: Request,
    service: Service,
    who: Caller,
    robot: RobotId,
    map_name: MapName,
    key: MissionId,
    placement: api.Placement,
) -> Response:
    """Says which floor a parked mission belongs to: another one, a new one, or this one after a reset.

    The answer comes when the mission has been processed there, or with 202 after 30 s or what `Prefer` says.
    """
    made = await run_in_threadpool(placements.place, service.database, who, robot, map_name, key, placement.map)
    wait_s = wait_preference(request.headers.getlist("Prefer"))
    with service.signals.watch(made.map_id) as watch:
        placed = await _wait(service, watch, made.placed_id, PLACEMENT_WAIT_S if wait_s is None else wait_s)
    parked = await run_in_threadpool(missions.mission_by_id, service.database, made.parked_id)
    return document(parked, 200 if placed.status == "done" else 202)


@router.get("", response_model=api.Page[api.MissionDocument], dependencies=[Depends(allowed("read"))])
def list_missions(
    request: Request,
    service: Service,
    robot: RobotId,
    map_name: MapName,
    cursor: NumberCursor,
    outcome: Annotated[api.Outcome | None, Query()] = None,
    limit: Limit = 100,
) -> Response:
    """The newest arrivals first."""
    return page(request, missions.list_missions(service.database, robot, map_name, outcome, cursor, limit))


@router.get("/{mission}", response_model=api.MissionDocument, dependencies=[Depends(allowed("read"))])
def show_mission(service: Service, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    return document(missions.mission_by_key(service.database, robot, map_name, key))


@router.get(
    "/{mission}/grid.png",
    response_class=Response,
    responses=PNG_RESPONSE,
    dependencies=[Depends(allowed("read"))],
)
def show_grid(request: Request, service: Service, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    """The occupancy pixels as the robot sent them, taken or not."""
    return png(request, missions.mission_grid(service.database, service.grids, robot, map_name, key))


@router.get(
    "/{mission}/cells.png",
    response_class=Response,
    responses=PNG_RESPONSE,
    dependencies=[Depends(allowed("read"))],
)
def show_cells(request: Request, service: Service, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    """What the occupancy pixels mean: 254 free, 0 occupied, 205 unexplored."""
    return png(request, missions.mission_cells(service.database, service.grids, robot, map_name, key))


def wait_preference(prefer: list[str]) -> float | None:
    """Seconds that the caller would wait (RFC 7240), at most 60; None where it would not."""
    match = re.search(r"(?:^|[,;]\s*)wait\s*=\s*\"?(\d{1,9})", ",".join(prefer), re.IGNORECASE)
    return None if match is None else min(float(match[1]), MAX_WAIT_S)


async def _receive(
    request: Request, service: Parts, robot: str, map_name: str, key: str, watch: Watch
) -> uploads.Received:
    """Nothing of its body is kept when this returns, however long the caller waits afterwards; `watch` misses nothing of the mission."""
    async with service.intake.receiving():
        parts = await read_parts(request)
        grid, meta = _part(parts, "grid"), _part(parts, "meta")
        return await run_in_threadpool(
            uploads.receive,
            service.database,
            service.grids,
            robot,
            map_name,
            key,
            (grid.content_type, bytes(grid.content)),
            bytes(meta.content),
            watch.follow,
        )


def _part(parts: dict[str, Part], name: str) -> Part:
    if name not in parts:
        raise InvalidInput(f"The upload has no part {name}.", (Fault(f"/{name}", "missing"),))
    return parts[name]


async def _wait(
    service: Parts, watch: Watch, mission_id: int, wait_s: float, look_first: bool = True
) -> api.MissionDocument:
    """The mission when it is done, or after `wait_s`. `look_first`: it may be done already, without a word to `watch`."""
    until = monotonic() + wait_s
    while True:
        left = until - monotonic()
        if not look_first and left > 0 and not service.signals.closed:
            with suppress(TimeoutError):
                async with asyncio.timeout(min(left, _RECHECK_S)):
                    await watch.changed.wait()
        look_first = False
        watch.changed.clear()
        mission = await run_in_threadpool(missions.mission_by_id, service.database, mission_id)
        if mission.status == "done" or monotonic() >= until or service.signals.closed:
            return mission


def _status(received: uploads.Received, mission: api.MissionDocument) -> int:
    if mission.status != "done":
        return 202
    return 201 if received.made else 200
