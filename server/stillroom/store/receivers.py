"""Where messages go, what people want to be told, and the secrets that messages and links are signed with."""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from hashlib import sha256
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there, upsert
from stillroom.store.rows import Json, ReceiverRow, as_row, as_row_or_none, columns
from stillroom.store.tables import delivery, preference, receiver, service_key
from stillroom.store.tables import language as spoken

FRESH: Mapping[str, Any] = {
    "failures": 0, "failing_since": None, "resume_at": None, "ended_at": None, "ended_reason": None,
}  # fmt: skip
"""What is changed where nothing that went wrong before says anything any more."""
_RECEIVER = sa.select(*columns(receiver, ReceiverRow))


@dataclass(frozen=True)
class NewReceiver:
    channel: str
    person: str
    address: str
    confirmed_at: datetime | None
    """None: nothing but the question whether it is right goes there."""
    fleet: bool = False
    label: str = ""
    kinds: Sequence[str] | None = None
    keys: Json = field(default_factory=dict)


def add(tx: Transaction, new: NewReceiver, now: datetime) -> ReceiverRow | None:
    """None where somebody else was faster to add the same."""
    key = f"{new.channel}_{secrets.token_urlsafe(16)}"
    values = vars(new) | {"key": key, "digest": _digest(new.address), "created_at": now, "failures": 0}
    if not insert_unless_there(tx, receiver, values):
        return None
    return as_row(ReceiverRow, tx.execute(_RECEIVER.where(receiver.c.key == key)).one())


def get(tx: Transaction, receiver_id: int) -> ReceiverRow | None:
    return as_row_or_none(ReceiverRow, tx.execute(_RECEIVER.where(receiver.c.id == receiver_id)).first())


def by_key(tx: Transaction, person: str, key: str) -> ReceiverRow | None:
    """One of a person's own."""
    query = _RECEIVER.where(receiver.c.person == person, receiver.c.key == key)
    return as_row_or_none(ReceiverRow, tx.execute(query).first())


def of_person(tx: Transaction, person: str, channel: str, after: int = 0, limit: int = 1000) -> Sequence[ReceiverRow]:
    """The oldest first."""
    mine = receiver.c.person == person, receiver.c.channel == channel, receiver.c.id > after
    return _rows(tx, _RECEIVER.where(*mine).order_by(receiver.c.id).limit(limit))


def by_address(tx: Transaction, channel: str, address: str) -> Sequence[ReceiverRow]:
    return _rows(tx, _RECEIVER.where(receiver.c.channel == channel, receiver.c.digest == _digest(address)))


def listening(tx: Transaction, *persons: str) -> Sequence[ReceiverRow]:
    """All that are told what happens to robots that these people are told about: their own, and those of the whole fleet."""
    ready = receiver.c.confirmed_at.is_not(None), receiver.c.ended_at.is_(None)
    whose = sa.or_(receiver.c.fleet, receiver.c.person.in_(persons))
    return _rows(tx, _RECEIVER.where(whose, *ready).order_by(receiver.c.id))


def change(tx: Transaction, receiver_id: int, values: Mapping[str, Any]) -> None:
    if "address" in values:
        values = dict(values) | {"digest": _digest(values["address"])}
    tx.execute(sa.update(receiver).where(receiver.c.id == receiver_id).values(dict(values)))


def remove(tx: Transaction, receiver_id: int) -> None:
    """With all that was sent, or would have been."""
    tx.execute(sa.delete(delivery).where(delivery.c.receiver_id == receiver_id))
    tx.execute(sa.delete(receiver).where(receiver.c.id == receiver_id))


def preferences(tx: Transaction, person: str) -> Mapping[str, Sequence[str]]:
    """By channel, what a person wants to be told; a channel that is missing tells everything."""
    query = sa.select(preference.c.channel, preference.c.kinds).where(preference.c.person == person)
    return {row.channel: row.kinds for row in tx.execute(query)}


def prefer(tx: Transaction, person: str, kinds: Mapping[str, Sequence[str]]) -> None:
    rows = [{"person": person, "channel": channel, "kinds": list(wanted)} for channel, wanted in kinds.items()]
    upsert(tx, preference, rows)


def language(tx: Transaction, person: str) -> str | None:
    """None: nobody has said."""
    chosen: str | None = tx.execute(sa.select(spoken.c.language).where(spoken.c.person == person)).scalar()
    return chosen


def speak(tx: Transaction, person: str, wanted: str, again: bool = True) -> None:
    """`again`: also where another one was chosen before."""
    row = {"person": person, "language": wanted}
    if again:
        upsert(tx, spoken, [row])
    else:
        insert_unless_there(tx, spoken, row)


def service_secret(tx: Transaction, name: str, make: str) -> str:
    """A secret that all machines of the service share: `make` where there is none yet."""
    insert_unless_there(tx, service_key, {"name": name, "value": make})
    value: str = tx.execute(sa.select(service_key.c.value).where(service_key.c.name == name)).scalar_one()
    return value


def known_secret(tx: Transaction, name: str) -> str | None:
    value: str | None = tx.execute(sa.select(service_key.c.value).where(service_key.c.name == name)).scalar()
    return value


def _digest(address: str) -> str:
    return sha256(address.encode()).hexdigest()


def _rows(tx: Transaction, query: sa.Select[Any]) -> Sequence[ReceiverRow]:
    return [as_row(ReceiverRow, row) for row in tx.execute(query)]
