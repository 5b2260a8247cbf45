"""The fleet's figures are those that a plain recomputation comes to, whatever happened in which order."""

from datetime import date, timedelta

import pytest
import sqlalchemy as sa
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stillroom.documents.fleet import GroupBy, RateRow
from stillroom.errors import InvalidInput
from stillroom.service.fleet import counting, figures, rates
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.selecting import Asked
from stillroom.store import fleet, fleet_figures
from stillroom.store.database import Database
from stillroom.store.fleet_tables import counted, fleet_day, fleet_robot
from stillroom.store.tables import conflict, map_, mission, sighting
from tests.conftest import empty
from tests.fleets import START, Done, Fleet, counts_of, plainly, size_of

ALL = Asked("2026-11-01", "2026-11-30")
MISSIONS = st.builds(
    Done,
    robot=st.sampled_from(["RB-1", "RB-2", "RB-3"]),
    day=st.integers(0, 20),
    outcome=st.sampled_from(["updated", "resolved", "needs_review", "reverted", "parked", "superseded"]),
    failed=st.integers(0, 3),
    firmware=st.sampled_from(["5.1", "5.2", None]),
    model=st.sampled_from(["S9", "J7"]),
    algorithm=st.sampled_from(["1.0", "1.1"]),
    rooms=st.sampled_from([None, 2, 5, 8, 40]),
)


def rows(database: Database, by: GroupBy | None, asked: Asked = ALL) -> list[RateRow]:
    return rates.rates(database, asked, by).items


@pytest.fixture
def homes(database: Database) -> Fleet:
    return Fleet(database)


@given(done=st.lists(MISSIONS, max_size=20), batch=st.integers(1, 7))
@settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
def test_the_figures_equal_a_plain_recomputation(
    database: Database, database_url: str, done: list[Done], batch: int
) -> None:
    empty_database(database, database_url)
    homes = Fleet(database)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(counting, "BATCH", batch)
        for first in range(0, len(done), 10):
            homes.add(*done[first : first + 10])
            catch_up(database, batches=1 + batch % 3)
        while catch_up(database):
            pass
    assert counts_of(rows(database, "day")) == plainly(done, lambda one: one.at.date().isoformat())
    assert counts_of(rows(database, "week")) == plainly(done, lambda one: monday(one.at.date()))
    assert counts_of(rows(database, "firmware")) == plainly(done, lambda one: one.firmware or "")
    assert counts_of(rows(database, "size")) == plainly(done, size_of)
    chosen = [one for one in done if one.model == "J7" and one.algorithm == "1.1" and one.day < 10]
    some = Asked("2026-11-01", "2026-11-10", model=("J7",), algorithm=("1.1",))
    assert counts_of(rows(database, "algorithm", some)) == plainly(chosen, lambda one: one.algorithm)


def empty_database(database: Database, url: str) -> None:
    if database.is_postgresql:
        empty(url)
        return
    with database.write() as tx:
        for table in reversed(mission.metadata.sorted_tables):
            tx.execute(sa.delete(table))


def monday(day: date) -> str:
    return (day - timedelta(days=day.weekday())).isoformat()


def test_each_mission_is_counted_once_however_often_it_is_looked_for(homes: Fleet) -> None:
    homes.add(Done(), Done(outcome="reverted", failed=3))
    for _ in range(3):
        catch_up(homes.database)
    (row,) = rows(homes.database, None)
    assert (row.missions, row.robots, row.reverted) == (2, 1, 1)


def test_first_late_and_placed_missions_do_not_count(homes: Fleet) -> None:
    homes.add(
        Done(),
        Done(outcome="created", failed=None, rooms=None),
        Done(outcome="reverted", failed=None, rooms=None),
        Done(outcome="superseded", failed=None),
        Done(placed=True),
    )
    (row,) = rows(homes.database, None)
    assert row.missions == 1


def test_a_mission_that_could_not_be_processed_failed_with_everything(homes: Fleet) -> None:
    homes.add(Done(outcome="reverted", failed=None, traceback="Traceback\nValueError: x"))
    (row,) = rows(homes.database, None)
    assert row.failed.model_dump() == {"transfer": 1, "meta_occupancy": 1, "meta_dividers": 1}


def test_parked_missions_are_no_part_of_the_results_table(homes: Fleet) -> None:
    homes.add(*[Done()] * 3, Done(outcome="parked", failed=None))
    (row,) = rows(homes.database, None)
    assert (row.missions, row.parked, row.rates.parked, row.rates.transfer) == (3, 1, 0.25, 0.0)


def test_few_missions_have_an_interval_but_are_not_sufficient_for_a_point(homes: Fleet) -> None:
    homes.add(*[Done(robot=f"RB-{n}", outcome="reverted", failed=3) for n in range(rates.MINIMUM_N - 1)])
    (row,) = rows(homes.database, None)
    assert not row.sufficient
    assert row.ci95.reverted[0] > 0.5
    homes.add(Done(robot="RB-99"))
    (row,) = rows(homes.database, None)
    assert row.sufficient


def test_without_missions_there_are_no_rows_and_nothing_is_known(homes: Fleet) -> None:
    found = rates.rates(homes.database, ALL, "day")
    assert found.items == []
    assert (found.total.missions, found.total.rates.transfer, found.total.ci95.transfer) == (0, None, (0.0, 1.0))
    assert rates.rates(homes.database, ALL, "cause").items == []
    assert rates.rates(homes.database, ALL, None, "bootstrap").total.ci95.transfer == (0.0, 1.0)
    assert rates.robots(homes.database, ALL, "-failure_rate", 1, 10) == []


def test_the_robots_own_clock_does_not_matter(homes: Fleet) -> None:
    homes.add(Done(day=3))  # its robot says that it ended in 1999
    assert [row.key for row in rows(homes.database, "day")] == ["2026-11-04"]


def test_by_cause_each_row_says_how_many_of_all_missions_failed_by_it(homes: Fleet) -> None:
    homes.add(
        *[Done(robot=f"RB-{n}") for n in range(6)],
        *[Done(robot=f"RB-{n}", outcome="resolved", failed=1, met=("room_recall", "wall_gap")) for n in range(2)],
        Done(robot="RB-3", outcome="needs_review", failed=3, met=("room_lost", "door_closed")),
        Done(robot="RB-4", outcome="parked", failed=None, met=("wrong_map", "unknown")),
    )
    found = {row.key: row for row in rows(homes.database, "cause")}
    assert {key: row.missions for key, row in found.items()} == {"wall_gap": 9, "door_closed": 9, "unknown": 9}
    assert found["wall_gap"].failed.model_dump() == {"transfer": 2, "meta_occupancy": 0, "meta_dividers": 0}
    assert found["door_closed"].failed.model_dump() == {"transfer": 1, "meta_occupancy": 1, "meta_dividers": 1}
    assert (found["door_closed"].needs_review, found["unknown"].parked) == (1, 1)
    total = rates.rates(homes.database, ALL, "cause").total
    assert (total.missions, total.failed.transfer, total.parked) == (9, 3, 1)


def test_the_intervals_of_many_groups_are_those_of_each_alone(homes: Fleet, monkeypatch: pytest.MonkeyPatch) -> None:
    homes.add(*[Done(f"RB-{n % 37}", n % 4, ("updated", "needs_review")[n % 3 == 0], n % 5 % 4) for n in range(400)])
    at_once = rates.rates(homes.database, ALL, "day")
    monkeypatch.setattr(figures, "CELLS", 1)  # each group in a matrix of its own
    assert rates.rates(homes.database, ALL, "day") == at_once
    assert {row.clustering["transfer"] for row in at_once.items} == {"measured"}
    for row in at_once.items:
        alone = rates.rates(homes.database, Asked(row.key, row.key), None).total
        assert alone.model_copy(update={"key": row.key}) == row


def test_drawing_robots_anew_is_refused_where_it_would_take_too_long(
    homes: Fleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    homes.add(*[Done(f"RB-{n % 37}", n % 4, failed=n % 5 % 4) for n in range(200)])
    drawn = rates.rates(homes.database, ALL, "day", "bootstrap")
    plain = rates.rates(homes.database, ALL, "day")
    assert drawn.total.clustering["transfer"] == "resampled"
    (low, high), wider = drawn.total.ci95.transfer, plain.total.ci95.transfer
    assert wider[0] <= low < 0.6 < high <= wider[1]  # robots of this fleet are more alike than if they failed at random
    monkeypatch.setattr(rates, "MOST_DRAWS", 100_000)
    with pytest.raises(InvalidInput, match="fewer groups"):
        rates.rates(homes.database, ALL, "day", "bootstrap")


def test_what_is_left_of_a_home_that_was_deleted_are_its_counts(homes: Fleet) -> None:
    homes.add(Done("RB-1", outcome="reverted", failed=3, met=("room_lost", "unknown")), Done("RB-2"))
    before = rows(homes.database, "day")
    with homes.database.write() as tx:
        gone = sa.select(map_.c.id).where(map_.c.robot_id == "RB-1")
        missions = sa.select(mission.c.id).where(mission.c.map_id.in_(gone))
        tx.execute(sa.delete(counted).where(counted.c.mission_id.in_(missions)))
        tx.execute(sa.delete(sighting).where(sighting.c.mission_id.in_(missions)))
        tx.execute(sa.delete(conflict).where(conflict.c.map_id.in_(gone)))
        tx.execute(sa.delete(mission).where(mission.c.map_id.in_(gone)))
        tx.execute(sa.delete(fleet_robot).where(fleet_robot.c.robot_id == "RB-1"))
    assert rows(homes.database, "day") == before
    assert [row.robot for row in rates.robots(homes.database, ALL, "-failure_rate", 1, 10)] == ["RB-2"]
    homes.add(Done("RB-3"))  # is given a number of its own
    (row,) = rows(homes.database, None)
    assert (row.missions, row.robots) == (3, 3)


def test_the_worst_robots_are_those_that_fail_most_or_most_surely(homes: Fleet) -> None:
    homes.add(
        Done("once", outcome="reverted", failed=3),
        *[Done("often", outcome="needs_review", failed=3)] * 8,
        *[Done("often")] * 2,
        *[Done("never")] * 20,
    )
    assert [row.robot for row in rates.robots(homes.database, ALL, "-failure_rate", 1, 10)] == [
        "once",
        "often",
        "never",
    ]
    surely = rates.robots(homes.database, ALL, "-lower_bound", 1, 10)
    assert [row.robot for row in surely] == ["often", "once", "never"]
    assert (surely[0].missions, surely[0].failed, surely[0].failure_rate) == (10, 8, 0.8)
    assert [row.robot for row in rates.robots(homes.database, ALL, "-missions", 10, 1)] == ["never"]


def test_a_mission_that_is_taken_out_again_leaves_no_trace_in_the_figures(homes: Fleet) -> None:
    homes.add(Done(), Done(outcome="needs_review", failed=2, met=("shape", "unknown")))
    catch_up(homes.database)
    with homes.database.write() as tx:
        fleet.escape(tx, homes.ids[0], START)
        fleet.hold(tx)
        for made in homes.ids:
            fleet.uncount(tx, made)
        left = tx.execute(sa.select(fleet_day)).one()._mapping
        assert {left[name] for name in fleet_figures.TALLIES} == {""}
        selection = fleet_figures.Selection(START.date(), START.date())
        assert fleet_figures.failures(tx, selection) == []


def test_an_escape_counts_once(homes: Fleet) -> None:
    homes.add(Done(), Done())
    catch_up(homes.database)
    with homes.database.write() as tx:
        for _ in range(2):
            fleet.escape(tx, homes.ids[0], START)
        fleet.escape(tx, 999, START)  # its home was deleted meanwhile
    (row,) = rows(homes.database, None)
    assert (row.escapes, row.rates.escapes) == (1, 0.5)
