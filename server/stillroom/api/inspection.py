"""Fleet engineers look at one mission; owners say whether they may see its floor plan, and see who did."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Request
from starlette.responses import Response

from stillroom.api.context import (
    PNG_RESPONSE,
    AnyMissionId,
    Caller,
    Limit,
    MapName,
    NumberCursor,
    RobotId,
    Service,
    allowed,
    document,
    may,
    page,
)
from stillroom.documents import inspection
from stillroom.documents.api import Page
from stillroom.service.fleet import grants, inspector

router = APIRouter(prefix="/api/v1")
_FIGURES = [Depends(may("figures"))]
_TRIAGE = [Depends(may("triage"))]
_MISSIONS = "/fleet/robots/{robot}/maps/{map}/missions"
GrantId = Annotated[str, Path(alias="grant", pattern=r"^grant_[A-Za-z0-9_-]{1,32}$")]


@router.get(_MISSIONS, response_model=Page[inspection.MissionStep], dependencies=_FIGURES)
def list_steps(
    request: Request, service: Service, robot: RobotId, map_name: MapName, cursor: NumberCursor, limit: Limit = 100
) -> Response:
    """The history of a map, the newest arrivals first: numbers alone."""
    return page(request, inspector.steps(service.database, robot, map_name, cursor, limit))


@router.get(_MISSIONS + "/{mission}", response_model=inspection.InspectedMission, dependencies=_FIGURES)
def inspect(service: Service, who: Caller, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    """Numbers alone: nothing that people wrote, and no place in a home."""
    return document(inspector.numbers(service.database, who, robot, map_name, key))


@router.get(_MISSIONS + "/{mission}/figure", response_model=inspection.PlanFigure, dependencies=_TRIAGE)
def show_figure(service: Service, who: Caller, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    """The floor plan, as the paper's figures show it. With the owner's leave; logged."""
    return document(inspector.figure(service.means, who, robot, map_name, key))


@router.get(_MISSIONS + "/{mission}/cells.png", response_class=Response, responses=PNG_RESPONSE, dependencies=_TRIAGE)
def show_cells(service: Service, who: Caller, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    """What the robot sensed. With the owner's leave; logged, each time anew."""
    content = inspector.cells(service.means, who, robot, map_name, key)
    return Response(content, media_type="image/png", headers={"Cache-Control": "no-store"})


@router.post("/fleet/grants", status_code=201, response_model=inspection.GrantDocument, dependencies=_TRIAGE)
def ask(service: Service, who: Caller, request: inspection.GrantRequest) -> Response:
    """Asks an owner for leave to look at floor plans of a robot."""
    made = grants.ask(service.database, who, request)
    return document(made, 201, {"Location": f"/api/v1/grants/{made.id}"})


@router.get("/grants", response_model=Page[inspection.GrantDocument], dependencies=[Depends(may("messages"))])
def list_grants(request: Request, service: Service, who: Caller, cursor: NumberCursor, limit: Limit = 100) -> Response:
    """An owner's: those about the own robots. An operator's: all that was asked. The newest first."""
    return page(request, grants.list_grants(service.database, who, cursor, limit))


@router.post("/grants/{grant}/answer", response_model=inspection.GrantDocument)
def answer(service: Service, who: Caller, key: GrantId, given: inspection.GrantAnswer) -> Response:
    """The owner's answer."""
    return document(grants.answer(service.database, who, key, given))


@router.delete("/grants/{grant}", response_model=inspection.GrantDocument)
def end(service: Service, who: Caller, key: GrantId) -> Response:
    """The owner takes it back, or who asked does."""
    return document(grants.end(service.database, who, key))


@router.get(
    "/robots/{robot}/views", response_model=Page[inspection.ViewDocument], dependencies=[Depends(allowed("manage"))]
)
def list_views(
    request: Request, service: Service, robot: RobotId, cursor: NumberCursor, limit: Limit = 100
) -> Response:
    """Who looked at floor plans of the robot without being its owner, the newest first."""
    return page(request, grants.list_views(service.database, robot, cursor, limit))


@router.get("/robots/{robot}/test", response_model=inspection.TestRobot, dependencies=[Depends(allowed("manage"))])
def show_test(service: Service, robot: RobotId) -> Response:
    return document(grants.is_test(service.database, robot))


@router.put("/robots/{robot}/test", response_model=inspection.TestRobot, dependencies=[Depends(allowed("manage"))])
def mark_test(service: Service, who: Caller, robot: RobotId, mark: inspection.TestMark) -> Response:
    """Whether those who run the service may always look at the robot's floor plans; whose the robot is says so."""
    return document(grants.mark_test(service.database, who, robot, mark.test))
