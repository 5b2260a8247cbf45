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
    digits = np.frombuffer(tally.encode("ascii"), np.uint8).reshape(-1, WIDTH).astype(np.int64) - _FIRST
    return ((digits[:, 0] * 64 + digits[:, 1]) * 64 + digits[:, 2]) * 64 + digits[:, 3]


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
