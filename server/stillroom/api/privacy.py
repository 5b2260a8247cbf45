"""What is kept of a home, for those whose it is."""

import tempfile
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response, StreamingResponse

from stillroom.api.context import SESSION_COOKIE, Caller, RobotId, Service, allowed, document, may
from stillroom.documents.archives import Archive
from stillroom.documents.privacy import Erased, Imported
from stillroom.errors import UnsupportedFormat
from stillroom.service import archiving, erasing, importing
from stillroom.service.access import Person

router = APIRouter(prefix="/api/v1")
Confirm = Annotated[str | None, Query(max_length=320, description="The name of what is to be deleted, typed again")]


ZIP = "application/zip"
_IN_MEMORY = 2**20
_FILE: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_MANAGE = [Depends(allowed("manage"))]


@router.get(
    "/robots/{robot}/archive", response_class=Response, responses={200: {"content": {ZIP: _FILE}}}, dependencies=_MANAGE
)
def archive(service: Service, robot: RobotId) -> Response:
    """All that is known of a robot's maps as a zip: every version, mission and grid, decisions, events, who looked."""
    pieces = archiving.archive(service.database, service.grids, robot)
    headers = {"Content-Disposition": f'attachment; filename="{robot}.zip"', "Cache-Control": "no-store"}
    return StreamingResponse(pieces, media_type=ZIP, headers=headers)


@router.post(
    "/robots/{robot}/archive",
    status_code=201,
    response_model=Imported,
    openapi_extra={"requestBody": {"required": True, "content": {ZIP: _FILE}}},
    dependencies=_MANAGE,
)
async def bring_in(request: Request, service: Service, robot: RobotId) -> Response:
    """An archive's maps become maps of the robot, all or none; it must have none of the same names. At most 512 MiB."""
    if request.headers.get("Content-Type", "").partition(";")[0].strip().lower() != ZIP:
        raise UnsupportedFormat(f"An archive is {ZIP}.")
    with tempfile.SpooledTemporaryFile(_IN_MEMORY) as file:
        async for chunk in request.stream():
            await run_in_threadpool(file.write, chunk)
        made = await run_in_threadpool(
            lambda: importing.import_archive(service.database, service.grids, robot, Archive(file))
        )
    return document(made, 201)


@router.delete("/robots/{robot}/maps", response_model=Erased, dependencies=_MANAGE)
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
