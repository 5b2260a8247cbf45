"""Webhooks: programs that are told what happens, by the Standard Webhooks specification (standardwebhooks.com)."""

import base64
import secrets
from datetime import datetime, timedelta
from typing import get_args

from stillroom.documents.api import Page
from stillroom.documents.notifications import (
    DeliveryDocument,
    NewWebhook,
    WebhookChange,
    WebhookDocument,
    WebhookType,
    WebhookWithSecret,
)
from stillroom.errors import Fault, InvalidInput, NotFound
from stillroom.service.access import Principal, authorise_service, signature
from stillroom.service.messages.announcing import webhook_body
from stillroom.service.messages.outbound import check_url
from stillroom.service.paging import page_of
from stillroom.settings import Outbound
from stillroom.store import clock, deliveries, receivers
from stillroom.store.database import Database, Transaction
from stillroom.store.deliveries import NewDelivery
from stillroom.store.receivers import FRESH, NewReceiver
from stillroom.store.rows import DeliveryRow, ReceiverRow

MOST = 20
"""Webhooks of one person."""
OVERLAP = timedelta(hours=24)
"""So long both secrets sign, after a new one was made."""
TYPES: tuple[WebhookType, ...] = get_args(WebhookType)


def add_webhook(database: Database, caller: Principal, new: NewWebhook, outbound: Outbound) -> WebhookWithSecret:
    """Raises InvalidInput, and Forbidden for who may not."""
    person = owner_of(caller)
    fleet = new.scope == "fleet"
    if fleet:
        authorise_service(caller, "fleet messages")
    check_url(new.url, outbound, "/url")
    secret = new_secret()
    with database.write() as tx:
        if len(receivers.of_person(tx, person, "webhook", limit=MOST)) >= MOST:
            raise InvalidInput(f"There are {MOST} webhooks already; remove one first.")
        now = clock.now(tx)
        made = receivers.add(
            tx,
            NewReceiver(
                channel="webhook",
                person=person,
                address=new.url,
                confirmed_at=now,
                fleet=fleet,
                label=new.label.strip(),
                kinds=new.types and sorted(set(new.types), key=TYPES.index),
                keys={"secrets": [{"secret": secret, "until": None}]},
            ),
            now,
        )
    assert made is not None
    return WebhookWithSecret(**_document(made).model_dump(), secret=secret)


def list_webhooks(database: Database, caller: Principal, cursor: int | None, limit: int) -> Page[WebhookDocument]:
    """One's own, the oldest first."""
    with database.read() as tx:
        rows = receivers.of_person(tx, owner_of(caller), "webhook", cursor or 0, limit + 1)
    items, following = page_of(rows, limit, lambda row: str(row.id))
    return Page(items=[_document(row) for row in items], next=following)


def webhook(database: Database, caller: Principal, key: str) -> WebhookDocument:
    """Raises NotFound."""
    with database.read() as tx:
        return _document(_find(tx, caller, key))


def change_webhook(
    database: Database, caller: Principal, key: str, change: WebhookChange, outbound: Outbound
) -> WebhookDocument:
    """Raises NotFound, InvalidInput."""
    values: dict[str, object] = {}
    if change.url is not None:
        check_url(change.url, outbound, "/url")
        values["address"] = change.url
    if change.types is not None:
        values["kinds"] = sorted(set(change.types), key=TYPES.index)
    if change.label is not None:
        values["label"] = change.label.strip()
    with database.write() as tx:
        row, now = _find(tx, caller, key), clock.now(tx)
        if change.enabled or (change.url is not None and row.ended_at is None):
            values |= FRESH
        if change.enabled is False and row.ended_at is None:
            values |= {"ended_at": now, "ended_reason": "It was switched off."}
            deliveries.give_up(tx, row.id, "The webhook was switched off.", now)
        if values:
            receivers.change(tx, row.id, values)
        return _document(_find(tx, caller, key))


def remove_webhook(database: Database, caller: Principal, key: str) -> None:
    """With the list of what it was sent. Raises NotFound."""
    with database.write() as tx:
        receivers.remove(tx, _find(tx, caller, key).id)


def rotate_secret(database: Database, caller: Principal, key: str) -> WebhookWithSecret:
    """A new secret; for a day messages are signed with both. Raises NotFound."""
    secret = new_secret()
    with database.write() as tx:
        row, now = _find(tx, caller, key), clock.now(tx)
        kept = [{"secret": old, "until": (now + OVERLAP).isoformat()} for old in valid_secrets(row, now)[:1]]
        receivers.change(tx, row.id, {"keys": {"secrets": [{"secret": secret, "until": None}, *kept]}})
        return WebhookWithSecret(**_document(row).model_dump(), secret=secret)


def send_test(database: Database, caller: Principal, key: str) -> DeliveryDocument:
    """Queues an event of the type `test`. Raises NotFound, and InvalidInput where the webhook is switched off."""
    with database.write() as tx:
        row, now = _find_on(tx, caller, key), clock.now(tx)
        body = webhook_body("test", now, {"webhook": row.key})
        return _queue(tx, row, NewDelivery(row.id, "test", body, now), now)


def list_deliveries(
    database: Database, caller: Principal, key: str, cursor: int | None, limit: int
) -> Page[DeliveryDocument]:
    """What it was sent in the last 30 days, the newest first. Raises NotFound."""
    with database.read() as tx:
        row = _find(tx, caller, key)
        rows, following = page_of(
            deliveries.page(tx, row.id, cursor, limit + 1), limit, lambda delivery: str(delivery.id)
        )
    return Page(items=[_delivery(delivery) for delivery in rows], next=following)


def replay(database: Database, caller: Principal, key: str, delivery_id: int) -> DeliveryDocument:
    """Sends the same message once more. Raises NotFound, and InvalidInput where the webhook is switched off."""
    with database.write() as tx:
        row, now = _find_on(tx, caller, key), clock.now(tx)
        old = deliveries.of_receiver(tx, row.id, delivery_id)
        if old is None:
            raise NotFound(f"The webhook {key} has no delivery {delivery_id}.")
        return _queue(tx, row, NewDelivery(row.id, old.kind, old.content, now, old.key), now)


def owner_of(caller: Principal) -> str:
    """Whose messages the caller decides about. Raises Forbidden: robots get none."""
    authorise_service(caller, "messages")
    return signature(caller)


def new_secret() -> str:
    return f"whsec_{base64.b64encode(secrets.token_bytes(32)).decode()}"


def valid_secrets(row: ReceiverRow, now: datetime) -> list[str]:
    """What messages are signed with, the newest first."""
    known: list[dict[str, str | None]] = row.keys["secrets"]
    return [
        str(one["secret"]) for one in known if one["until"] is None or datetime.fromisoformat(str(one["until"])) > now
    ]


def _find(tx: Transaction, caller: Principal, key: str) -> ReceiverRow:
    row = receivers.by_key(tx, owner_of(caller), key)
    if row is None or row.channel != "webhook":
        raise NotFound(f"There is no webhook {key}.")
    return row


def _find_on(tx: Transaction, caller: Principal, key: str) -> ReceiverRow:
    row = _find(tx, caller, key)
    if row.ended_at is not None:
        fault = Fault("", f"It is switched off: {row.ended_reason} Switch it on first.")
        raise InvalidInput("Nothing is sent to this webhook.", (fault,))
    return row


def _queue(tx: Transaction, row: ReceiverRow, new: NewDelivery, now: datetime) -> DeliveryDocument:
    (number,) = deliveries.add(tx, [new], now)
    receivers.change(tx, row.id, {"resume_at": None})  # whoever asks for it wants to see now whether it works
    made = deliveries.of_receiver(tx, row.id, number)
    assert made is not None
    return _delivery(made)


def _document(row: ReceiverRow) -> WebhookDocument:
    return WebhookDocument.model_validate(
        {
            "id": row.key,
            "url": row.address,
            "types": row.kinds or TYPES,
            "scope": "fleet" if row.fleet else "own",
            "enabled": row.ended_at is None,
            "disabled_reason": row.ended_reason,
            **{
                name: getattr(row, name)
                for name in ("label", "created_at", "delivered_at", "failing_since", "failures")
            },
        }
    )


def _delivery(row: DeliveryRow) -> DeliveryDocument:
    same = ("id", "state", "attempts", "created_at", "tried_at", "status_code", "reason")
    return DeliveryDocument.model_validate(
        {name: getattr(row, name) for name in same}
        | {
            "message": row.key,
            "type": row.kind,
            "next_at": row.due_at if row.state == "waiting" else None,
            "body": row.content,
        }
    )
