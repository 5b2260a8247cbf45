"""People decide conflicts."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request
from starlette.responses import Response

from stillroom.api.context import Caller, Limit, MapName, NumberCursor, RobotId, Service, allowed, document, page
from stillroom.documents import api
from stillroom.documents.conflicts import ConflictDocument
from stillroom.service import conflicts

router = APIRouter()
_OF_MAP = "/api/v1/robots/{robot}/maps/{map}/conflicts"
_READ = [Depends(allowed("read"))]
ConflictId = Annotated[str, Path(alias="conflict", pattern=r"^[^\x00-\x1f\x7f]{1,200}$")]
State = Annotated[api.ConflictState | None, Query()]


@router.get("/api/v1/conflicts", response_model=api.Page[ConflictDocument])
def list_all_conflicts(
    request: Request, service: Service, who: Caller, cursor: NumberCursor, state: State = None, limit: Limit = 100
) -> Response:
    """Of all maps that the caller may see, the newest first."""
    return page(request, conflicts.list_all_conflicts(service.database, who, state, cursor, limit))


@router.get(_OF_MAP, response_model=api.Page[ConflictDocument], dependencies=_READ)
def list_conflicts(
    request: Request,
    service: Service,
    robot: RobotId,
    map_name: MapName,
    cursor: NumberCursor,
    state: State = None,
    limit: Limit = 100,
) -> Response:
    """The newest first."""
    return page(request, conflicts.list_conflicts(service.database, robot, map_name, state, cursor, limit))


@router.get(_OF_MAP + "/{conflict}", response_model=ConflictDocument, dependencies=_READ)
def show_conflict(service: Service, robot: RobotId, map_name: MapName, key: ConflictId) -> Response:
    return document(conflicts.conflict_by_key(service.database, robot, map_name, key))
