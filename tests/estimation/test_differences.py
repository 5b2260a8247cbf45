"""Differences of shares: the published example, exact tests, and that looking again and again deceives nobody."""

from itertools import count

import numpy as np
import numpy.typing as npt
import pytest

from stillroom.estimation.differences import critical, difference, fisher
from stillroom.estimation.intervals import Clustered, Integers, clustered


def independent(events: int, of: int) -> Clustered:
    return clustered([1] * of, [1] * events + [0] * (of - events))


def test_newcombes_example_has_his_interval() -> None:
    found = difference(independent(56, 70), independent(48, 80))  # Newcombe 1998, example a, method 10
    # a little wider than his: the design effect of clusters of one is n / (n - 1)
    assert [found.low, found.high] == pytest.approx([0.0524, 0.3339], abs=0.0015)


def test_seven_failures_against_four_of_300_say_nothing_yet() -> None:
    found = difference(independent(7, 300), independent(4, 300))
    assert (round(found.old.low, 3), round(found.old.high, 3)) == (0.005, 0.034)
    assert (round(found.new.low, 3), round(found.new.high, 3)) == (0.011, 0.047)
    assert fisher((7, 300), (4, 300)) == pytest.approx(0.5454, abs=1e-3)
    assert found.verdict(0.01) == "inconclusive"
    more = found.more(0.02)
    assert more is not None
    assert 200 < more < 2000
    times = (300 + more) // 300 + 1
    assert (
        difference(independent(7 * times, 300 * times), independent(4 * times, 300 * times)).verdict(0.02) == "passed"
    )


@pytest.mark.parametrize(
    ("first", "second", "p"),
    [((3, 4), (1, 4), 0.4857), ((0, 10), (10, 10), 0.0), ((5, 10), (5, 10), 1.0), ((0, 0), (0, 5), 1.0)],
)
def test_fishers_test_is_exact(first: tuple[int, int], second: tuple[int, int], p: float) -> None:
    assert fisher(first, second) == pytest.approx(p, abs=1e-4)


def test_a_difference_is_failed_or_passed_only_where_all_of_its_interval_is_beyond_the_margin() -> None:
    much, little = (
        difference(independent(90, 300), independent(30, 300)),
        difference(independent(3, 3000), independent(3, 3000)),
    )
    assert (much.verdict(0.05), much.verdict(0.2), much.verdict(0.4)) == ("failed", "inconclusive", "passed")
    assert (little.verdict(0.01), little.more(0.01)) == ("passed", 0)
    nothing = difference(independent(0, 0), independent(0, 0))
    assert (nothing.verdict(0.5), nothing.more(0.5)) == ("inconclusive", None)


def test_each_look_has_its_part_of_the_error_and_all_together_no_more_than_there_is() -> None:
    values = [critical(look, 2) for look in range(1, 30)]
    assert values == sorted(values)
    assert critical(1, 1) == pytest.approx(2.2414, abs=1e-4)
    parts = sum(1 / (k * (k + 1)) for k in range(1, 10_000))
    assert parts < 1


def arm(missions: Integers, failed: Integers, of: npt.NDArray[np.bool_]) -> Clustered:
    return clustered(missions[of].tolist(), failed[of].tolist())


def rollout(draw: np.random.Generator, worse: float) -> str:
    """One stage, looked at whenever its missions have doubled; homes differ, and each has several missions."""
    homes = 4000
    chance = draw.beta(0.06 * 8, 0.94 * 8, size=homes)
    new = draw.random(homes) < 0.25
    chance = np.where(new, np.minimum(chance + worse, 1), chance)
    missions, failed = np.zeros(homes, np.int64), np.zeros(homes, np.int64)
    for look in count(1):
        while missions[new].sum() < 200 * 2 ** (look - 1):
            who = draw.integers(homes, size=400)
            np.add.at(missions, who, 1)
            np.add.at(failed, who, draw.random(400) < chance[who])
        z = critical(look, 1)
        found = difference(arm(missions, failed, new), arm(missions, failed, ~new), z)
        verdict = found.verdict(0.02)
        if verdict != "inconclusive" or look == 6:
            return verdict
    raise AssertionError


def test_what_changes_nothing_is_hardly_ever_halted_and_what_harms_hardly_ever_passes() -> None:
    draw = np.random.default_rng(3)
    at_the_margin = [rollout(draw, 0.02) for _ in range(150)]
    assert at_the_margin.count("failed") <= 8  # 2.5 of 100 may be, and chance is given its due
    assert at_the_margin.count("passed") <= 8
    assert [rollout(draw, 0.12) for _ in range(20)].count("failed") == 20
    assert [rollout(draw, -0.01) for _ in range(20)].count("passed") >= 18
