"""People edit maps, look back, and undo."""

import re
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Path, Query
from starlette.responses import Response

from stillroom.api.context import Caller, MapName, RobotId, Service, VersionNumber, allowed, document, etag
from stillroom.api.problems import MEDIA_TYPE
from stillroom.documents import api
from stillroom.documents.operations import EditRequest
from stillroom.errors import InvalidInput, PreconditionRequired
from stillroom.service import edits, history

router = APIRouter(prefix="/api/v1/robots/{robot}/maps/{map}")
_READ = [Depends(allowed("read"))]
_EDIT = [Depends(allowed("edit"))]
IfMatch = Annotated[str | None, Header()]
OtherVersion = Annotated[int, Path(alias="other", ge=0, le=2**31 - 1)]


def _problem(model: type[api.Problem]) -> dict[str, Any]:
    return {"description": model.__doc__ or "", "content": {MEDIA_TYPE: {"schema": {"$ref": _ref(model)}}}}


def _ref(model: type[api.Problem]) -> str:
    return f"#/components/schemas/{model.__name__}"


@router.post(
    "/edits",
    response_model=api.EditedMap | api.EditPreview,
    responses={412: _problem(api.StaleEdit), 422: _problem(api.RefusedEdit)},
    dependencies=_EDIT,
)
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
    return document(made, headers={} if dry_run else etag(made.version))


@router.get("/edits/suggested", response_model=api.SuggestedEdit, dependencies=_READ)
def suggest_edit(
    service: Service,
    robot: RobotId,
    map_name: MapName,
    sensitivity: Annotated[float, Query(ge=-10, le=10, allow_inf_nan=False)] = 0.0,
) -> Response:
    """Operations that part the rooms anew, into more rooms the higher the sensitivity is; what people drew stays. Nothing is changed."""
    found = edits.suggest_edit(service.database, robot, map_name, sensitivity)
    return document(found, headers=etag(found.version))


@router.post("/versions/{version}/restore", status_code=201, response_model=api.MapDocument, dependencies=_EDIT)
def restore_version(
    service: Service, who: Caller, robot: RobotId, map_name: MapName, number: VersionNumber
) -> Response:
    """An old version again, as a new one."""
    made = edits.restore_version(service.database, who, robot, map_name, number)
    return document(made, 201, etag(made.version))


@router.post("/versions/{version}/undo", status_code=201, response_model=api.EditedMap, dependencies=_EDIT)
def undo_version(service: Service, who: Caller, robot: RobotId, map_name: MapName, number: VersionNumber) -> Response:
    """What a person changed with this version as it was before, and all else as it is now. To undo that version is to redo."""
    made = edits.undo_version(service.database, who, robot, map_name, number)
    return document(made, 201, etag(made.version))


@router.patch("/versions/{version}", response_model=api.VersionListItem, dependencies=_EDIT)
def name_version(
    service: Service, robot: RobotId, map_name: MapName, number: VersionNumber, change: api.VersionChange
) -> Response:
    """What people call it; nothing else of a version ever changes."""
    return document(history.name_version(service.database, robot, map_name, number, change.name))


@router.get("/versions/{version}/diff/{other}", response_model=api.DiffDocument, dependencies=_READ)
def diff_versions(
    service: Service, robot: RobotId, map_name: MapName, number: VersionNumber, other: OtherVersion
) -> Response:
    """What changed from one version to another, in words and numbers."""
    return document(history.diff_versions(service.database, robot, map_name, number, other))


@router.put("/pin", response_model=api.MapSummary, dependencies=_EDIT)
def pin_map(
    service: Service, who: Caller, robot: RobotId, map_name: MapName, pin: api.PinRequest | None = None
) -> Response:
    """The map stays as it is, or as it was in a version; missions only propose."""
    number = None if pin is None else pin.version
    return document(history.pin_map(service.database, who, robot, map_name, number))


@router.delete("/pin", response_model=api.MapSummary, dependencies=_EDIT)
def unpin_map(service: Service, robot: RobotId, map_name: MapName) -> Response:
    """Missions change the map again."""
    return document(history.unpin_map(service.database, robot, map_name))


@router.patch("", response_model=api.MapSummary, dependencies=_EDIT)
def change_settings(service: Service, robot: RobotId, map_name: MapName, settings: api.MapSettings) -> Response:
    """What people call the map, and whether updates that are not certain wait for them."""
    return document(history.change_settings(service.database, robot, map_name, settings))


def expected_version(if_match: str | None) -> int:
    """The version that If-Match names. Raises PreconditionRequired, InvalidInput."""
    if if_match is None:
        raise PreconditionRequired('Say which version the edit was made to: If-Match: "v7".')
    match = re.fullmatch(r'\s*(?:W/)?"v(\d{1,9})"\s*', if_match)
    if match is None:
        raise InvalidInput('If-Match names one version, as its ETag does: "v7".')
    return int(match[1])
