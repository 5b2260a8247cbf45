"""Stored missions that are run again, and what they came to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.fleet_tables import replay, replayed
from stillroom.store.rows import Json, as_row, as_row_or_none, columns
from stillroom.store.tables import map_, mission

JUDGED = ("updated", "resolved", "needs_review", "reverted")
ROWS = ("transfer", "meta_occupancy", "meta_dividers")


@dataclass(frozen=True)
class NewReplay:
    name: str
    algorithm: str
    resolvers: Sequence[str]
    params: Json
    selection: Json
    missions: int
    created_at: datetime


@dataclass(frozen=True)
class ReplayRow(NewReplay):
    id: int
    finished_at: datetime | None


@dataclass(frozen=True)
class Result:
    replay_id: int
    mission_id: int
    outcome: str
    taken: bool
    ablation_transfer: bool
    ablation_meta_occupancy: bool
    ablation_meta_dividers: bool
    ms: float
    error: str | None = None


@dataclass(frozen=True)
class ReplayedRow:
    """A mission then and now."""

    id: int
    robot_id: str
    map_name: str
    key: str
    outcome_then: str
    outcome_now: str
    error: str | None


_REPLAY = sa.select(*columns(replay, ReplayRow))
_old: Mapping[str, sa.ColumnElement[bool]] = {
    **{row: mission.c[f"ablation_{row}"] for row in ROWS},
    "taken": mission.c.outcome.in_(("updated", "resolved")),
}
_new: Mapping[str, sa.ColumnElement[bool]] = {
    **{row: replayed.c[f"ablation_{row}"] for row in ROWS},
    "taken": replayed.c.taken,
}


def to_run(
    tx: Transaction, since: datetime | None, until: datetime | None, robot_ids: Sequence[str]
) -> Mapping[int, list[int]]:
    """Missions that were judged, by map, in the order of their processing."""
    query = _chosen(since, until, robot_ids).order_by(mission.c.map_id, mission.c.id)
    found: dict[int, list[int]] = {}
    for map_id, mission_id in tx.execute(query):
        found.setdefault(map_id, []).append(mission_id)
    return found


def left_to_run(
    tx: Transaction,
    replay_id: int,
    since: datetime | None,
    until: datetime | None,
    robot_ids: Sequence[str],
    limit: int,
) -> list[int]:
    """Some of those that were not run yet."""
    done = sa.select(replayed.c.mission_id).where(
        replayed.c.replay_id == replay_id, replayed.c.mission_id == mission.c.id
    )
    query = _chosen(since, until, robot_ids).where(~done.exists()).order_by(mission.c.id).limit(limit)
    return [row.id for row in tx.execute(query)]


def _chosen(since: datetime | None, until: datetime | None, robot_ids: Sequence[str]) -> sa.Select[Any]:
    query = sa.select(mission.c.map_id, mission.c.id).where(
        mission.c.outcome.in_(JUDGED),
        mission.c.base_version.is_not(None),
        mission.c.placed_from.is_(None),
        mission.c.ablation_transfer.is_not(None),
    )
    if since is not None:
        query = query.where(mission.c.finished_at >= since)
    if until is not None:
        query = query.where(mission.c.finished_at < until)
    if robot_ids:
        query = query.join(map_, map_.c.id == mission.c.map_id).where(map_.c.robot_id.in_(robot_ids))
    return query


def add(tx: Transaction, new: NewReplay) -> None:
    tx.execute(sa.insert(replay).values(vars(new)))


def by_name(tx: Transaction, name: str) -> ReplayRow | None:
    return as_row_or_none(ReplayRow, tx.execute(_REPLAY.where(replay.c.name == name)).first())


def page(tx: Transaction, before: int | None, limit: int) -> Sequence[ReplayRow]:
    """The newest first."""
    query = _REPLAY if before is None else _REPLAY.where(replay.c.id < before)
    return [as_row(ReplayRow, row) for row in tx.execute(query.order_by(replay.c.id.desc()).limit(limit))]


def done(tx: Transaction, replay_id: int) -> set[int]:
    query = sa.select(replayed.c.mission_id).where(replayed.c.replay_id == replay_id)
    return set(tx.execute(query).scalars())


def count_done(tx: Transaction, replay_id: int) -> int:
    query = sa.select(sa.func.count()).select_from(replayed).where(replayed.c.replay_id == replay_id)
    found: int = tx.execute(query).scalar_one()
    return found


def keep(tx: Transaction, results: Sequence[Result]) -> None:
    """What somebody else has run meanwhile stays as it is."""
    for result in sorted(results, key=lambda one: one.mission_id):  # two who wait for each other's rows never end
        insert_unless_there(tx, replayed, vars(result))


def next_in_service(tx: Transaction) -> ReplayRow | None:
    """The oldest that workers are to run and that is not finished."""
    waits = replay.c.finished_at.is_(None), replay.c.selection["in_service"].as_boolean()
    return as_row_or_none(ReplayRow, tx.execute(_REPLAY.where(*waits).order_by(replay.c.id).limit(1)).first())


def finish(tx: Transaction, replay_id: int, now: datetime) -> None:
    tx.execute(sa.update(replay).where(replay.c.id == replay_id).values(finished_at=now))


def paired(tx: Transaction, replay_id: int, measure: str) -> Mapping[tuple[bool, bool], int]:
    """How many missions succeeded (then, now), by a row of the results table or by being `taken`."""
    old, new = _old[measure], _new[measure]
    query = _both(replay_id, measure, old.label("old"), new.label("new"), sa.func.count().label("n"))
    return {(bool(row.old), bool(row.new)): row.n for row in tx.execute(query.group_by(old, new))}


def missions(
    tx: Transaction, replay_id: int, measure: str, then: bool, now: bool, before: int | None, limit: int
) -> Sequence[ReplayedRow]:
    """Those that succeeded so then and so now, the newest arrivals first."""
    old, new = _old[measure], _new[measure]
    query = (
        _both(
            replay_id,
            measure,
            mission.c.id,
            map_.c.robot_id,
            map_.c.name.label("map_name"),
            mission.c.key,
            mission.c.outcome.label("outcome_then"),
            replayed.c.outcome.label("outcome_now"),
            replayed.c.error,
        )
        .where(old if then else ~old, new if now else ~new)
        .order_by(mission.c.id.desc())
        .limit(limit)
    )
    if before is not None:
        query = query.where(mission.c.id < before)
    return [as_row(ReplayedRow, row) for row in tx.execute(query)]


def _both(replay_id: int, measure: str, *what: Any) -> sa.Select[Any]:
    query = (
        sa.select(*what)
        .select_from(replayed)
        .join(mission, mission.c.id == replayed.c.mission_id)
        .join(map_, map_.c.id == mission.c.map_id)
        .where(replayed.c.replay_id == replay_id, mission.c.ablation_transfer.is_not(None))
    )
    # where the owner agrees to each update first, whether it was taken says nothing about the algorithm
    return query.where(map_.c.review == "automatic") if measure == "taken" else query
