"""A tally is a text: the number of a robot, in four characters, for each mission counted. Joined tallies are a tally."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

Robots = npt.NDArray[np.int64]

WIDTH = 4
MOST_ROBOTS = 64**WIDTH - 1
_FIRST = ord("0")


def encode(numbers: Iterable[int]) -> str:
    """Raises ValueError for a number that does not fit."""
    return "".join(map(_code, numbers))


def decode(tally: str) -> Robots:
    # all four digits of a number at once: a dashboard decodes a million of them for one answer
    digits = np.frombuffer(tally.encode("ascii"), ">u4").astype(np.uint32) - np.uint32(_FIRST * 0x01010101)
    high = (digits >> 6 & 0xFC0000) | (digits >> 4 & 0x3F000)
    return (high | (digits >> 2 & 0xFC0) | (digits & 0x3F)).astype(np.int64)


def without(tally: str, number: int) -> str:
    """With one mission of that robot less, if it has one."""
    gone = _code(number)
    codes = [tally[at : at + WIDTH] for at in range(0, len(tally), WIDTH)]
    if gone in codes:
        codes.remove(gone)
    return "".join(codes)


def _code(number: int) -> str:
    if not 0 <= number <= MOST_ROBOTS:
        raise ValueError(f"a fleet has at most {MOST_ROBOTS} robots")
    return "".join(chr(_FIRST + (number >> shift & 63)) for shift in (18, 12, 6, 0))
