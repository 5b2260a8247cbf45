"""The yardstick of rooms, on rooms small enough to count by hand."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.real.room_scores import Labels, best_pairs, drawn_rooms, matched, score


def strips(*widths: int) -> Labels:
    """Rooms side by side, 20 cells high and so many wide."""
    return np.repeat(np.arange(1, len(widths) + 1), widths)[None].repeat(20, 0)


def test_the_same_rooms_under_other_numbers_score_full() -> None:
    found = score(strips(10, 20, 30)[:, ::-1] * 7, strips(30, 20, 10))
    assert (found.recall, found.precision, found.iou, found.f1, found.both) == (100, 100, 100, 100, 100)


def test_one_room_for_two_has_full_recall_and_half_the_precision() -> None:
    found = score(strips(60), strips(30, 30))
    assert (found.recall, found.precision, found.iou) == (100, 50, 25)
    assert (found.f1, found.both) == (0, 0)


def test_two_rooms_for_one_have_full_precision_and_the_larger_one_is_the_match() -> None:
    found = score(strips(20, 40), strips(60))
    assert found.precision == 100
    assert found.recall == found.iou == pytest.approx(100 * 2 / 3)
    assert found.f1 == pytest.approx(100 * 2 / 3)
    assert matched(strips(20, 40), strips(60)) == (1, 1)


def test_rooms_of_a_hundred_cells_don_t_count() -> None:
    assert score(strips(5, 55), strips(60)).f1 == 100
    assert score(strips(60) * 0, strips(60)).recall == 0


def test_drawn_rooms_are_what_lines_leave_white() -> None:
    plan = np.full((20, 61), 255, np.uint8)
    plan[:, 30] = 200
    assert score(strips(30, 31), drawn_rooms(plan)).both == 100


@given(st.integers(0, 2**32), st.integers(1, 5), st.integers(1, 5))
def test_no_other_pairs_gain_more(seed: int, rows: int, columns: int) -> None:
    gain = np.random.default_rng(seed).integers(0, 5, (rows, columns)).astype(np.float64)
    i, j = best_pairs(gain)
    assert len(set(i.tolist())) == len(i)
    assert len(set(j.tolist())) == len(j)
    few, many = min(rows, columns), max(rows, columns)
    tall = gain if rows == few else gain.T
    most = max(sum(tall[k, place[k]] for k in range(few)) for place in permutations(range(many), few))
    assert gain[i, j].sum() == most
