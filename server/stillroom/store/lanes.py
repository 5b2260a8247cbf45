"""One lane a map: its lock, its schedule and its lease. Missions of one map are processed in order, maps in parallel.

A claimed lane is simply not ready until its lease ends, so that a worker that dies needs nobody to clean up after it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import sqlalchemy as sa
from sqlalchemy.sql.dml import ReturningUpdate

from stillroom.store import clock
from stillroom.store.changes import Change
from stillroom.store.database import Database, Transaction, tell
from stillroom.store.hints import Hint
from stillroom.store.tables import lane, mission

LEASE_S = 10.0
PAUSE_S = 2.0
"""Before a mission is tried again that could not be tried."""


@dataclass(frozen=True)
class Claim:
    """The right to process one mission, until the lease ends."""

    map_id: int
    mission_id: int
    attempts: int
    token: str


# Statements of every mission are made once: making one takes as long as running it.
_this = lane.c.map_id == sa.bindparam("of")
_LOCK = sa.select(lane.c.claim).where(_this).with_for_update()
_WAKE = sa.update(lane).where(_this, lane.c.ready_at.is_(None)).values(ready_at=clock.SECONDS)
_TO_NEXT = sa.select(sa.func.min(lane.c.ready_at) - clock.SECONDS)
_longest = (  # passing over those that another transaction holds
    sa.select(lane.c.map_id)
    .where(lane.c.ready_at <= clock.SECONDS)
    .order_by(lane.c.ready_at)
    .limit(1)
    .with_for_update(skip_locked=True)
    .scalar_subquery()
)
_TAKE = (
    sa.update(lane)
    .where(lane.c.map_id == _longest)
    .values(claim=sa.bindparam("token"), ready_at=clock.SECONDS + sa.bindparam("lease", type_=sa.Double()))
    .returning(lane.c.map_id)
)
_unfinished = mission.c.status != sa.literal_column(
    "'done'"
)  # as the index has it: a plan for any status could not use that


def _unfinished_of(map_id: sa.ColumnElement[int]) -> sa.Select[int]:
    return sa.select(mission.c.id).where(mission.c.map_id == map_id, _unfinished)


def _begun(map_id: sa.ColumnElement[int]) -> ReturningUpdate[Any]:
    next_one = _unfinished_of(map_id).order_by(mission.c.epoch, mission.c.sequence, mission.c.id).limit(1)
    return (
        sa.update(mission)
        .where(mission.c.id == next_one.scalar_subquery(), _unfinished)
        .values(status="processing", attempts=mission.c.attempts + 1)
        .returning(mission.c.id, mission.c.attempts)
    )


_BEGIN = _begun(sa.bindparam("of"))
_taken = _TAKE.cte("taken")
_first = _begun(sa.select(_taken.c.map_id).scalar_subquery()).cte("begun")
# for PostgreSQL; the commit that this statement is waits for no disk
_TAKE_AND_BEGIN = sa.select(
    _TO_NEXT.scalar_subquery().label("ready_in"),
    _taken.c.map_id,
    _first.c.id,
    _first.c.attempts,
    sa.func.set_config("synchronous_commit", "off", sa.true()),
).select_from(sa.select(sa.true()).subquery().outerjoin(_taken, sa.true()).outerjoin(_first, sa.true()))
_another = _unfinished_of(sa.bindparam("of")).where(mission.c.id != sa.bindparam("done"))
_RELEASE = (
    sa.update(lane).where(_this).values(claim=None, ready_at=sa.case((_another.exists(), clock.SECONDS), else_=None))
)


def lock(tx: Transaction, map_id: int) -> str | None:
    """Holds the lane until the end of the transaction; answers with the token that claims it."""
    token: str | None = tx.execute(_LOCK, {"of": map_id}).one().claim
    return token


def wake(tx: Transaction, map_id: int) -> None:
    """There is something to do; a lane that is claimed finds out when its worker is done. The lane must be locked."""
    tx.execute(_WAKE, {"of": map_id})
    tell(tx, Hint("work", map_id))


def claim(database: Database) -> Claim | None:
    """As `claim_or_rest`."""
    claimed = claim_or_rest(database)
    return claimed if isinstance(claimed, Claim) else None


def claim_or_rest(database: Database) -> Claim | float | None:
    """The next mission of the lane that waits longest; where no lane is ready, seconds until one becomes so, None where all rest.

    Not durable: where a power loss forgets the claim, the mission is simply claimed again.
    """
    wanted = {"token": uuid4().hex, "lease": LEASE_S}
    return _claim_at_once(database, wanted) if database.is_postgresql else _claim(database, wanted)


def _claim_at_once(database: Database, wanted: Mapping[str, Any]) -> Claim | float | None:
    with database.look() as tx:
        found = tx.execute(_TAKE_AND_BEGIN, wanted).one()
    if found.map_id is None:
        ready_in: float | None = found.ready_in
        return ready_in
    if found.id is None:  # another worker was done with that mission after this statement had begun
        with database.write(durable=False) as tx:
            return _begin(tx, found.map_id, wanted["token"]) if lock(tx, found.map_id) == wanted["token"] else None
    return Claim(found.map_id, found.id, found.attempts, wanted["token"])


def _claim(database: Database, wanted: Mapping[str, Any]) -> Claim | float | None:
    with (
        database.look() as tx
    ):  # workers are woken more often than there is something to do, and writers wait for each other
        ready_in = seconds_to_next(tx)
        if ready_in is None or ready_in > 0:
            return ready_in
    with database.write(durable=False) as tx:
        map_id = tx.execute(_TAKE, wanted).scalar()
        return None if map_id is None else _begin(tx, map_id, wanted["token"])


def _begin(tx: Transaction, map_id: int, token: str) -> Claim | None:
    begun = tx.execute(_BEGIN, {"of": map_id}).first()
    if begun is None:
        tx.execute(sa.update(lane).where(lane.c.map_id == map_id).values(claim=None, ready_at=None))
        return None
    return Claim(map_id, begun.id, begun.attempts, token)


def renew(database: Database, held: Claim) -> None:
    """Puts the end of the lease off, as long as the claim holds."""
    mine = lane.c.map_id == held.map_id, lane.c.claim == held.token
    with database.write(durable=False) as tx:
        tx.execute(sa.update(lane).where(*mine).values(ready_at=clock.SECONDS + LEASE_S))


def hand_back(database: Database, held: Claim) -> None:
    """Ends a claim whose mission could not be tried, for no fault of its own: it is tried again after a pause."""
    with database.write(durable=False) as tx:
        if lock(tx, held.map_id) != held.token:
            return
        untried = {"status": "queued", "attempts": mission.c.attempts - 1}
        tx.execute(sa.update(mission).where(mission.c.id == held.mission_id).values(**untried))
        later = {"claim": None, "ready_at": clock.SECONDS + PAUSE_S}
        tx.execute(sa.update(lane).where(lane.c.map_id == held.map_id).values(**later))


def released(held: Claim) -> Change:
    """The claim ends with its mission: the lane is ready again where more missions wait. The lane must be locked."""
    return Change(_RELEASE, {"of": held.map_id, "done": held.mission_id})


@dataclass(frozen=True)
class Backlog:
    missions: int
    """That are not done; one more than was asked for, where there are more than that."""
    oldest_s: float
    """For how long the lane that is next has been ready."""


def backlog(tx: Transaction, most: int) -> Backlog:
    some = sa.select(sa.literal(1)).select_from(mission).where(_unfinished).limit(most + 1)
    missions = tx.execute(sa.select(sa.func.count()).select_from(some.subquery())).scalar_one()
    ready_in = seconds_to_next(tx)
    return Backlog(missions, 0.0 if ready_in is None else max(-ready_in, 0.0))


def seconds_to_next(tx: Transaction) -> float | None:
    """Until a lane becomes ready (negative: it is); None where all rest."""
    seconds: float | None = tx.execute(_TO_NEXT).scalar()
    return seconds


def expire(tx: Transaction, map_id: int) -> None:
    """Ends a lease at once, for those who know that its worker is gone."""
    tx.execute(sa.update(lane).where(lane.c.map_id == map_id, lane.c.claim.is_not(None)).values(ready_at=clock.SECONDS))
