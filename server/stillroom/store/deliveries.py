"""The outbox, and messages on their way. Each is sent at least once: its receiver knows a repeat by its key.

A claimed message is simply not due until its lease ends, so that a messenger that dies needs nobody to clean up after it.
"""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import groupby
from typing import Any

import sqlalchemy as sa

from stillroom.store import clock
from stillroom.store.database import Transaction, tell
from stillroom.store.hints import Hint
from stillroom.store.rows import DeliveryRow, Json, ReceiverRow, UntoldRow, as_row, as_row_or_none, columns
from stillroom.store.tables import delivery, event, map_, outbox, receiver, robot

LEASE = timedelta(seconds=120)
"""Longer than any attempt may take."""
_DELIVERY = sa.select(*columns(delivery, DeliveryRow))
_waiting = delivery.c.state == "waiting"


@dataclass(frozen=True)
class NewDelivery:
    receiver_id: int
    kind: str
    content: Json
    due_at: datetime
    key: str | None = None
    """Of the message that it repeats."""


@dataclass(frozen=True)
class Parcel:
    """What goes to one receiver in one message."""

    receiver: ReceiverRow
    deliveries: Sequence[DeliveryRow]
    claim: str


@dataclass(frozen=True)
class Change:
    """What an attempt meant for one of those that were in it."""

    state: str
    due_at: datetime
    status_code: int | None
    reason: str | None


def posting(event_ids: sa.Select[Any]) -> sa.Insert:
    """Puts events into the outbox."""
    return sa.insert(outbox).from_select(["event_id"], event_ids)


def is_any_untold(tx: Transaction) -> bool:
    return tx.execute(sa.select(outbox.c.event_id).limit(1)).first() is not None


def untold(tx: Transaction, limit: int) -> Sequence[UntoldRow]:
    """Events of the outbox, the oldest first; another messenger passes them over until the transaction ends."""
    there = sa.select(outbox.c.event_id).order_by(outbox.c.event_id).limit(limit).with_for_update(skip_locked=True)
    ids = tx.execute(there).scalars().all()
    query = (
        sa.select(
            *columns(event, UntoldRow, "owner", "map_name", "map_title"),
            robot.c.owner,
            map_.c.name.label("map_name"),
            map_.c.title.label("map_title"),
        )
        .join(robot, robot.c.id == event.c.robot_id)
        .join(map_, map_.c.id == event.c.map_id)
        .where(event.c.id.in_(ids))
        .order_by(event.c.id)
    )
    return [as_row(UntoldRow, row) for row in tx.execute(query)] if ids else []


def told(tx: Transaction, event_ids: Sequence[int]) -> None:
    """Takes events out of the outbox."""
    tx.execute(sa.delete(outbox).where(outbox.c.event_id.in_(event_ids)))


def add(tx: Transaction, new: Sequence[NewDelivery], now: datetime) -> Sequence[int]:
    """Their numbers."""
    if not new:
        return []
    rows = [
        vars(one)
        | {"key": one.key or f"msg_{secrets.token_urlsafe(18)}", "state": "waiting", "attempts": 0, "created_at": now}
        for one in new
    ]
    tell(tx, Hint("message", 0))
    made = sa.insert(delivery).returning(delivery.c.id, sort_by_parameter_order=True)
    return tx.execute(made, rows).scalars().all()


def claim(tx: Transaction, now: datetime, room: Mapping[str, int], per_receiver: int) -> Sequence[Parcel]:
    """What is to be sent now: to a program each message by itself, to a person all that waits in one.

    `room`: most parcels, by channel; `per_receiver`: most that are under way to one program.
    """
    token = secrets.token_hex(16)
    singly: list[int] = []
    whole: list[int] = []
    for channel, most in room.items():
        found = tx.execute(_candidates(now, channel, per_receiver if channel == "webhook" else 1).limit(most)).all()
        if channel == "webhook":
            singly += (row.id for row in found)
        else:
            whole += (row.receiver_id for row in found)
    free = sa.or_(delivery.c.due_at <= now, delivery.c.claim.is_(None))
    take = (
        sa.update(delivery)
        .where(_waiting, sa.or_(delivery.c.id.in_(singly) & (delivery.c.due_at <= now), _all_of(whole) & free))
        .values(claim=token, due_at=now + LEASE, attempts=delivery.c.attempts + 1, tried_at=now)
        .returning(*columns(delivery, DeliveryRow))
    )
    taken = sorted((as_row(DeliveryRow, row) for row in tx.execute(take)), key=lambda row: (row.receiver_id, row.id))
    query = sa.select(*columns(receiver, ReceiverRow)).where(receiver.c.id.in_({row.receiver_id for row in taken}))
    receivers = {row.id: as_row(ReceiverRow, row) for row in tx.execute(query)} if taken else {}
    parcels: list[Parcel] = []
    for receiver_id, rows in groupby(taken, lambda row: row.receiver_id):
        to, together = receivers[receiver_id], list(rows)
        groups = [[row] for row in together] if to.channel == "webhook" else [together]
        parcels += [Parcel(to, group, token) for group in groups]
    return parcels


def _all_of(receiver_ids: Sequence[int]) -> sa.ColumnElement[bool]:
    return delivery.c.receiver_id.in_(receiver_ids)


def _candidates(now: datetime, channel: str, per_receiver: int) -> sa.Select[Any]:
    """What is due by a channel, of each receiver as much as it may be sent at once; the longest due first."""
    under_way = (
        sa.select(delivery.c.receiver_id, sa.func.count().label("count"))
        .where(_waiting, delivery.c.claim.is_not(None), delivery.c.due_at > now)
        .group_by(delivery.c.receiver_id)
        .subquery()
    )
    open_ = receiver.c.ended_at.is_(None), sa.or_(receiver.c.resume_at.is_(None), receiver.c.resume_at <= now)
    place = sa.func.row_number().over(partition_by=delivery.c.receiver_id, order_by=(delivery.c.due_at, delivery.c.id))
    due = (
        sa.select(delivery.c.id, delivery.c.receiver_id, delivery.c.due_at, place.label("place"))
        .join(receiver, receiver.c.id == delivery.c.receiver_id)
        .where(_waiting, delivery.c.due_at <= now, receiver.c.channel == channel, *open_)
        .subquery()
    )
    return (
        sa.select(due.c.id, due.c.receiver_id)
        .outerjoin(under_way, under_way.c.receiver_id == due.c.receiver_id)
        .where(due.c.place + sa.func.coalesce(under_way.c.count, 0) <= per_receiver)
        .order_by(due.c.due_at, due.c.id)
    )


def finish(tx: Transaction, parcel: Parcel, changes: Mapping[int, Change], now: datetime) -> bool:
    """Records an attempt. False where the lease ran out and another messenger has it: what we did does not count."""
    counted = False
    for row in parcel.deliveries:
        change = changes[row.id]
        finished = None if change.state == "waiting" else now
        done = tx.execute(
            sa.update(delivery)
            .where(delivery.c.id == row.id, delivery.c.claim == parcel.claim, _waiting)
            .values(**vars(change), claim=None, finished_at=finished)
        )
        counted |= done.rowcount > 0
    return counted


def give_up(tx: Transaction, receiver_id: int, reason: str, now: datetime) -> None:
    """Nothing that still waits for a receiver is sent any more."""
    waits = delivery.c.receiver_id == receiver_id, _waiting
    tx.execute(sa.update(delivery).where(*waits).values(state="dead", reason=reason, finished_at=now, claim=None))


def next_due(tx: Transaction) -> tuple[datetime | None, datetime]:
    """When something becomes due, None where nothing waits; and the time."""
    at = sa.case((receiver.c.resume_at > delivery.c.due_at, receiver.c.resume_at), else_=delivery.c.due_at)
    query = (
        sa.select(sa.type_coerce(sa.func.min(at), delivery.c.due_at.type), clock.MOMENT)
        .join(receiver, receiver.c.id == delivery.c.receiver_id)
        .where(_waiting, receiver.c.ended_at.is_(None))
    )
    due, now = tx.execute(query).one()
    return due, now


def page(tx: Transaction, receiver_id: int, before: int | None, limit: int) -> Sequence[DeliveryRow]:
    """The newest first."""
    query = _DELIVERY.where(delivery.c.receiver_id == receiver_id)
    if before is not None:
        query = query.where(delivery.c.id < before)
    return [as_row(DeliveryRow, row) for row in tx.execute(query.order_by(delivery.c.id.desc()).limit(limit))]


def of_receiver(tx: Transaction, receiver_id: int, delivery_id: int) -> DeliveryRow | None:
    query = _DELIVERY.where(delivery.c.receiver_id == receiver_id, delivery.c.id == delivery_id)
    return as_row_or_none(DeliveryRow, tx.execute(query).first())


def count_since(tx: Transaction, person: str, kind: str, since: datetime) -> int:
    """How many messages of a kind were meant for a person's receivers since then."""
    query = (
        sa.select(sa.func.count())
        .select_from(delivery)
        .join(receiver, receiver.c.id == delivery.c.receiver_id)
        .where(receiver.c.person == person, delivery.c.kind == kind, delivery.c.created_at > since)
    )
    number: int = tx.execute(query).scalar_one()
    return number


def trouble(tx: Transaction, receiver_id: int) -> str | None:
    """Why the last message could not be delivered; None where it was, or nothing was tried yet."""
    tried = delivery.c.receiver_id == receiver_id, delivery.c.tried_at.is_not(None)
    query = sa.select(delivery.c.state, delivery.c.reason).where(*tried).order_by(delivery.c.tried_at.desc()).limit(1)
    last = tx.execute(query).first()
    return None if last is None or last.state in ("delivered", "dropped") else last.reason


def tally(tx: Transaction) -> Sequence[tuple[str, str, int]]:
    """Channel, state and number of the messages of the last 30 days."""
    query = (
        sa.select(receiver.c.channel, delivery.c.state, sa.func.count())
        .join(receiver, receiver.c.id == delivery.c.receiver_id)
        .group_by(receiver.c.channel, delivery.c.state)
        .order_by(receiver.c.channel, delivery.c.state)
    )
    return [(row[0], row[1], row[2]) for row in tx.execute(query)]


def prune(tx: Transaction, before: datetime, limit: int) -> int:
    """Forgets messages that were finished before then; how many."""
    old = sa.select(delivery.c.id).where(delivery.c.finished_at < before).limit(limit)
    gone: int = tx.execute(sa.delete(delivery).where(delivery.c.id.in_(old))).rowcount
    return gone
