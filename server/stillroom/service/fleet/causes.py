"""What missions fail by, in groups that have one cause; each with a state that says whether somebody has to look."""

from collections.abc import Sequence
from datetime import date, datetime, timedelta
from typing import Any

import numpy as np

from stillroom.documents.api import Page
from stillroom.documents.fleet import (
    CauseDocument,
    CausesDocument,
    CauseState,
    FleetMissionItem,
    Mute,
    TrendPoint,
)
from stillroom.documents.fleet import CauseRow as CauseItem
from stillroom.errors import Fault, InvalidInput, NotFound
from stillroom.service.access import Principal, signature
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.selecting import Asked, selection
from stillroom.service.paging import page_of
from stillroom.store import clock, fleet_figures
from stillroom.store.database import Database, Transaction
from stillroom.store.fleet_figures import CauseDay, CauseRow, Failures, Selection
from stillroom.store.tallies import WIDTH, decode

RECENT = timedelta(days=7)
"""So long a cause is new, or has come back."""
WEEKLY_FROM = 92
"""Days, from which on a trend has weeks."""


def causes(database: Database, asked: Asked, state: CauseState | None, limit: int) -> CausesDocument:
    """Those that were met on these days, the most frequent first."""
    of = selection(asked)
    waiting = catch_up(database)
    with database.read() as tx:
        rows = {row.id: row for row in fleet_figures.causes(tx)}
        outcomes, trends, now = _grouped(fleet_figures.failures(tx, of)), fleet_figures.trends(tx, of), clock.now(tx)
    total = sum(_count(failures) for of_cause in outcomes.values() for failures in of_cause)
    found = [_item(rows[cause_id], outcomes[cause_id], trends[cause_id], total, now, of) for cause_id in outcomes]
    if state is not None:
        found = [item for item in found if item.state == state]
    found.sort(key=lambda item: (-item.missions, item.id))
    return CausesDocument(items=found[:limit], next=None, first=of.first, last=of.last, missions=total, waiting=waiting)


def cause(database: Database, asked: Asked, key: str) -> CauseDocument:
    """Raises NotFound."""
    of = selection(asked)
    catch_up(database)
    with database.read() as tx:
        row = _find(tx, key)
        days, total, now = fleet_figures.of_cause(tx, of, row.id), fleet_figures.failed(tx, of), clock.now(tx)
    outcomes = [Failures(row.id, name, robots) for name, robots in _joined(days, "outcome").items()]
    trend = [(day, len(robots) // WIDTH) for day, robots in _joined(days, "day").items()]
    item = _item(row, outcomes, trend, total, now, of)
    shares = {
        name: {value: len(robots) // WIDTH for value, robots in _joined(days, name).items()}
        for name in ("firmware", "model", "size")
    }
    return CauseDocument.model_validate(item.model_dump() | shares)


def mute(database: Database, caller: Principal, key: str, how: Mute) -> CauseDocument:
    """Raises NotFound, InvalidInput."""
    with database.write() as tx:
        row, now = _find(tx, key), clock.now(tx)
        if how.until is not None and how.until.tzinfo is None:
            raise InvalidInput("Say until when with a time zone.", (Fault("/until", "no time zone"),))
        if how.until is not None and how.until <= now:
            raise InvalidInput("That is over already.", (Fault("/until", "in the past"),))
        values = {"muted_at": now, "muted_until": how.until, "muted_by": signature(caller), "mute_note": how.note}
        fleet_figures.mute(tx, row.id, values)
    return cause(database, Asked(), key)


def unmute(database: Database, key: str) -> CauseDocument:
    """Raises NotFound."""
    with database.write() as tx:
        names = ("muted_at", "muted_until", "muted_by", "mute_note")
        fleet_figures.mute(tx, _find(tx, key).id, dict.fromkeys(names))
    return cause(database, Asked(), key)


def missions(
    database: Database, asked: Asked, key: str | None, escaped: bool, cursor: int | None, limit: int
) -> Page[FleetMissionItem]:
    """Those that failed by a cause, or by any; or those that escaped. The newest arrivals first. Raises NotFound."""
    of = selection(asked)
    catch_up(database)
    with database.read() as tx:
        cause_id = None if key is None else _find(tx, key).id
        rows = fleet_figures.missions(tx, of, cause_id, escaped, cursor, limit + 1)
    items, following = page_of(rows, limit, lambda row: str(row.id))
    return Page(
        items=[
            FleetMissionItem(
                robot=row.robot_id,
                map=row.map_name,
                mission=row.key,
                outcome=row.outcome,
                finished_at=row.finished_at,
                firmware=row.firmware,
                model=row.model,
                algorithm=row.algorithm,
                escaped_at=row.escaped_at,
                cause=row.cause,
                url=f"/api/v1/fleet/robots/{row.robot_id}/maps/{row.map_name}/missions/{row.key}",
            )
            for row in items
        ],
        next=following,
    )


def state_of(row: CauseRow, now: datetime) -> CauseState:
    if is_muted(row, now):
        return "muted"
    if row.returned_at is not None and now - row.returned_at <= RECENT:
        return "regressed"
    return "new" if now - row.first_seen <= RECENT else "ongoing"


def is_muted(row: CauseRow, now: datetime) -> bool:
    return row.muted_at is not None and (row.muted_until is None or row.muted_until > now)


def _find(tx: Transaction, key: str) -> CauseRow:
    row = fleet_figures.cause(tx, key)
    if row is None:
        raise NotFound(f"There is no cause {key}.")
    return row


def _joined(days: Sequence[CauseDay], by: str) -> dict[Any, str]:
    """The tally of each value."""
    found: dict[Any, list[str]] = {}
    for one in days:
        found.setdefault(getattr(one, by), []).append(one.robots)
    return {value: "".join(tallies) for value, tallies in found.items()}


def _grouped(found: Sequence[Failures]) -> dict[int, list[Failures]]:
    groups: dict[int, list[Failures]] = {}
    for failures in found:
        groups.setdefault(failures.cause_id, []).append(failures)
    return groups


def _trend(days: Sequence[tuple[date, int]], weekly: bool) -> list[TrendPoint]:
    counts: dict[date, int] = {}
    for day, missions in days:
        at = day - timedelta(days=day.weekday()) if weekly else day
        counts[at] = counts.get(at, 0) + missions
    return [TrendPoint(day=day, missions=missions) for day, missions in counts.items()]


def _count(failures: Failures) -> int:
    return len(failures.robots) // WIDTH


def _item(
    row: CauseRow,
    outcomes: Sequence[Failures],
    days: Sequence[tuple[date, int]],
    total: int,
    now: datetime,
    of: Selection,
) -> CauseItem:
    counts = {failures.outcome: _count(failures) for failures in outcomes}
    missions = sum(counts.values())
    asked = {failures: counts.get(failures, 0) for failures in ("reverted", "needs_review", "parked")}
    query = f"from={of.first}&to={of.last}"
    return CauseItem(
        id=row.key,
        kind=row.kind,
        cause=row.cause,
        stage=row.stage,
        algorithm=row.algorithm,
        first_seen=row.first_seen,
        last_seen=row.last_seen,
        returned_at=row.returned_at,
        state=state_of(row, now),
        missions=missions,
        robots=len(np.unique(decode("".join(failures.robots for failures in outcomes)))),
        share=missions / total if total else 0.0,
        reverted=asked["reverted"],
        needs_review=asked["needs_review"],
        parked=asked["parked"],
        settled=missions - sum(asked.values()),
        trend=_trend(days, (of.last - of.first).days >= WEEKLY_FROM),
        muted_until=row.muted_until if is_muted(row, now) else None,
        muted_by=row.muted_by if is_muted(row, now) else None,
        note=row.mute_note if is_muted(row, now) else None,
        url=f"/api/v1/fleet/missions?cause={row.key}&{query}",
    )
