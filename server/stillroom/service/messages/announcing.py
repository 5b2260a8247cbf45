"""What happened becomes messages: each event of the outbox is told to all who want to hear of it, in one transaction.

Programs are told of every event. People are sent a message where there is something for them to do.
"""

from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta
from functools import cache

import structlog

from stillroom.documents.notifications import WebhookType
from stillroom.service.access import told_about
from stillroom.service.messages.news import News, news_of
from stillroom.store import clock, deliveries, receivers
from stillroom.store.database import Database, Transaction
from stillroom.store.deliveries import NewDelivery
from stillroom.store.rows import Json, ReceiverRow, UntoldRow

BATCH = 100
GATHER = {"email": timedelta(seconds=60), "push": timedelta(seconds=10)}
"""So long a message to a person waits for others that then go in the same."""

log = structlog.get_logger()


def announce(database: Database, public_url: str) -> int:
    """Tells of up to 100 events, the oldest first; how many there were."""
    with database.look() as tx:
        if not deliveries.is_any_untold(tx):
            return 0
    with database.write(durable=False) as tx:
        events = deliveries.untold(tx, BATCH)
        if not events:
            return 0
        now = clock.now(tx)
        listening = cache(lambda owner: receivers.listening(tx, *told_about(tx, owner)))
        chosen = cache(lambda person: receivers.preferences(tx, person))
        new: list[NewDelivery] = []
        for event in events:
            listeners = listening(event.owner)
            news = _news(tx, event, public_url) if listeners else None
            if news is not None:
                new += (
                    delivery
                    for receiver in listeners
                    for delivery in _told(receiver, news, event, chosen(receiver.person).get(receiver.channel), now)
                )
        deliveries.add(tx, new, now)
        deliveries.told(tx, [event.id for event in events])
    return len(events)


def _news(tx: Transaction, event: UntoldRow, public_url: str) -> News | None:
    """One event that can't be told must not keep all others from being told."""
    try:
        return news_of(tx, event, public_url)
    except (LookupError, TypeError, ValueError):
        log.exception("an event could not be told", event=event.id)
        return None


def webhook_body(type_: WebhookType | str, at: datetime, data: Json) -> Json:
    """By the Standard Webhooks specification."""
    return {"type": type_, "timestamp": at.isoformat().replace("+00:00", "Z"), "data": data}


def _told(
    receiver: ReceiverRow, news: News, event: UntoldRow, chosen: Sequence[str] | None, now: datetime
) -> Iterator[NewDelivery]:
    """`chosen`: kinds of messages that the person wants by this channel; None: all."""
    if receiver.channel == "webhook":
        if receiver.kinds is None or news.type in receiver.kinds:
            data = news.anonymous if receiver.fleet else news.data
            yield NewDelivery(receiver.id, news.type, webhook_body(news.type, event.created_at, data), now)
    elif news.kind is not None and (chosen is None or news.kind in chosen):
        names = ("robot", "map", "conflict")
        content = {name: news.data[name] for name in names} | {"map_id": event.map_id, "title": event.map_title}
        yield NewDelivery(receiver.id, news.kind, content, now + GATHER[receiver.channel])
