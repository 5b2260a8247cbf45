"""For fleet engineers: being told where a rate is too high."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path
from starlette.responses import Response

from stillroom.api.context import Caller, Service, document, may
from stillroom.documents.alerts import AlertDocument, NewAlert
from stillroom.documents.api import Page
from stillroom.service.fleet import alerts

router = APIRouter(prefix="/api/v1/fleet/alerts", dependencies=[Depends(may("figures"))])
_TRIAGE = [Depends(may("triage"))]
Name = Annotated[str, Path(alias="alert", pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,63}$")]


@router.get("", response_model=Page[AlertDocument])
def list_alerts(service: Service) -> Response:
    """In order of their names."""
    return document(alerts.list_alerts(service.database))


@router.post("", status_code=201, response_model=AlertDocument, dependencies=_TRIAGE)
def add(service: Service, who: Caller, new: NewAlert) -> Response:
    """Webhooks of the whole fleet (`alert.raised`, `alert.ended`) and those who run the service are told."""
    return document(alerts.add_alert(service.database, who, new), 201)


@router.delete("/{alert}", status_code=204, response_class=Response, dependencies=_TRIAGE)
def remove(service: Service, name: Name) -> Response:
    alerts.remove_alert(service.database, name)
    return Response(status_code=204)
