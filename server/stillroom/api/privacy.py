"""What is kept of a home, for those whose it is."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from stillroom.api.context import SESSION_COOKIE, Caller, RobotId, Service, allowed, document, may
from stillroom.documents.privacy import Erased
from stillroom.service import erasing
from stillroom.service.access import Person

router = APIRouter(prefix="/api/v1")
Confirm = Annotated[str | None, Query(max_length=320, description="The name of what is to be deleted, typed again")]


@router.delete("/robots/{robot}/maps", response_model=Erased, dependencies=[Depends(allowed("manage"))])
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
