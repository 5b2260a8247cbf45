"""Maps, their versions and their rooms' ids. Versions are only ever added."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store import clock
from stillroom.store.changes import Change, apply, given, named
from stillroom.store.database import Transaction, insert_unless_there, upsert
from stillroom.store.fleet_tables import unjudged
from stillroom.store.rows import (
    Json,
    MapRow,
    RoomRow,
    ShownVersion,
    VersionHead,
    VersionRow,
    as_row,
    as_row_or_none,
    columns,
)
from stillroom.store.tables import lane, map_, robot, room, version

BY_PEOPLE = ("edit", "restore", "decision")
"""Causes of versions that may correct what a mission did."""

_MAP = sa.select(*columns(map_, MapRow))
_HEAD = sa.select(*columns(version, VersionHead))
VERSION = sa.select(*columns(version, VersionHead), version.c.packed, version.c.document)
"""For `version_row`."""


def version_row(values: Sequence[Any]) -> VersionRow:
    *row, packed, document = values
    row.append(document if packed is None else packed)
    return VersionRow(*row)


# Statements of every mission are made once: making one takes as long as running it.
_named = map_.c.robot_id == sa.bindparam("robot_id"), map_.c.name == sa.bindparam("name")
_BY_ID = _MAP.where(map_.c.id == sa.bindparam("map_id"))
_BY_NAME = _MAP.where(*_named)
_IN_FORCE = (
    _MAP.add_columns(*VERSION.selected_columns)
    .outerjoin(version, sa.and_(version.c.map_id == map_.c.id, version.c.number == map_.c.head))
    .where(*_named)
)
_SHOWN = (
    sa.select(map_.c.head, *columns(version, ShownVersion, "document"), version.c.packed, version.c.document)
    .outerjoin_from(
        map_,
        version,
        sa.and_(
            version.c.map_id == map_.c.id,
            version.c.number == sa.func.coalesce(sa.bindparam("number", type_=version.c.number.type), map_.c.head),
        ),
    )
    .where(*_named)
)
# Both rows are locked: after waiting for the one, the other would be as it was before. Missions that arrive refer to the map
# meanwhile (FOR NO KEY UPDATE).
_LOCK = (
    _BY_ID.add_columns(lane.c.claim, clock.MOMENT)
    .join(lane, lane.c.map_id == map_.c.id)
    .with_for_update(key_share=True, of=[lane, map_])
)
_NEW = ("parent", "cause", "mission", "made_by", "algorithm", "grid", "frame_from", "motion")
_ADD = sa.insert(version).values(given(version, "new", "map_id", "number", *_NEW, "created_at", "rooms", "packed"))
_PUT_IN_FORCE = (
    sa.update(map_)
    .where(map_.c.id == sa.bindparam("of"))
    .values(given(map_, "now", "head", "used_ids", "epoch", "sequence"))
)
_NOTE = sa.update(map_).where(map_.c.id == sa.bindparam("of")).values(given(map_, "now", "epoch", "sequence"))
_TO_JUDGE = sa.insert(unjudged).values(given(unjudged, "judged", "map_id", "number"))
_NUMBERED = VERSION.where(version.c.map_id == sa.bindparam("map_id"), version.c.number == sa.bindparam("number"))


def get(tx: Transaction, map_id: int) -> MapRow:
    return as_row(MapRow, tx.execute(_BY_ID, {"map_id": map_id}).one())


def by_name(tx: Transaction, robot_id: str, name: str) -> MapRow | None:
    return as_row_or_none(MapRow, tx.execute(_BY_NAME, {"robot_id": robot_id, "name": name}).first())


def of_robots(tx: Transaction, robot_ids: Sequence[str]) -> Sequence[MapRow]:
    query = _MAP.where(map_.c.robot_id.in_(robot_ids)).order_by(map_.c.robot_id, map_.c.ordinal)
    return [as_row(MapRow, row) for row in tx.execute(query)]


def in_force(tx: Transaction, robot_id: str, name: str) -> tuple[MapRow, VersionRow | None] | None:
    """The map of that name, with its version in force, where it has one."""
    found = tx.execute(_IN_FORCE, {"robot_id": robot_id, "name": name}).first()
    if found is None:
        return None
    middle = len(fields(MapRow))
    row = version_row(found[middle:])
    return MapRow(*found[:middle]), None if row.number is None else row  # of an outer join


def shown(
    tx: Transaction, robot_id: str, name: str, number: int | None
) -> tuple[int | None, ShownVersion | None] | None:
    """Which version of the map of that name is in force, and what is shown of one: of that one, where `number` is None. None where
    there is no such map."""
    found = tx.execute(_SHOWN, {"robot_id": robot_id, "name": name, "number": number}).first()
    if found is None:
        return None
    head, *row, packed, document = found
    row.append(document if packed is None else packed)
    return head, None if row[0] is None else ShownVersion(*row)


def lock(tx: Transaction, map_id: int) -> tuple[MapRow, str | None, datetime]:
    """Holds the map's lane until the end of the transaction; the map, the token that claims the lane, and the time."""
    *values, token, now = tx.execute(_LOCK, {"map_id": map_id}).one()
    return MapRow(*values), token, now


def get_or_add(tx: Transaction, robot_id: str, name: str) -> MapRow:
    """The map of that name with its lane, made where there is none."""
    found = by_name(tx, robot_id, name)
    if found is not None:
        return found
    # One new map of a robot at a time. Rows that only refer to the robot don't wait for this (FOR NO KEY UPDATE).
    tx.execute(sa.select(robot.c.id).where(robot.c.id == robot_id).with_for_update(key_share=True))
    taken = tx.execute(sa.select(sa.func.max(map_.c.ordinal)).where(map_.c.robot_id == robot_id)).scalar()
    values = {"robot_id": robot_id, "name": name, "title": name, "ordinal": (taken or 0) + 1}
    insert_unless_there(tx, map_, values | {"review": "automatic", "used_ids": {}, "created_at": clock.now(tx)})
    made = by_name(tx, robot_id, name)
    assert made is not None
    insert_unless_there(tx, lane, {"map_id": made.id})
    return made


def change_settings(tx: Transaction, map_id: int, values: Mapping[str, str | int | None]) -> None:
    """`title`, `review` and `pinned`."""
    tx.execute(sa.update(map_).where(map_.c.id == map_id).values(**values))


def noted(of: MapRow, newest: tuple[int, int] | None) -> tuple[Change, ...]:
    """Epoch and sequence of the newest mission that was processed; `of`: as it is under the lane's lock."""
    if newest is None or not is_newer(of, *newest):
        return ()
    epoch, sequence = newest
    return (Change(_NOTE, {"of": of.id} | named("now", {"epoch": epoch, "sequence": sequence})),)


def is_newer(of: MapRow, epoch: int, sequence: int) -> bool:
    """Than all missions that were processed."""
    return of.epoch is None or of.sequence is None or (of.epoch, of.sequence) < (epoch, sequence)


@dataclass(frozen=True)
class NewVersion:
    parent: int | None
    cause: str
    mission: str | None
    made_by: str
    algorithm: str
    grid: str
    frame_from: int | None
    motion: Json | None
    document: Json
    rooms: Sequence[tuple[str, int, str]]
    """(id, segment id, name) of each."""
    retired: Mapping[str, str | None]
    """Rooms that ended -> the one that has their space, where that is known."""
    used_ids: Json


def next_number(of: MapRow) -> int:
    """Of a new version; `of`: as it is under the lane's lock. The newest is in force."""
    return (of.head or 0) + 1


def add_version(tx: Transaction, of: MapRow, new: NewVersion, now: datetime) -> int:
    """Adds a version after all others and puts it in force. Answers with its number. `of`: as it is under the lane's lock."""
    apply(tx, *added(of, new, now))
    follow_rooms(tx, of.id, new)
    return next_number(of)


def added(of: MapRow, new: NewVersion, now: datetime, newest: tuple[int, int] | None = None) -> tuple[Change, ...]:
    """What `add_version` does but for the map's rooms. `newest`: as `noted` notes it."""
    number = next_number(of)
    own = {"map_id": of.id, "number": number}
    content = {name: getattr(new, name) for name in _NEW} | {"rooms": len(new.rooms), "packed": new.document}
    epoch, sequence = newest if newest is not None and is_newer(of, *newest) else (of.epoch, of.sequence)
    used = _used_ids(of.used_ids, [new.used_ids])
    in_force = {"head": number, "used_ids": used, "epoch": epoch, "sequence": sequence}
    return (
        Change(_ADD, named("new", own | content | {"created_at": now})),
        Change(_PUT_IN_FORCE, {"of": of.id} | named("now", in_force)),
        *([Change(_TO_JUDGE, named("judged", own))] if new.cause in BY_PEOPLE else []),
    )


def follow_rooms(tx: Transaction, map_id: int, new: NewVersion) -> None:
    """The rooms that live are those of the new version."""
    query = sa.select(room.c.id, room.c.segment_id, room.c.name)
    before = {tuple(row) for row in tx.execute(query.where(room.c.map_id == map_id, room.c.retired.is_(False)))}
    living = {room_id for room_id, _, _ in new.rooms}
    of_map = room.c.map_id == map_id
    ended = {room_id for room_id, _, _ in before} - living
    if ended:
        tx.execute(sa.update(room).where(of_map, room.c.id.in_(ended)).values(retired=True, survivor=None))
    for room_id, survivor in new.retired.items():
        if room_id not in living:
            tx.execute(sa.update(room).where(of_map, room.c.id == room_id).values(survivor=survivor))
    changed = [
        {"map_id": map_id, "id": room_id, "segment_id": segment, "name": name, "retired": False, "survivor": None}
        for room_id, segment, name in new.rooms
        if (room_id, segment, name) not in before
    ]
    upsert(tx, room, changed)


def reserve_ids(tx: Transaction, map_id: int, used: Sequence[Json]) -> None:
    """None of these ids is given out again, whether or not they ever come into force; the lane must be locked."""
    if not used:
        return
    before = get(tx, map_id).used_ids
    after = _used_ids(before, used)
    if after != before:
        tx.execute(sa.update(map_).where(map_.c.id == map_id).values(used_ids=after))


def _used_ids(before: Json, used: Sequence[Json]) -> Json:
    after = dict(before)
    for counts in used:
        after |= {kind: max(count, after.get(kind, 0)) for kind, count in counts.items()}
    return after


def version_head(tx: Transaction, map_id: int, number: int) -> VersionHead | None:
    query = _HEAD.where(version.c.map_id == map_id, version.c.number == number)
    return as_row_or_none(VersionHead, tx.execute(query).first())


def version_at(tx: Transaction, map_id: int, number: int) -> VersionRow | None:
    found = tx.execute(_NUMBERED, {"map_id": map_id, "number": number}).first()
    return None if found is None else version_row(found)


def name_version(tx: Transaction, map_id: int, number: int, name: str | None) -> None:
    tx.execute(sa.update(version).where(version.c.map_id == map_id, version.c.number == number).values(name=name))


def versions_after(tx: Transaction, map_id: int, number: int, limit: int) -> Sequence[VersionHead]:
    """The oldest first."""
    query = _HEAD.where(version.c.map_id == map_id, version.c.number > number)
    return [as_row(VersionHead, row) for row in tx.execute(query.order_by(version.c.number).limit(limit))]


def versions_page(tx: Transaction, map_id: int, before: int | None, limit: int) -> Sequence[VersionHead]:
    """The newest first."""
    query = _HEAD.where(version.c.map_id == map_id)
    if before is not None:
        query = query.where(version.c.number < before)
    return [as_row(VersionHead, row) for row in tx.execute(query.order_by(version.c.number.desc()).limit(limit))]


def heads(tx: Transaction, maps: Sequence[MapRow]) -> Mapping[int, VersionHead]:
    """The version in force of each map that has one, by map id."""
    query = _HEAD.join(map_, sa.and_(map_.c.id == version.c.map_id, map_.c.head == version.c.number))
    rows = tx.execute(query.where(map_.c.id.in_([row.id for row in maps])))
    return {head.map_id: head for head in (as_row(VersionHead, row) for row in rows)}


def room_row(tx: Transaction, map_id: int, room_id: str) -> RoomRow | None:
    query = sa.select(*columns(room, RoomRow)).where(room.c.map_id == map_id, room.c.id == room_id)
    return as_row_or_none(RoomRow, tx.execute(query).first())
