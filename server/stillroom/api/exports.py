"""Maps in the formats of others."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from stillroom.api.context import MapName, RobotId, Service, VersionNumber, allowed
from stillroom.documents.exports import ExportFormat
from stillroom.service import exports

router = APIRouter(prefix="/api/v1/robots/{robot}/maps/{map}")
_FILE: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "content": {
            "application/geo+json": {},
            "application/zip": _FILE,
            "application/json": {},
            "image/png": _FILE,
        }
    }
}


@router.get(
    "/versions/{version}/export",
    response_class=Response,
    responses=_RESPONSES,
    dependencies=[Depends(allowed("read"))],
)
def export_version(
    service: Service,
    robot: RobotId,
    map_name: MapName,
    number: VersionNumber,
    kind: Annotated[ExportFormat, Query(alias="format")],
) -> Response:
    """A version as a file: GeoJSON, Nav2's YAML and PGM or keep-out mask in a zip, OccupancyGrid JSON, Valetudo JSON, a picture."""
    made, name = exports.export_version(service.database, service.grids, robot, map_name, number, kind)
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(made.content, media_type=made.media_type, headers=headers)
