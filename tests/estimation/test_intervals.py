"""Intervals of shares: they cover the truth as often as they say, whether or not missions of one robot are alike."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillroom.estimation.intervals import (
    ASSUMED_CORRELATION,
    CLUSTERINGS,
    Clustered,
    bootstrap,
    clustered,
    correlation,
    intervals,
    wilson,
)


def only(of: Clustered, selection: Clustered | None = None) -> tuple[float, float, float, str]:
    found = intervals(of, of if selection is None else selection)
    return found.low[0], found.high[0], found.effect[0], CLUSTERINGS[found.clustering[0]]


@pytest.mark.parametrize(
    ("events", "of", "low", "high"),
    [  # Wilson 1927; the journeys' own numbers among them
        (4, 300, 0.0052, 0.0338),
        (7, 300, 0.0113, 0.0474),
        (0, 10, 0.0, 0.2775),
        (10, 10, 0.7225, 1.0),
        (1, 2, 0.0945, 0.9055),
        (0, 0, 0.0, 1.0),
    ],
)
def test_wilsons_interval_is_the_published_one(events: int, of: int, low: float, high: float) -> None:
    found = wilson(np.array([float(events)]), np.array([float(of)]))
    assert [found[0][0], found[1][0]] == pytest.approx([low, high], abs=1e-4)


@given(st.integers(0, 500), st.integers(0, 500))
def test_the_share_is_always_within_its_interval(first: int, second: int) -> None:
    events, of = min(first, second), max(first, second, 1)
    low, high = wilson(np.array([float(events)]), np.array([float(of)]))
    assert 0 <= low[0] <= events / of <= high[0] <= 1


def test_a_mission_each_of_many_robots_has_no_design_effect() -> None:
    events = [1] * 40 + [0] * 360
    low, high, effect, how = only(clustered([1] * 400, events))
    assert how == "measured"
    assert effect == pytest.approx(1.0, abs=0.01)
    plain = wilson(np.array([40.0]), np.array([400.0]))
    assert [low, high] == pytest.approx([plain[0][0], plain[1][0]], abs=1e-3)


def test_robots_that_fail_always_or_never_count_as_one_mission_each() -> None:
    _, _, effect, how = only(clustered([10] * 100, [10] * 20 + [0] * 80))
    assert how == "measured"
    assert effect == pytest.approx(10, rel=0.02)


def test_a_few_robots_are_judged_by_the_correlation_of_the_selection() -> None:
    whole = clustered([10] * 100, [10] * 10 + [0] * 70 + [5] * 20)
    known = correlation(whole)
    assert known is not None
    _, _, effect, how = only(clustered([10] * 5, [3, 0, 0, 0, 0]), whole)
    assert how == "selection"
    assert effect == pytest.approx(1 + 9 * known)


def test_where_nothing_is_known_a_correlation_is_assumed() -> None:
    low, high, effect, how = only(clustered([20], [2]))
    assert how == "assumed"
    assert effect == pytest.approx(1 + 19 * ASSUMED_CORRELATION)
    plain = wilson(np.array([2.0]), np.array([20.0]))
    assert low < plain[0][0]
    assert high > plain[1][0]


@pytest.mark.parametrize("spread", [0.5, 2.0, 50.0])
def test_the_interval_covers_the_truth_where_robots_differ(spread: float) -> None:
    """Robots' own failure rates are spread around 8 %; `spread` is how much they have in common."""
    draw, truth, covered, naive = np.random.default_rng(1), 0.08, 0, 0
    fleets = 400
    for _ in range(fleets):
        own = draw.beta(truth * spread, (1 - truth) * spread, size=200)
        counts = 1 + draw.poisson(8, size=200)
        events = draw.binomial(counts, own)
        low, high, _, _ = only(clustered(counts.tolist(), events.tolist()))
        covered += low <= truth <= high
        plain = wilson(np.array([float(events.sum())]), np.array([float(counts.sum())]))
        naive += bool(plain[0][0] <= truth <= plain[1][0])
    assert covered / fleets > 0.92
    if spread == 0.5:
        assert naive / fleets < 0.8  # what ignoring robots would come to


def test_drawing_robots_anew_comes_to_about_the_same_interval() -> None:
    draw = np.random.default_rng(2)
    counts = 1 + draw.poisson(8, size=500)
    events = draw.binomial(counts, draw.beta(0.2, 1.8, size=500))
    low, high = bootstrap(events[None, :], counts)
    wanted = only(clustered(counts.tolist(), events.tolist()))
    assert [low[0], high[0]] == pytest.approx(wanted[:2], abs=0.008)
    again = bootstrap(events[None, :], counts)
    assert (low[0], high[0]) == (again[0][0], again[1][0])
    with pytest.raises(ValueError, match="no cluster"):
        bootstrap(np.zeros((1, 0), np.int64), np.zeros(0, np.int64))
