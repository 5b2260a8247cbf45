"""Webhooks: which programs are told what happens."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Request
from starlette.responses import Response

from stillroom.api.context import Caller, Limit, NumberCursor, Service, document, may, page
from stillroom.documents import api
from stillroom.documents.notifications import (
    DeliveryDocument,
    NewWebhook,
    WebhookChange,
    WebhookDocument,
    WebhookWithSecret,
)
from stillroom.service import webhooks

router = APIRouter(dependencies=[Depends(may("messages"))])
_BASE = "/api/v1/webhooks"
_ONE = _BASE + "/{webhook}"
WebhookId = Annotated[str, Path(alias="webhook", pattern=r"^[A-Za-z0-9_-]{1,40}$")]
DeliveryId = Annotated[int, Path(alias="delivery", ge=1, le=2**53)]


@router.post(_BASE, status_code=201, response_model=WebhookWithSecret)
def add(service: Service, who: Caller, new: NewWebhook) -> Response:
    """The secret is shown this once."""
    made = webhooks.add_webhook(service.database, who, new, service.messaging.outbound)
    return document(made, 201, {"Location": f"{_BASE}/{made.id}"})


@router.get(_BASE, response_model=api.Page[WebhookDocument])
def list_webhooks(
    request: Request, service: Service, who: Caller, cursor: NumberCursor, limit: Limit = 100
) -> Response:
    """One's own, the oldest first."""
    return page(request, webhooks.list_webhooks(service.database, who, cursor, limit))


@router.get(_ONE, response_model=WebhookDocument)
def show(service: Service, who: Caller, key: WebhookId) -> Response:
    return document(webhooks.webhook(service.database, who, key))


@router.patch(_ONE, response_model=WebhookDocument)
def change(service: Service, who: Caller, key: WebhookId, wanted: WebhookChange) -> Response:
    return document(webhooks.change_webhook(service.database, who, key, wanted, service.messaging.outbound))


@router.delete(_ONE, status_code=204)
def remove(service: Service, who: Caller, key: WebhookId) -> Response:
    webhooks.remove_webhook(service.database, who, key)
    return Response(status_code=204)


@router.post(_ONE + "/secret", response_model=WebhookWithSecret)
def rotate_secret(service: Service, who: Caller, key: WebhookId) -> Response:
    """A new secret, shown this once; for 24 hours messages are signed with the old one as well."""
    return document(webhooks.rotate_secret(service.database, who, key))


@router.post(_ONE + "/test", status_code=202, response_model=DeliveryDocument)
def send_test(service: Service, who: Caller, key: WebhookId) -> Response:
    """Queues an event of the type `test`."""
    return document(webhooks.send_test(service.database, who, key), 202)


@router.get(_ONE + "/deliveries", response_model=api.Page[DeliveryDocument])
def list_deliveries(
    request: Request, service: Service, who: Caller, key: WebhookId, cursor: NumberCursor, limit: Limit = 100
) -> Response:
    """Of the last 30 days, the newest first."""
    return page(request, webhooks.list_deliveries(service.database, who, key, cursor, limit))


@router.post(_ONE + "/deliveries/{delivery}/replay", status_code=202, response_model=DeliveryDocument)
def replay(service: Service, who: Caller, key: WebhookId, number: DeliveryId) -> Response:
    """The same message, with the same `webhook-id`, once more."""
    return document(webhooks.replay(service.database, who, key, number), 202)
