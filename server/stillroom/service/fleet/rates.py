"""The paper's results table of what happens in homes: how many missions fail, with how sure one can be of it."""

from collections.abc import Sequence
from datetime import date, timedelta
from typing import get_args

import numpy as np

from stillroom.documents.fleet import (
    FailedRows,
    FiltersDocument,
    GroupBy,
    Interval,
    Measures,
    Ranges,
    RateRow,
    RatesDocument,
    RobotOrder,
    RobotRow,
    Size,
)
from stillroom.errors import Fault, InvalidInput
from stillroom.estimation.intervals import MOST_DRAWS, RESAMPLES, wilson
from stillroom.service.fleet.counting import ROWS, catch_up
from stillroom.service.fleet.figures import Figures, clusters, figures, resampled
from stillroom.service.fleet.selecting import Asked, selection
from stillroom.store import fleet_figures, tallies
from stillroom.store.database import Database, Transaction
from stillroom.store.fleet import MEASURES
from stillroom.store.fleet_figures import Group, Selection

MINIMUM_N = 30
"""With fewer missions a share is not drawn, only its interval."""
_FAILED_ROWS = {"transfer": 1, "meta_occupancy": 2, "meta_dividers": 3, "processing": 3}
"""How many rows of the results table fail with a cause of that stage."""


def rates(
    database: Database, asked: Asked, group_by: GroupBy | None, interval: Interval = "wilson", counted: bool = True
) -> RatesDocument:
    """`counted`: what was processed and is not counted yet is counted first. Raises InvalidInput."""
    of = selection(asked)
    if counted:
        catch_up(database)
    with database.read() as tx:
        groups, everything = _groups(tx, of, group_by)
        waiting = fleet_figures.waiting(tx)
    rows, total = figures(groups, everything, same_missions=group_by == "cause")
    items, whole = [_row(row) for row in rows], _row(total)
    if interval == "bootstrap":
        drawn = groups if group_by != "cause" else [_with_missions(group, everything) for group in groups]
        _check_bounds([*drawn, everything])
        items = [_resampled(row, group) for row, group in zip(items, drawn, strict=True)]
        whole = _resampled(whole, everything)
    if group_by not in ("day", "week"):
        items = sorted(items, key=lambda row: (-row.missions, -row.failed.transfer, row.key))
    return RatesDocument(
        items=items if group_by is not None else [whole],
        next=None,
        total=whole,
        first=of.first,
        last=of.last,
        group_by=group_by,
        interval=interval,
        minimum_n=MINIMUM_N,
        waiting=waiting,
    )


def filters(database: Database) -> FiltersDocument:
    with database.read() as tx:
        known, first = fleet_figures.known(tx), fleet_figures.first_day(tx)
    sizes: list[Size] = [size for size in get_args(Size) if size in known["size"]]
    return FiltersDocument(
        firmware=known["firmware"],
        model=known["model"],
        algorithm=known["algorithm"],
        size=sizes,
        first=first,
        minimum_n=MINIMUM_N,
    )


def robots(database: Database, asked: Asked, sort: RobotOrder, at_least: int, limit: int) -> list[RobotRow]:
    """Those with at least so many missions; robots that were deleted are left out."""
    of = selection(asked)
    catch_up(database)
    with database.read() as tx:
        (group,) = fleet_figures.tallies(tx, of, None)
        decoded = {name: tallies.decode(tally) for name, tally in group.tallies.items()}
        most = 1 + max((int(robots.max()) for robots in decoded.values() if len(robots)), default=0)
        counts = {name: np.bincount(robots, minlength=most) for name, robots in decoded.items()}
        missions, failed = counts["missions"], counts["reverted"] + counts["needs_review"]
        low, high = wilson(failed.astype(np.float64), missions.astype(np.float64))
        share = failed / np.maximum(missions, 1)
        order = {"-failure_rate": share, "-lower_bound": low, "-missions": missions, "-escapes": counts["escapes"]}
        chosen = np.flatnonzero(missions >= max(at_least, 1))
        ranked = chosen[np.lexsort((chosen, -missions[chosen], -low[chosen], -order[sort][chosen]))]
        known = fleet_figures.robots_of(tx, ranked[: 2 * limit].tolist())
    return [
        RobotRow(
            robot=known[number][0],
            missions=int(missions[number]),
            failed=int(failed[number]),
            failure_rate=float(share[number]),
            ci95=(float(low[number]), float(high[number])),
            **{name: int(counts[name][number]) for name in ("reverted", "needs_review", "parked", "escapes")},
        )
        for number in ranked[: 2 * limit].tolist()
        if number in known
    ][:limit]


def _groups(tx: Transaction, of: Selection, by: GroupBy | None) -> tuple[list[Group], Group]:
    """The groups, and all missions as one."""
    if by == "cause":
        return _by_cause(tx, of), fleet_figures.tallies(tx, of, None)[0]
    groups = fleet_figures.tallies(tx, of, "day" if by == "week" else by)
    return (_weeks(groups) if by == "week" else groups), _whole(groups)


def _weeks(days: Sequence[Group]) -> list[Group]:
    weeks: dict[date, list[Group]] = {}
    for group in days:
        day = date.fromisoformat(group.key)
        weeks.setdefault(day - timedelta(days=day.weekday()), []).append(group)
    return [Group(monday.isoformat(), _whole(groups).tallies) for monday, groups in weeks.items()]


def _whole(groups: Sequence[Group]) -> Group:
    names = ("missions", *MEASURES)
    return Group("all", {name: "".join(group.tallies.get(name, "") for group in groups) for name in names})


def _by_cause(tx: Transaction, of: Selection) -> list[Group]:
    """How missions failed by each."""
    causes = {row.id: row for row in fleet_figures.causes(tx)}
    found: dict[str, dict[str, list[str]]] = {}
    for failures in fleet_figures.failures(tx, of):
        cause = causes[failures.cause_id]
        tally = found.setdefault(cause.cause, {name: [] for name in MEASURES})
        names = list(ROWS[: _FAILED_ROWS.get(cause.stage, 0)])
        for name in [*names, *(failures.outcome,) * (failures.outcome in MEASURES)]:
            tally[name].append(failures.robots)
    for cause_id, robot in fleet_figures.escapes_by_cause(tx, of):
        found[causes[cause_id].cause]["escapes"].append(tallies.encode([robot]))
    return [Group(key, {name: "".join(parts) for name, parts in tally.items()}) for key, tally in found.items()]


def _with_missions(group: Group, whole: Group) -> Group:
    return Group(group.key, dict(group.tallies) | {"missions": whole.tallies["missions"]})


def _check_bounds(groups: Sequence[Group]) -> None:
    draws = RESAMPLES * sum(map(clusters, groups))
    if draws > MOST_DRAWS:
        detail = f"Drawing robots anew takes {draws // RESAMPLES:,} robots here; at most {MOST_DRAWS // RESAMPLES:,}."
        raise InvalidInput(f"{detail} Ask for fewer groups.", (Fault("/group_by", "too many groups"),))


def _row(of: Figures) -> RateRow:
    shares = of.shares
    return RateRow(
        key=of.key,
        missions=of.missions,
        robots=of.robots,
        sufficient=of.missions >= MINIMUM_N,
        rates=Measures(**{name: _rounded(share.value) for name, share in shares.items()}),
        ci95=Ranges(**{name: (round(share.low, 6), round(share.high, 6)) for name, share in shares.items()}),
        design_effect=Measures(**{name: round(share.effect, 3) for name, share in shares.items()}),
        clustering={name: share.clustering for name, share in shares.items()},
        failed=FailedRows(**{name: shares[name].count for name in ROWS}),
        **{name: shares[name].count for name in ("reverted", "needs_review", "parked", "escapes")},
    )


def _resampled(row: RateRow, group: Group) -> RateRow:
    drawn = resampled(group)
    ranges = row.ci95.model_dump() | drawn
    clustering = row.clustering | dict.fromkeys(drawn, "resampled")
    return row.model_copy(update={"ci95": Ranges(**ranges), "clustering": clustering})


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 6)
