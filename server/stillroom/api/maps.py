"""Maps and their versions, to be read."""

from fastapi import APIRouter, Depends, Request
from starlette.responses import Response

from stillroom.api.context import (
    PNG_RESPONSE,
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
    etag,
    is_known,
    page,
    parts_of,
    plain_document,
    png,
)
from stillroom.documents import api
from stillroom.documents.geojson import RoomFeature
from stillroom.service import maps

router = APIRouter(prefix="/api/v1/robots/{robot}/maps/{map}")
_READ = [Depends(allowed("read"))]


@router.get("", response_model=api.MapDocument, dependencies=_READ)
def show_map(request: Request, robot: RobotId, map_name: MapName) -> Response:
    """The version in force."""
    database = parts_of(request).database
    if "If-None-Match" in request.headers:
        _, number = maps.version_in_force(database, robot, map_name)
        if is_known(request, etag(number)["ETag"]):
            return Response(status_code=304, headers=etag(number))
    found = maps.show_map(database, robot, map_name)
    return plain_document(found, etag(found["version"]))


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
    found = maps.show_map(service.database, robot, map_name, number)
    if is_known(request, etag(number)["ETag"]):
        return Response(status_code=304, headers=etag(number))
    return plain_document(found, etag(number))


@router.get("/versions/{version}/grid.png", response_class=Response, responses=PNG_RESPONSE, dependencies=_READ)
def show_grid(request: Request, service: Service, robot: RobotId, map_name: MapName, number: VersionNumber) -> Response:
    """The occupancy pixels as the robot sent them, whatever the meta layer says."""
    return png(request, maps.version_grid(service.database, service.grids, robot, map_name, number))


@router.get("/versions/{version}/cells.png", response_class=Response, responses=PNG_RESPONSE, dependencies=_READ)
def show_cells(
    request: Request, service: Service, robot: RobotId, map_name: MapName, number: VersionNumber
) -> Response:
    """What the occupancy pixels mean: 254 free, 0 occupied, 205 unexplored."""
    return png(request, maps.version_cells(service.database, service.grids, robot, map_name, number))


@router.get("/rooms/{room}", response_model=RoomFeature | api.RetiredRoom, dependencies=_READ)
def show_room(service: Service, robot: RobotId, map_name: MapName, room: FeatureId) -> Response:
    """The room, or where its space went, for any id that ever was."""
    return document(maps.find_room(service.database, robot, map_name, room))


@router.get("/segments", response_model=list[api.Segment], dependencies=_READ)
def list_segments(service: Service, robot: RobotId, map_name: MapName) -> Response:
    """Rooms as Home Assistant's vacuum integration wants them."""
    return bare_array(maps.map_segments(service.database, robot, map_name))
