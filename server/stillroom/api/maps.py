"""Maps, their versions, and what people change."""

import re
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query, Request
from starlette.responses import Response

from stillroom.api.context import (
    PNG_RESPONSE,
    Caller,
    FeatureId,
    Limit,
    MapName,
    NumberCursor,
    RobotId,
    Service,
    VersionNumber,
    allowed,
    bare_array,
    document,
    page,
    png,
)
from stillroom.documents import api
from stillroom.documents.geojson import RoomFeature
from stillroom.documents.operations import EditRequest
from stillroom.errors import InvalidInput, PreconditionRequired
from stillroom.service import edits, maps

router = APIRouter(prefix="/api/v1/robots/{robot}/maps/{map}")
_READ = [Depends(allowed("read"))]
_EDIT = [Depends(allowed("edit"))]
IfMatch = Annotated[str | None, Header()]


@router.get("", response_model=api.MapDocument, dependencies=_READ)
def show_map(request: Request, service: Service, robot: RobotId, map_name: MapName) -> Response:
    """The version in force."""
    _, number = maps.version_in_force(service.database, robot, map_name)
    if _is_known(request, number):
        return Response(status_code=304, headers=_tag(number))
    found = maps.map_document(service.database, robot, map_name)
    return document(found, headers=_tag(found.version) | {"Cache-Control": "private, no-cache"})


@router.patch("", response_model=api.MapSummary, dependencies=_EDIT)
def change_settings(service: Service, robot: RobotId, map_name: MapName, settings: api.MapSettings) -> Response:
    """What people call the map, and whether updates that are not certain wait for them."""
    return document(edits.change_settings(service.database, robot, map_name, settings))


@router.get("/versions", response_model=api.Page[api.VersionListItem], dependencies=_READ)
def list_versions(
    request: Request,
    service: Service,
    robot: RobotId,
    map_name: MapName,
    cursor: NumberCursor,
    limit: Limit = 100,
) -> Response:
    """The newest first."""
    return page(request, maps.list_versions(service.database, robot, map_name, cursor, limit))


@router.get("/versions/{version}", response_model=api.MapDocument, dependencies=_READ)
def show_version(
    request: Request, service: Service, robot: RobotId, map_name: MapName, number: VersionNumber
) -> Response:
    """Any version; they never change."""
    found = maps.map_document(service.database, robot, map_name, number)
    if _is_known(request, number):
        return Response(status_code=304, headers=_tag(number))
    return document(found, headers=_tag(number) | {"Cache-Control": "private, max-age=31536000, immutable"})


@router.get("/versions/{version}/grid.png", response_class=Response, responses=PNG_RESPONSE, dependencies=_READ)
def show_grid(service: Service, robot: RobotId, map_name: MapName, number: VersionNumber) -> Response:
    """The occupancy pixels as the robot sent them, whatever the meta layer says."""
    return png(maps.version_grid(service.database, service.grids, robot, map_name, number), f"v{number}")


@router.get("/versions/{version}/cells.png", response_class=Response, responses=PNG_RESPONSE, dependencies=_READ)
def show_cells(service: Service, robot: RobotId, map_name: MapName, number: VersionNumber) -> Response:
    """What the occupancy pixels mean: 254 free, 0 occupied, 205 unexplored."""
    return png(maps.version_cells(service.database, service.grids, robot, map_name, number), f"v{number}-cells")


@router.post("/versions/{version}/restore", status_code=201, response_model=api.MapDocument, dependencies=_EDIT)
def restore_version(
    service: Service, who: Caller, robot: RobotId, map_name: MapName, number: VersionNumber
) -> Response:
    """An old version again, as a new one."""
    made = edits.restore_version(service.database, who, robot, map_name, number)
    return document(made, 201, _tag(made.version))


@router.post("/edits", response_model=api.EditedMap, dependencies=_EDIT)
def edit_map(
    service: Service,
    who: Caller,
    robot: RobotId,
    map_name: MapName,
    edit: EditRequest,
    if_match: IfMatch = None,
    dry_run: Annotated[bool, Query()] = False,
) -> Response:
    """All operations or none, as one new version."""
    operations = [operation.as_operation() for operation in edit.operations]
    expected = expected_version(if_match)
    made = edits.edit_map(service.database, who, robot, map_name, expected, operations, dry_run)
    return document(made, headers={} if dry_run else _tag(made.version))


@router.get("/rooms/{room}", response_model=RoomFeature | api.RetiredRoom, dependencies=_READ)
def show_room(service: Service, robot: RobotId, map_name: MapName, room: FeatureId) -> Response:
    """The room, or where its space went, for any id that ever was."""
    return document(maps.find_room(service.database, robot, map_name, room))


@router.get("/segments", response_model=list[api.Segment], dependencies=_READ)
def list_segments(service: Service, robot: RobotId, map_name: MapName) -> Response:
    """Rooms as Home Assistant's vacuum integration wants them."""
    return bare_array(maps.map_segments(service.database, robot, map_name))


def expected_version(if_match: str | None) -> int:
    """The version that If-Match names. Raises PreconditionRequired, InvalidInput."""
    if if_match is None:
        raise PreconditionRequired('Say which version the edit was made to: If-Match: "v7".')
    match = re.fullmatch(r'\s*(?:W/)?"v(\d{1,9})"\s*', if_match)
    if match is None:
        raise InvalidInput('If-Match names one version, as its ETag does: "v7".')
    return int(match[1])


def _tag(number: int) -> dict[str, str]:
    return {"ETag": f'"v{number}"'}


def _is_known(request: Request, number: int) -> bool:
    known = [tag.strip().removeprefix("W/") for tag in request.headers.get("If-None-Match", "").split(",")]
    return f'"v{number}"' in known or "*" in known
