"""Rollouts of settings of the pipeline: their stages, their missions, and each time that it was decided about them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store import clock
from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.fleet_tables import counted, rolled, rollout, rollout_look
from stillroom.store.rows import Json, as_row, as_row_or_none, columns
from stillroom.store.tables import map_, mission

LEASE_S = 60.0
"""Longer than a mission takes to be run again."""
ROWS = ("transfer", "meta_occupancy", "meta_dividers")
OUTCOMES = ("reverted", "needs_review", "parked")
MEASURES = (*ROWS, *OUTCOMES, "escapes")


@dataclass(frozen=True)
class NewRollout:
    name: str
    code: str
    algorithm: str
    resolvers: Sequence[str]
    params: Json
    gates: Sequence[Json]
    automatic: bool
    stage: int
    staged_at: datetime
    created_at: datetime
    created_by: str


@dataclass(frozen=True)
class RolloutRow(NewRollout):
    id: int
    state: str
    ended_at: datetime | None
    ended_by: str | None
    reason: str | None
    withdrawn_at: datetime | None


@dataclass(frozen=True)
class Look:
    rollout_id: int
    number: int
    stage: int
    missions: int
    at: datetime
    verdict: str
    gates: Sequence[Json]


@dataclass(frozen=True)
class Robot:
    """How the missions of one robot came out, by one of the two settings."""

    candidate: bool
    missions: int
    """Without the parked ones."""
    counts: Mapping[str, int]
    """By measure."""


@dataclass(frozen=True)
class Compared:
    """The missions of one robot that were run both ways."""

    missions: int
    taken_alone: int
    """Of these, those of maps that need nobody's leave to change: where an owner agrees first, an outcome says nothing."""
    cells: Mapping[str, tuple[int, int, int, int]]
    """By measure how many came through: both ways, with the old alone, with the new alone, neither way."""


@dataclass(frozen=True)
class Beside:
    """What a mission came to with the candidate."""

    outcome: str
    ablation_transfer: bool
    ablation_meta_occupancy: bool
    ablation_meta_dividers: bool
    ms: float
    error: str | None = None


@dataclass(frozen=True)
class ToRun:
    """A mission that is to be run beside."""

    rollout: RolloutRow
    mission_id: int


_ROLLOUT = sa.select(*columns(rollout, RolloutRow))


def add(tx: Transaction, new: NewRollout) -> bool:
    """False where there is one of that name, or one that is running."""
    return insert_unless_there(tx, rollout, vars(new) | {"state": "running"})


def by_name(tx: Transaction, name: str) -> RolloutRow | None:
    return as_row_or_none(RolloutRow, tx.execute(_ROLLOUT.where(rollout.c.name == name)).first())


def running(tx: Transaction) -> RolloutRow | None:
    return as_row_or_none(RolloutRow, tx.execute(_ROLLOUT.where(rollout.c.state == "running")).first())


def lock(tx: Transaction, rollout_id: int) -> RolloutRow:
    """Until the end of the transaction nobody else decides about it."""
    return as_row(RolloutRow, tx.execute(_ROLLOUT.where(rollout.c.id == rollout_id).with_for_update()).one())


_state = rollout.c.state
_in_play = sa.or_(_state == "running", _state == "successful"), rollout.c.withdrawn_at.is_(None)
_IN_PLAY = _ROLLOUT.where(*_in_play).order_by(rollout.c.id.desc())
IS_ANY_IN_PLAY = sa.exists().where(*_in_play)
"""Inside of another query."""


def in_play(tx: Transaction) -> Sequence[RolloutRow]:
    """The one that is running, and those that were successful and not withdrawn since; the newest first."""
    return [as_row(RolloutRow, row) for row in tx.execute(_IN_PLAY)]


def page(tx: Transaction, before: int | None, limit: int) -> Sequence[RolloutRow]:
    """The newest first."""
    query = _ROLLOUT if before is None else _ROLLOUT.where(rollout.c.id < before)
    return [as_row(RolloutRow, row) for row in tx.execute(query.order_by(rollout.c.id.desc()).limit(limit))]


def change(tx: Transaction, rollout_id: int, values: Mapping[str, Any]) -> None:
    """It must be locked."""
    tx.execute(sa.update(rollout).where(rollout.c.id == rollout_id).values(**values))


def add_look(tx: Transaction, look: Look) -> None:
    tx.execute(sa.insert(rollout_look).values(vars(look)))


def looks(tx: Transaction, rollout_id: int) -> Sequence[Look]:
    """In their order."""
    query = sa.select(*columns(rollout_look, Look)).where(rollout_look.c.rollout_id == rollout_id)
    return [as_row(Look, row) for row in tx.execute(query.order_by(rollout_look.c.number))]


# -- its missions -------------------------------------------------------------------------------------------------


def add_mission(
    tx: Transaction, rollout_id: int, mission_id: int, stage: int, candidate: bool, is_to_run: bool
) -> None:
    """`is_to_run`: beside. A mission that is run again by hand is of the rollout anew."""
    tx.execute(sa.delete(rolled).where(rolled.c.rollout_id == rollout_id, rolled.c.mission_id == mission_id))
    due = clock.SECONDS if is_to_run else None
    values = {"rollout_id": rollout_id, "mission_id": mission_id, "stage": stage, "candidate": candidate}
    tx.execute(sa.insert(rolled).values(**values, due_at=due))


def next_to_run(tx: Transaction) -> ToRun | None:
    """The mission that has waited longest to be run beside; whoever takes it has it for a minute."""
    now = clock.SECONDS
    pick = (
        sa.select(rolled.c.rollout_id, rolled.c.mission_id)
        .where(rolled.c.due_at <= now)
        .order_by(rolled.c.due_at)
        .limit(1)
        .with_for_update(skip_locked=True)
    )
    row = tx.execute(pick).first()
    if row is None:
        return None
    tx.execute(sa.update(rolled).where(*_is(row.rollout_id, row.mission_id)).values(due_at=now + LEASE_S))
    of = as_row(RolloutRow, tx.execute(_ROLLOUT.where(rollout.c.id == row.rollout_id)).one())
    return ToRun(of, row.mission_id)


def is_any_to_run(tx: Transaction) -> bool:
    query = sa.select(rolled.c.mission_id).where(rolled.c.due_at <= clock.SECONDS).limit(1)
    return tx.execute(query).first() is not None


def keep(tx: Transaction, rollout_id: int, mission_id: int, found: Beside) -> None:
    tx.execute(sa.update(rolled).where(*_is(rollout_id, mission_id)).values(**vars(found), due_at=None))


def forget_to_run(tx: Transaction, rollout_id: int) -> None:
    """Nothing is run beside any more."""
    waits = rolled.c.rollout_id == rollout_id, rolled.c.due_at.is_not(None)
    tx.execute(sa.update(rolled).where(*waits).values(due_at=None))


def progress(tx: Transaction, rollout_id: int) -> tuple[int, int, int]:
    """How many missions were run beside, how many wait for it, and how many of the former failed to run."""
    sums = (sa.func.count(column) for column in (rolled.c.outcome, rolled.c.due_at, rolled.c.error))
    row = tx.execute(sa.select(*sums).where(rolled.c.rollout_id == rollout_id, rolled.c.stage == 0)).one()
    return row[0], row[1], row[2]


def sizes(tx: Transaction, rollout_id: int) -> Mapping[tuple[int, bool], int]:
    """How many missions were judged, by stage and whether it was by the candidate; at the beginning, how many were run both ways."""
    n = sa.func.count().label("n")
    query = (
        sa.select(rolled.c.stage, rolled.c.candidate, n)
        .join(counted, counted.c.mission_id == rolled.c.mission_id)
        .where(rolled.c.rollout_id == rollout_id, counted.c.outcome != "parked")
        .where(sa.or_(rolled.c.stage > 0, rolled.c.outcome.is_not(None)))
        .group_by(rolled.c.stage, rolled.c.candidate)
    )
    return {(row.stage, bool(row.candidate)): row.n for row in tx.execute(query)}


def robots(tx: Transaction, rollout_id: int, stage: int, candidate: bool) -> list[Robot]:
    """One entry for each robot of one arm."""
    judged = counted.c.outcome != "parked"
    query = (
        sa.select(_sum(judged).label("missions"), *(_sum(bad).label(name) for name, bad in _failures().items()))
        .select_from(rolled)
        .join(counted, counted.c.mission_id == rolled.c.mission_id)
        .where(rolled.c.rollout_id == rollout_id, rolled.c.stage == stage, rolled.c.candidate.is_(candidate))
        .group_by(counted.c.robot)
        .order_by(counted.c.robot)
    )
    rows = (row._mapping for row in tx.execute(query))
    return [Robot(candidate, row["missions"], {name: row[name] for name in MEASURES}) for row in rows]


def compared(tx: Transaction, rollout_id: int) -> list[Compared]:
    """One entry for each robot that has missions which were run both ways."""
    old = _failures()
    new = {row: ~rolled.c[f"ablation_{row}"] for row in ROWS} | {name: rolled.c.outcome == name for name in OUTCOMES}
    alone = map_.c.review == "automatic"
    judged = counted.c.outcome != "parked"
    sums = [_sum(judged).label("missions"), _sum(judged & alone).label("taken_alone")]
    for name, fails in new.items():
        which = judged if name in ROWS else alone if name == "parked" else judged & alone
        ways = (~old[name] & ~fails, ~old[name] & fails, old[name] & ~fails, old[name] & fails)
        sums += [_sum(which & way).label(f"{name}_{cell}") for cell, way in enumerate(ways)]
    query = (
        sa.select(*sums)
        .select_from(rolled)
        .join(counted, counted.c.mission_id == rolled.c.mission_id)
        .join(mission, mission.c.id == rolled.c.mission_id)
        .join(map_, map_.c.id == mission.c.map_id)
        .where(rolled.c.rollout_id == rollout_id, rolled.c.stage == 0, rolled.c.outcome.is_not(None))
        .group_by(counted.c.robot)
        .order_by(counted.c.robot)
    )
    return [
        Compared(
            row["missions"],
            row["taken_alone"],
            {name: (row[f"{name}_0"], row[f"{name}_1"], row[f"{name}_2"], row[f"{name}_3"]) for name in new},
        )
        for row in (row._mapping for row in tx.execute(query))
    ]


@dataclass(frozen=True)
class ChangedMap:
    map_id: int
    first: int
    """Version."""


def changed_maps(
    tx: Transaction, rollout_id: int, after: int = 0, limit: int | None = None, robot_id: str | None = None
) -> Sequence[ChangedMap]:
    """Maps that missions changed which the candidate processed, and the first version that it made, in order of the maps."""
    query = (
        sa.select(mission.c.map_id, sa.func.min(mission.c.version).label("first"))
        .select_from(rolled)
        .join(mission, mission.c.id == rolled.c.mission_id)
        .where(rolled.c.rollout_id == rollout_id, rolled.c.candidate, mission.c.outcome.in_(("updated", "resolved")))
        .where(mission.c.version > mission.c.base_version, mission.c.map_id > after)
        .group_by(mission.c.map_id)
        .order_by(mission.c.map_id)
        .limit(limit)
    )
    if robot_id is not None:
        query = query.join(map_, map_.c.id == mission.c.map_id).where(map_.c.robot_id == robot_id)
    return [as_row(ChangedMap, row) for row in tx.execute(query)]


def by_candidate(tx: Transaction, rollout_id: int, map_id: int) -> set[str]:
    """Keys of the missions of a map that the candidate processed."""
    query = (
        sa.select(mission.c.key)
        .join(rolled, rolled.c.mission_id == mission.c.id)
        .where(rolled.c.rollout_id == rollout_id, rolled.c.candidate, mission.c.map_id == map_id)
    )
    return set(tx.execute(query).scalars())


def _is(rollout_id: int, mission_id: int) -> tuple[sa.ColumnElement[bool], ...]:
    return rolled.c.rollout_id == rollout_id, rolled.c.mission_id == mission_id


def _sum(of: sa.ColumnElement[bool]) -> sa.ColumnElement[int]:
    return sa.func.coalesce(sa.func.sum(sa.case((of, 1), else_=0)), 0)


def _failures() -> dict[str, sa.ColumnElement[bool]]:
    """By measure, whether a mission that was counted failed so."""
    rows = {row: counted.c.failed > place for place, row in enumerate(ROWS)}
    return (
        rows | {name: counted.c.outcome == name for name in OUTCOMES} | {"escapes": counted.c.escaped_at.is_not(None)}
    )
