"""What is written into archives, page by page, and maps that are brought in from one."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sqlalchemy as sa

from stillroom.store import maps
from stillroom.store.database import Transaction
from stillroom.store.fleet_tables import plan_grant, plan_view
from stillroom.store.privacy_tables import access_log
from stillroom.store.rows import Json, MissionRow, RoomRow, VersionRow, as_row, columns
from stillroom.store.tables import conflict, ending, event, lane, map_, mission, room, sighting, version

PAGE = 200


def versions(tx: Transaction, map_id: int, after: int) -> Sequence[VersionRow]:
    """The oldest first."""
    query = maps.VERSION.where(version.c.map_id == map_id, version.c.number > after)
    return [maps.version_row(row) for row in tx.execute(query.order_by(version.c.number).limit(PAGE))]


def missions(tx: Transaction, map_id: int, after: int) -> Sequence[MissionRow]:
    """The oldest first."""
    query = sa.select(*columns(mission, MissionRow)).where(mission.c.map_id == map_id, mission.c.id > after)
    return [as_row(MissionRow, row) for row in tx.execute(query.order_by(mission.c.id).limit(PAGE))]


def rooms(tx: Transaction, map_id: int) -> Sequence[RoomRow]:
    query = sa.select(*columns(room, RoomRow)).where(room.c.map_id == map_id).order_by(room.c.id)
    return [as_row(RoomRow, row) for row in tx.execute(query)]


def placed_from(tx: Transaction, mission_id: int) -> tuple[int, str]:
    """The ordinal of a mission's map, and its key."""
    query = sa.select(map_.c.ordinal, mission.c.key).join(map_, map_.c.id == mission.c.map_id)
    row = tx.execute(query.where(mission.c.id == mission_id)).one()
    return row.ordinal, row.key


def decisions(tx: Transaction, map_id: int) -> Iterator[Mapping[str, Any]]:
    """Each time that a mission met a conflict, and how it ended."""
    said = ("key", "kind", "resolved", "opened_at", "due_at", "quiet")
    seen = ("cause", "summary", "rooms", "dividers", "restrictions", "base_version")
    ended = ("state", "response", "proposal", "dividers", "note", "decided_by", "decided_at", "version")
    query = (
        sa.select(
            *(conflict.c[name] for name in said),
            mission.c.key.label("mission"),
            *(sighting.c[name] for name in seen),
            *(ending.c[name].label(f"ended_{name}") for name in ended),
        )
        .select_from(sighting)
        .join(conflict, conflict.c.id == sighting.c.conflict_id)
        .join(mission, mission.c.id == sighting.c.mission_id)
        .outerjoin(ending, ending.c.conflict_id == conflict.c.id)
        .where(conflict.c.map_id == map_id)
        .order_by(sighting.c.id)
    )
    yield from (dict(row._mapping) for row in tx.execute(query))


def events(tx: Transaction, map_id: int) -> Iterator[Mapping[str, Any]]:
    robot_id = sa.select(map_.c.robot_id).where(map_.c.id == map_id).scalar_subquery()
    query = sa.select(event.c.kind, event.c.data, event.c.created_at)
    query = query.where(event.c.robot_id == robot_id, event.c.map_id == map_id)
    yield from (dict(row._mapping) for row in tx.execute(query.order_by(event.c.id)))


def looks(tx: Transaction, robot_id: str) -> Iterator[Mapping[str, Any]]:
    """Who looked at the maps, or changed them; and who looked at floor plans."""
    log = sa.select(*(access_log.c[name] for name in ("who", "did", "what", "source", "times", "last_at")))
    yield from (
        dict(row._mapping) for row in tx.execute(log.where(access_log.c.robot_id == robot_id).order_by(access_log.c.id))
    )
    names = ("viewer", "map_name", "mission", "what", "why", "at")
    query = sa.select(*(plan_view.c[name] for name in names)).where(plan_view.c.robot_id == robot_id)
    yield from (dict(row._mapping) for row in tx.execute(query.order_by(plan_view.c.id)))


def grants(tx: Transaction, robot_id: str) -> Iterator[Mapping[str, Any]]:
    """Who asked to look at the floor plans, and what was said to it."""
    names = (
        "asked_by",
        "reason",
        "asked_at",
        "granted",
        "answered_by",
        "answered_at",
        "expires_at",
        "ended_by",
        "ended_at",
    )
    query = sa.select(*(plan_grant.c[name] for name in names)).where(plan_grant.c.robot_id == robot_id)
    yield from (dict(row._mapping) for row in tx.execute(query.order_by(plan_grant.c.id)))


# -- bringing in ---------------------------------------------------------------------------------------------------


def ordinals(tx: Transaction, robot_id: str) -> Mapping[str, int]:
    """Those of a robot's maps, by their names."""
    query = sa.select(map_.c.name, map_.c.ordinal).where(map_.c.robot_id == robot_id)
    return {row.name: row.ordinal for row in tx.execute(query)}


def room_ids(tx: Transaction, robot_id: str) -> set[str]:
    """Of all maps of a robot."""
    query = sa.select(room.c.id).join(map_, map_.c.id == room.c.map_id).where(map_.c.robot_id == robot_id)
    return set(tx.execute(query).scalars())


def add_map(tx: Transaction, values: Json, ready_at: float | None) -> int:
    """With its lane; its number."""
    made: int = tx.execute(sa.insert(map_).values(values).returning(map_.c.id)).scalar_one()
    tx.execute(sa.insert(lane).values(map_id=made, ready_at=ready_at))
    return made


def add_rooms(tx: Transaction, rows: Sequence[Json]) -> None:
    if rows:
        tx.execute(sa.insert(room), rows)


def add_version(tx: Transaction, values: Json) -> None:
    tx.execute(sa.insert(version).values(values | {"packed": values["document"], "document": None}))


def add_mission(tx: Transaction, values: Json) -> int:
    made: int = tx.execute(sa.insert(mission).values(values).returning(mission.c.id)).scalar_one()
    return made


def link_placed(tx: Transaction, mission_id: int, parked_id: int) -> None:
    tx.execute(sa.update(mission).where(mission.c.id == mission_id).values(placed_from=parked_id))
