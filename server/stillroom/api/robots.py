"""Robots: registered, claimed, given up, and their tokens."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from stillroom.api.context import (
    Caller,
    HumanCaller,
    Limit,
    RobotId,
    Service,
    allowed,
    document,
    may,
    page,
    source_of,
)
from stillroom.documents import api
from stillroom.documents.robots import Claim, ClaimCode, RobotChange, RobotDocument, RobotToken
from stillroom.service import maps, robots

router = APIRouter(prefix="/api/v1")
Cursor = Annotated[str, Query(max_length=64)]
_NO_STORE = {"Cache-Control": "no-store"}
"""For what is shown once."""


@router.post("/robots", status_code=201, response_model=api.CreatedRobot, dependencies=[Depends(may("register"))])
def add_robot(service: Service, new: api.NewRobot) -> Response:
    return document(robots.add_robot(service.database, new), 201, {"Location": "/api/v1/robots"} | _NO_STORE)


@router.get("/robots", response_model=api.Page[api.RobotSummary], dependencies=[Depends(may("list"))])
def list_robots(request: Request, service: Service, who: Caller, cursor: Cursor = "", limit: Limit = 100) -> Response:
    """Those that the caller may see, with their maps."""
    return page(request, maps.list_robots(service.database, who, cursor, limit))


@router.get("/registry", response_model=api.Page[RobotDocument], dependencies=[Depends(may("register"))])
def list_registered(request: Request, service: Service, cursor: Cursor = "", limit: Limit = 100) -> Response:
    """All robots, whose they are, and nothing of their maps."""
    return page(request, robots.list_all(service.database, cursor, limit))


@router.post("/claims", status_code=201, response_model=RobotDocument, dependencies=[Depends(may("household"))])
def claim(request: Request, service: Service, who: HumanCaller, given: Claim) -> Response:
    """Makes a robot one's own that is nobody's, by the code that came with it."""
    made = robots.claim(service.database, who, given.claim_code, source_of(request))
    return document(made, 201, {"Location": f"/api/v1/robots/{made.id}"})


@router.get("/robots/{robot}", response_model=RobotDocument, dependencies=[Depends(allowed("read"))])
def show(service: Service, robot: RobotId) -> Response:
    return document(robots.robot(service.database, robot))


@router.patch("/robots/{robot}", response_model=RobotDocument, dependencies=[Depends(allowed("manage"))])
def change(service: Service, robot: RobotId, wanted: RobotChange) -> Response:
    return document(robots.rename(service.database, robot, wanted.name))


@router.post("/robots/{robot}/release", response_model=ClaimCode, dependencies=[Depends(allowed("release"))])
def release(service: Service, robot: RobotId) -> Response:
    """Gives it up. Its maps stay with who gives it up, as a robot of another id that uploads nothing; whoever claims it next
    begins without any. Until then it uploads nothing; a token that its owner was shown ends."""
    return document(robots.release(service.database, robot), headers=_NO_STORE)


@router.post("/robots/{robot}/claim-code", response_model=ClaimCode, dependencies=[Depends(may("register"))])
def new_code(service: Service, robot: RobotId) -> Response:
    """In place of one that was lost; of a robot that is nobody's."""
    return document(robots.new_code(service.database, robot), headers=_NO_STORE)


@router.post("/robots/{robot}/token", response_model=RobotToken, dependencies=[Depends(allowed("rekey"))])
def new_token(service: Service, robot: RobotId) -> Response:
    """The old one does not work any more."""
    return document(robots.new_token(service.database, robot), headers=_NO_STORE)


@router.delete("/robots/{robot}/token", status_code=204, dependencies=[Depends(allowed("disconnect"))])
def revoke_token(service: Service, robot: RobotId) -> Response:
    """Shuts the robot out; what it uploaded stays."""
    robots.revoke_token(service.database, robot)
    return Response(status_code=204)
