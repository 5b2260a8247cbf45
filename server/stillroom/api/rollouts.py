"""For fleet engineers: another setting of the pipeline tried beside the one in force, then in more and more homes."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request
from starlette.responses import Response

from stillroom.api.context import Caller, Limit, NumberCursor, Service, document, may, page
from stillroom.documents import rollouts as documents
from stillroom.documents.api import Page
from stillroom.service.fleet import rollouts

router = APIRouter(prefix="/api/v1/fleet/rollouts", dependencies=[Depends(may("figures"))])
_TRIAGE = [Depends(may("triage"))]
Name = Annotated[str, Path(alias="rollout", pattern=r"^[a-z0-9][a-z0-9-]{0,19}$")]
RobotName = Annotated[str | None, Query(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
OfMap = Annotated[str | None, Query(alias="map", pattern=r"^[A-Za-z0-9._-]{1,64}$")]


@router.post("", status_code=201, response_model=documents.RolloutReport, dependencies=_TRIAGE)
def start(service: Service, who: Caller, new: documents.NewRollout) -> Response:
    """Begins beside the setting in force: no home's map is touched."""
    made = rollouts.start(service.database, who, new)
    return document(made, 201, {"Location": f"/api/v1/fleet/rollouts/{made.name}"})


@router.get("", response_model=Page[documents.RolloutDocument])
def list_rollouts(request: Request, service: Service, cursor: NumberCursor, limit: Limit = 100) -> Response:
    """The newest first."""
    return page(request, rollouts.list_rollouts(service.database, cursor, limit))


@router.get("/{rollout}", response_model=documents.RolloutReport)
def show(service: Service, name: Name) -> Response:
    """With its numbers so far, and each time that it was decided."""
    return document(rollouts.report(service.database, name))


@router.post("/{rollout}/advance", response_model=documents.RolloutReport, dependencies=_TRIAGE)
def lead_on(service: Service, name: Name) -> Response:
    """To the next stage; refused where its gates are not passed."""
    return document(rollouts.lead_on(service.database, name))


@router.post("/{rollout}/end", response_model=documents.RolloutReport, dependencies=_TRIAGE)
def end(service: Service, who: Caller, name: Name, why: documents.EndRollout) -> Response:
    """Homes go back to what they had. Also withdraws one that was successful and is in force."""
    return document(rollouts.stop(service.database, who, name, why))


@router.get("/{rollout}/maps", response_model=Page[documents.ChangedMap])
def list_changed_maps(
    request: Request, service: Service, name: Name, cursor: NumberCursor, limit: Limit = 100
) -> Response:
    """Those that the candidate changed."""
    return page(request, rollouts.list_changed_maps(service.database, name, cursor, limit))


@router.post("/{rollout}/revert", response_model=documents.RevertedMaps, dependencies=_TRIAGE)
def revert(
    service: Service,
    who: Caller,
    name: Name,
    cursor: NumberCursor,
    robot: RobotName = None,
    map_name: OfMap = None,
) -> Response:
    """Takes back what the candidate made of maps: of all (50 at once; go on with `next`), of a robot, or of one. Edits of people stay."""
    return document(rollouts.revert(service.database, who, name, robot, map_name, cursor))
