"""What a message to a person is about, as it is when the message is sent: what was answered meanwhile is left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import urlencode

from stillroom.service.access import told_about
from stillroom.service.messages.answers import answers
from stillroom.service.messages.links import page_url
from stillroom.service.messages.words import Words, concerned
from stillroom.store import clock, conflicts, grants, missions, receivers, robots
from stillroom.store.database import Database
from stillroom.store.rows import ConflictRow, DeliveryRow

OF_THE_SERVICE = (
    "rollout.advanced",
    "rollout.halted",
    "rollout.successful",
    "rollout.ended",
    "alert.raised",
    "alert.ended",
)


@dataclass(frozen=True)
class Topic:
    """One thing that a person is told."""

    delivery: DeliveryRow
    title: str
    text: str
    url: str
    conflict: ConflictRow | None
    """None: a test."""
    answers: tuple[tuple[str, str], ...] = ()
    """What can be answered, and the page that asks whether it is meant; the recommended one first."""


def topics(database: Database, deliveries: Sequence[DeliveryRow], public_url: str, words: Words) -> list[Topic]:
    """What there still is to tell, in order; each once."""
    found: dict[object, Topic] = {}
    for delivery in deliveries:
        match delivery.kind:
            case "test":
                topic: Topic | None = _test(delivery, public_url, words)
            case "grant":
                topic = _grant(database, delivery, public_url, words)
            case kind if kind in OF_THE_SERVICE:
                topic = _service(delivery, public_url, words)
            case _:
                topic = _topic(database, delivery, public_url, words)
        if topic is not None:
            found.setdefault(topic.url, topic)
    return list(found.values())


def _test(delivery: DeliveryRow, public_url: str, words: Words) -> Topic:
    return Topic(delivery, *words.test, public_url, None)


def _grant(database: Database, delivery: DeliveryRow, public_url: str, words: Words) -> Topic | None:
    """Somebody asks to look at floor plans; None where that was answered meanwhile."""
    with database.read() as tx:
        row = grants.by_key(tx, delivery.content["grant"])
        if row is None or not row.is_open(clock.now(tx)):
            return None
    title, text = words.grant
    said = text.format(robot=row.robot_id, hours=row.hours, reason=row.reason, when=words.day(row.expires_at))
    return Topic(delivery, title, said, f"{public_url}/access/{row.key}", None)


def _service(delivery: DeliveryRow, public_url: str, words: Words) -> Topic:
    """A rollout or a rate, to those who run the service."""
    title, text = words.service[delivery.kind]
    about = {name: words.figure(value) for name, value in delivery.content.items()}
    return Topic(delivery, title.format(**about), text.format(**about), f"{public_url}{delivery.content['page']}", None)


def _topic(database: Database, delivery: DeliveryRow, public_url: str, words: Words) -> Topic | None:
    content = delivery.content
    with database.read() as tx:
        robot, to = robots.of_map(tx, content["map_id"]), receivers.get(tx, delivery.receiver_id)
        if robot is None or to is None or to.person not in told_about(tx, robot.owner):
            return None  # who left the home since hears no more of it
        row = conflicts.by_key(tx, content["map_id"], content["conflict"])
        if row is None or row.decided_by is not None:
            return None
        mission = missions.get(tx, row.mission_id)
        proposals = conflicts.proposals(tx, [row.sighting_id])[row.sighting_id]
    title = f"{content['title']}: {_about(delivery.kind, row, words)}"
    text = words.summary(row, proposals)
    if row.due_at is not None:
        text += " " + words.deadline.format(when=words.day(row.due_at))
    url = page_url(public_url, content | {"robot": robot.id})
    names = [room["name"] for room in concerned(row)]
    was_taken = row.resolved or mission.version != row.base_version
    offered = (
        (words.answer(one.saying, names), f"{url}?{urlencode({'answer': one.key}, safe=':')}")
        for one in answers(row, was_taken, proposals)
    )
    return Topic(delivery, title, text, url, row, tuple(offered))


def _about(kind: str, row: ConflictRow, words: Words) -> str:
    if kind == "parked":
        return words.which_floor
    nameless, named = words.new_room if kind == "room" else words.question
    names = ", ".join(room["name"] for room in row.rooms)
    return named.format(rooms=names) if names else nameless
