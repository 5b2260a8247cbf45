"""People decide conflicts."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request
from starlette.responses import Response

from stillroom.api.context import Caller, Limit, MapName, NumberCursor, RobotId, Service, allowed, document, may, page
from stillroom.documents import api
from stillroom.documents.conflicts import ConflictDocument, DecisionRequest, SensedDocument
from stillroom.service import conflicts, decisions
from stillroom.service.sensed import sensed

router = APIRouter()
_OF_MAP = "/api/v1/robots/{robot}/maps/{map}/conflicts"
_READ = [Depends(allowed("read"))]
_EDIT = [Depends(allowed("edit"))]
ConflictId = Annotated[str, Path(alias="conflict", pattern=r"^[^\x00-\x1f\x7f]{1,200}$")]
State = Annotated[api.ConflictState | None, Query()]


@router.get("/api/v1/conflicts", response_model=api.Page[ConflictDocument], dependencies=[Depends(may("list"))])
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


@router.get(_OF_MAP + "/{conflict}/sensed", response_model=SensedDocument, dependencies=_READ)
def show_sensed(service: Service, robot: RobotId, map_name: MapName, key: ConflictId) -> Response:
    """What the robot saw, and where that differs from what was known."""
    return document(sensed(service.database, service.grids, robot, map_name, key))


@router.get(_OF_MAP + "/{conflict}/proposals/{proposal}", response_model=api.MapDocument, dependencies=_READ)
def show_proposal(
    service: Service,
    who: Caller,
    robot: RobotId,
    map_name: MapName,
    key: ConflictId,
    proposal: Annotated[str, Path(pattern=r"^[^\x00-\x1f\x7f]{1,16}$")],
) -> Response:
    """The map that would be in force if it were accepted."""
    return document(decisions.preview_proposal(service.means, who, robot, map_name, key, proposal))


@router.post(_OF_MAP + "/{conflict}/decision", response_model=ConflictDocument | api.EditPreview, dependencies=_EDIT)
def decide(
    service: Service,
    who: Caller,
    robot: RobotId,
    map_name: MapName,
    key: ConflictId,
    decision: DecisionRequest,
    dry_run: Annotated[bool, Query()] = False,
) -> Response:
    """Answered with the conflict as it ended; with `dry_run` with the map that would be in force."""
    if dry_run:
        return document(decisions.preview(service.means, who, robot, map_name, key, decision))
    return document(decisions.decide(service.means, who, robot, map_name, key, decision))


@router.post(_OF_MAP + "/decision", response_model=api.Page[ConflictDocument], dependencies=_EDIT)
def decide_all(service: Service, who: Caller, robot: RobotId, map_name: MapName, decision: DecisionRequest) -> Response:
    """The same answer to all that is open about the map."""
    return document(decisions.decide_all(service.means, who, robot, map_name, decision))
