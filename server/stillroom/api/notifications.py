"""What people are told: their choice, their address, their browsers."""

from typing import Annotated

from fastapi import APIRouter, Depends, Header, Path, Query
from starlette.responses import HTMLResponse, Response

from stillroom.api.context import Caller, Service, document, may
from stillroom.api.plain_page import plain_page
from stillroom.documents.notifications import (
    NewEmail,
    NewPushSubscription,
    NotificationChoice,
    NotificationSettings,
    PushSubscriptionDocument,
)
from stillroom.errors import InvalidInput
from stillroom.service import notifications
from stillroom.service.messages.words import Page, preferred

router = APIRouter()
_BASE = "/api/v1/notifications"
_MAY = [Depends(may("messages"))]
SubscriptionId = Annotated[str, Path(alias="subscription", pattern=r"^[A-Za-z0-9_-]{1,40}$")]
Languages = Annotated[str, Header(alias="Accept-Language")]
Token = Annotated[str, Query(max_length=2000)]


@router.get(_BASE, response_model=NotificationSettings, dependencies=_MAY)
def show(service: Service, who: Caller) -> Response:
    return document(notifications.settings_of(service.database, who, service.messaging))


@router.patch(_BASE, response_model=NotificationSettings, dependencies=_MAY)
def choose(service: Service, who: Caller, choice: NotificationChoice) -> Response:
    """What is told, by which channel."""
    return document(notifications.choose(service.database, who, choice, service.messaging))


@router.put(_BASE + "/email", status_code=202, response_model=NotificationSettings, dependencies=_MAY)
def set_email(service: Service, who: Caller, new: NewEmail) -> Response:
    """A link is sent to the address, and nothing else before it was opened; the same address again sends another link."""
    return document(notifications.set_email(service.database, who, new, service.messaging), 202)


@router.delete(_BASE + "/email", status_code=204, dependencies=_MAY)
def remove_email(service: Service, who: Caller) -> Response:
    notifications.remove_email(service.database, who)
    return Response(status_code=204)


@router.post(_BASE + "/push/subscriptions", status_code=201, response_model=PushSubscriptionDocument, dependencies=_MAY)
def subscribe(service: Service, who: Caller, new: NewPushSubscription) -> Response:
    """The same browser again is the same subscription."""
    return document(notifications.subscribe(service.database, who, new, service.messaging), 201)


@router.delete(_BASE + "/push/subscriptions/{subscription}", status_code=204, dependencies=_MAY)
def unsubscribe(service: Service, who: Caller, key: SubscriptionId) -> Response:
    notifications.unsubscribe(service.database, who, key)
    return Response(status_code=204)


@router.post(_BASE + "/push/subscriptions/{subscription}/test", status_code=202, dependencies=_MAY)
def send_test(service: Service, who: Caller, key: SubscriptionId) -> Response:
    """Queues a message to this browser."""
    notifications.send_test(service.database, who, key)
    return Response(status_code=202)


# -- where links in e-mail lead: whoever opens them need not be signed in, nor have a script run ------------------------


@router.get("/email/confirm", include_in_schema=False)
def ask_to_confirm(token: Token, languages: Languages = "") -> HTMLResponse:
    """Programs that look at every link in an e-mail must not confirm by that: a person presses a button."""
    words = preferred(languages)
    return plain_page(words, words.ask_to_confirm, token=token)


@router.post("/email/confirm", include_in_schema=False)
def confirm(service: Service, token: Token, languages: Languages = "") -> HTMLResponse:
    words = preferred(languages)
    try:
        address = notifications.confirm_email(service.database, token)
    except InvalidInput as error:
        return plain_page(words, Page(words.failed, error.detail), status=422)
    return plain_page(words, words.confirmed, address=address)


@router.get("/email/stop", include_in_schema=False)
def ask_to_stop(token: Token, languages: Languages = "") -> HTMLResponse:
    words = preferred(languages)
    return plain_page(words, words.ask_to_stop, token=token)


@router.post("/email/stop", include_in_schema=False)
def stop(service: Service, token: Token, languages: Languages = "") -> HTMLResponse:
    """Also what programs send for a person who presses their button (RFC 8058)."""
    words = preferred(languages)
    try:
        address = notifications.stop_email(service.database, token)
    except InvalidInput as error:
        return plain_page(words, Page(words.failed, error.detail), status=422)
    return plain_page(words, words.stopped, address=address)
