"""Whatever is asked of the dashboard: its figures are those that a slow, plain recomputation from the missions' rows comes to."""

from collections.abc import Collection
from datetime import date, timedelta
from math import sqrt
from random import Random
from typing import Any

import pytest

from stillroom.estimation.intervals import Z95
from stillroom.service.fleet import causes, rates
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.selecting import Asked
from stillroom.store import fleet
from stillroom.store.database import Database
from tests.fleets import START, Done, Fleet
from tests.service.fleet import recount
from tests.service.fleet.recount import Plain

METS = [("room_recall", "door_closed"), ("room_lost", "wall_gap"), ("connectivity", "door_closed"), None]
DAYS = 40
FIRST = START.date()


def mission(draw: Random) -> Done:
    outcome = draw.choice(["updated"] * 8 + ["resolved"] * 3 + ["needs_review"] * 2 + ["reverted", "parked"])
    failed = {"updated": 0, "resolved": draw.randint(1, 2), "parked": None}.get(outcome, draw.choice([0, 2, 3, 3]))
    crashed = outcome == "reverted" and draw.random() < 0.4
    return Done(
        robot=f"RB-{min(int(draw.expovariate(0.06)), 45)}",
        day=draw.randrange(DAYS),
        outcome=outcome if draw.random() < 0.95 else "superseded",
        failed=None if crashed else failed,
        firmware=draw.choice(["5.1", "5.2", "5.2", None]),
        model=draw.choice(["S9", "J7"]),
        algorithm=draw.choice(["1.0", "1.1"]),
        rooms=draw.choice([None, 2, 5, 5, 8, 12]),
        met=None if outcome == "updated" or crashed else draw.choice(METS),
        traceback="Traceback\n  ...\nValueError: of a home" if crashed else None,
    )


@pytest.fixture
def lived(database: Database) -> tuple[Database, list[Plain]]:
    """350 missions of some 40 robots, some of which run much oftener than others; every twelfth that was taken escaped."""
    draw, homes = Random(8), Fleet(database)
    homes.add(*[mission(draw) for _ in range(350)])
    while catch_up(database):
        pass
    taken = [one for one in recount.recount(database) if one.outcome in ("updated", "resolved")][::12]
    with database.write() as tx:
        fleet.hold(tx)
        for one in taken:
            fleet.escape(tx, one.id, one.at + timedelta(days=1))
    return database, recount.recount(database, {one.id for one in taken})


def selections() -> list[tuple[date, date, dict[str, Collection[str]]]]:
    def days(first: int, last: int, **values: Collection[str]) -> tuple[date, date, dict[str, Collection[str]]]:
        return FIRST + timedelta(days=first), FIRST + timedelta(days=last), values

    return [
        days(0, DAYS),
        days(3, 3),
        days(5, 19, firmware=("5.2", "")),
        days(0, DAYS, model=("J7",), size=("4-6", "10+")),
        days(9, 30, algorithm=("1.1",), firmware=("5.1",)),
        days(-90, -60),
    ]


def asked(first: date, last: date, values: dict[str, Collection[str]]) -> Asked:
    return Asked(first.isoformat(), last.isoformat(), **{name: tuple(of) for name, of in values.items()})


def test_rates_and_causes_and_robots_of_any_selection(lived: tuple[Database, list[Plain]]) -> None:
    database, everything = lived
    assert {one.escaped for one in everything} == {True, False}
    for first, last, values in selections():
        which, some = asked(first, last, values), recount.chosen(everything, first, last, **values)
        for by in recount.KEYS:
            found = rates.rates(database, which, by)  # type: ignore[arg-type]  # one of them
            assert {one.key: recount.told(one) for one in found.items} == recount.rows(some, by), by
        assert recount.told(found.total) == recount.row(some, some)
        by_cause = rates.rates(database, which, "cause").items
        assert {one.key: recount.told(one) for one in by_cause} == recount.rows_by_cause(some)
        check_causes(causes.causes(database, which, None, 1000), some, everything)
        check_robots(rates.robots(database, which, "-failure_rate", 1, 1000), some)


def check_causes(found: Any, some: list[Plain], everything: list[Plain]) -> None:
    failed = [one for one in some if one.cause is not None]
    assert found.missions == len(failed)
    groups: dict[Any, list[Plain]] = {}
    for one in failed:
        groups.setdefault(one.cause, []).append(one)
    assert len(found.items) == len(groups)
    for item in found.items:
        of = groups[item.kind, item.cause, item.stage, item.algorithm]
        seen = [one.at for one in everything if one.cause == of[0].cause]
        counts = {name: sum(one.outcome == name for one in of) for name in ("reverted", "needs_review", "parked")}
        assert {name: getattr(item, name) for name in counts} == counts
        assert (item.missions, item.settled) == (len(of), len(of) - sum(counts.values()))
        assert item.robots == len({one.robot for one in of})
        assert item.share == pytest.approx(len(of) / len(failed))
        assert (item.first_seen, item.last_seen) == (min(seen), max(seen))
        assert {point.day: point.missions for point in item.trend} == {
            day: sum(one.day == day for one in of) for day in {one.day for one in of}
        }


def check_robots(found: list[Any], some: list[Plain]) -> None:
    judged = [one for one in some if one.outcome != "parked"]
    assert {one.robot for one in found} == {one.robot for one in judged}
    for row in found:
        own = [one for one in judged if one.robot == row.robot]
        failed = sum(one.outcome in ("reverted", "needs_review") for one in own)
        assert (row.missions, row.failed, row.escapes) == (len(own), failed, sum(one.escaped for one in own))
    shares = [row.failure_rate for row in found]
    assert shares == sorted(shares, reverse=True)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_intervals_are_wilsons_at_the_effective_number_of_missions(lived: tuple[Database, list[Plain]]) -> None:
    """The design effect, plainly: variance of the share between robots over that of as many independent missions."""
    database, everything = lived
    total = rates.rates(database, asked(FIRST, FIRST + timedelta(days=DAYS), {}), None).total
    judged = [one for one in everything if one.outcome != "parked"]
    robots = {one.robot for one in judged}
    assert total.clustering["transfer"] == "measured"
    n, p = len(judged), sum("transfer" in one.failed for one in judged) / len(judged)
    spread = 0.0
    for robot in robots:
        own = [one for one in judged if one.robot == robot]
        spread += (sum("transfer" in one.failed for one in own) - p * len(own)) ** 2
    effect = max(1.0, len(robots) / (len(robots) - 1) * spread / (n * p * (1 - p)))
    assert total.design_effect.transfer == pytest.approx(effect, abs=0.001)
    m = n / effect
    middle, half = p + Z95**2 / (2 * m), Z95 * sqrt(p * (1 - p) / m + Z95**2 / (4 * m * m))
    scale = 1 + Z95**2 / m
    assert total.ci95.transfer == pytest.approx(((middle - half) / scale, (middle + half) / scale), abs=1e-5)
