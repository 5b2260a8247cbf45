"""McNemar's exact test."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillroom.estimation.pairs import Pairs, mcnemar


@pytest.mark.parametrize(
    ("only_old", "only_new", "p"), [(0, 0, 1.0), (1, 0, 1.0), (6, 0, 0.03125), (10, 2, 0.0385742), (5, 5, 1.0)]
)
def test_the_test_is_the_binomial_one(only_old: int, only_new: int, p: float) -> None:
    assert mcnemar(only_old, only_new) == pytest.approx(p, abs=1e-6)


@given(st.integers(0, 3000), st.integers(0, 3000))
def test_it_is_a_probability_whichever_way_is_called_old(first: int, second: int) -> None:
    assert 0 <= mcnemar(first, second) == mcnemar(second, first) <= 1
    assert Pairs(5, first, second, 7).p == mcnemar(first, second)
