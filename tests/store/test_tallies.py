"""Tallies: numbers of robots as text that can be joined."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillroom.store.tallies import MOST_ROBOTS, decode, encode, without

NUMBERS = st.lists(st.integers(0, MOST_ROBOTS), max_size=30)


@given(NUMBERS, NUMBERS)
def test_joined_tallies_are_the_tally_of_both(first: list[int], second: list[int]) -> None:
    assert decode(encode(first) + encode(second)).tolist() == first + second


@given(NUMBERS, st.integers(0, MOST_ROBOTS))
def test_one_mission_of_a_robot_can_be_taken_out(numbers: list[int], number: int) -> None:
    left = sorted(decode(without(encode([*numbers, number]), number)).tolist())
    assert left == sorted(numbers)
    assert without(encode([n for n in numbers if n != number]), number) == encode([n for n in numbers if n != number])


@pytest.mark.parametrize("number", [-1, MOST_ROBOTS + 1])
def test_a_number_that_does_not_fit_is_refused(number: int) -> None:
    with pytest.raises(ValueError, match="at most"):
        encode([number])
