"""What a message to a person is about, as it is when the message is sent: what was answered meanwhile is left out."""

from collections.abc import Sequence
from dataclasses import dataclass

from stillroom.service.messages.links import page_url
from stillroom.store import conflicts
from stillroom.store.database import Database
from stillroom.store.rows import ConflictRow, DeliveryRow


@dataclass(frozen=True)
class Topic:
    """One thing that a person is told."""

    delivery: DeliveryRow
    title: str
    text: str
    url: str
    conflict: ConflictRow | None
    """None: a test."""


def topics(database: Database, deliveries: Sequence[DeliveryRow], public_url: str) -> list[Topic]:
    """What there still is to tell, in order; each once."""
    found: dict[object, Topic] = {}
    for delivery in deliveries:
        topic = _test(delivery, public_url) if delivery.kind == "test" else _topic(database, delivery, public_url)
        if topic is not None:
            found.setdefault(topic.url, topic)
    return list(found.values())


def _test(delivery: DeliveryRow, public_url: str) -> Topic:
    return Topic(delivery, "This is a test", "Messages about your maps reach you here.", public_url, None)


def _topic(database: Database, delivery: DeliveryRow, public_url: str) -> Topic | None:
    content = delivery.content
    with database.read() as tx:
        row = conflicts.by_key(tx, content["map_id"], content["conflict"])
    if row is None or row.decided_by is not None:
        return None
    title = f"{content['title']}: {_about(delivery.kind, row)}"
    text = row.summary
    if row.due_at is not None:
        text += f" If nobody answers by {row.due_at:%d %B %Y, %H:%M} UTC, the map stays as it was."
    return Topic(delivery, title, text, page_url(public_url, content), row)


def _about(kind: str, row: ConflictRow) -> str:
    if kind == "parked":
        return "which floor is this?"
    names = ", ".join(room["name"] for room in row.rooms)
    if kind == "room":
        return f"a new room, {names}" if names else "a new room"
    return f"a question about {names}" if names else "a question about your map"
