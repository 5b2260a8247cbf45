"""From tallies to shares with their intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from stillroom.estimation.intervals import CLUSTERINGS, Clustered, Clustering, Floats, Integers, bootstrap, intervals
from stillroom.store.fleet import MEASURES
from stillroom.store.fleet_figures import Group
from stillroom.store.tallies import Robots, decode

CELLS = 4_000_000
"""Groups times robots of one matrix."""


@dataclass(frozen=True)
class Share:
    count: int
    of: int
    low: float
    high: float
    effect: float
    clustering: Clustering

    @property
    def value(self) -> float | None:
        return self.count / self.of if self.of else None


@dataclass(frozen=True)
class Figures:
    key: str
    missions: int
    robots: int
    shares: Mapping[str, Share]
    """By measure."""


@dataclass(frozen=True, eq=False)
class _Decoded:
    """All groups' tallies on end, and which group each entry is of."""

    robots: Robots
    groups: Integers


def figures(groups: Sequence[Group], whole: Group, same_missions: bool = False) -> tuple[list[Figures], Figures]:
    """Those of each group, and those of the whole selection, which the groups share out among themselves.

    `same_missions`: each group is of all missions; what differs is how they failed.
    """
    names = ("missions", *MEASURES)
    decoded = {name: _decoded(groups, name) for name in names}
    if same_missions:
        every = {name: _decoded([whole], name) for name in names}
        decoded["missions"] = every["missions"]
    else:
        every = {name: _Decoded(of.robots, np.zeros_like(of.groups)) for name, of in decoded.items()}
    robots = 1 + max((int(of.robots.max()) for of in every.values() if len(of.robots)), default=0)
    total = _sums(every, 1, robots, False)
    found = _figures(groups, _sums(decoded, len(groups), robots, same_missions), total) if groups else []
    return found, _figures([whole], total, total)[0]


def resampled(group: Group) -> dict[str, tuple[float, float]]:
    """The interval of each measure's share when whole robots are drawn anew; none where there is nothing to draw from."""
    missions, parked = decode(group.tallies["missions"]), decode(group.tallies["parked"])
    found: dict[str, tuple[float, float]] = {}
    for names, observed in ((_JUDGED, missions), (("parked",), np.concatenate([missions, parked]))):
        if not len(observed):
            continue
        known, where = np.unique(observed, return_inverse=True)
        n = np.bincount(where, minlength=len(known))
        events = np.stack(
            [np.bincount(np.searchsorted(known, decode(group.tallies[m])), minlength=len(known)) for m in names]
        )
        low, high = bootstrap(events, n)
        found |= {name: (float(low[i]), float(high[i])) for i, name in enumerate(names)}
    return found


def clusters(group: Group) -> int:
    """How many robots there are to draw from."""
    return len(np.unique(decode(group.tallies["missions"] + group.tallies["parked"])))


_JUDGED = tuple(name for name in MEASURES if name != "parked")


def _decoded(groups: Sequence[Group], name: str) -> _Decoded:
    texts = [group.tallies.get(name, "") for group in groups]
    robots = decode("".join(texts))
    lengths = np.array([len(text) for text in texts], np.int64) // 4
    return _Decoded(robots, np.repeat(np.arange(len(texts)), lengths))


def _sums(decoded: Mapping[str, _Decoded], groups: int, robots: int, same: bool) -> dict[str, Clustered]:
    """By measure. A few groups at a time, each a row of a matrix that has a column for each robot."""
    rows = max(1, CELLS // robots)
    parts: dict[str, list[Clustered]] = {name: [] for name in MEASURES}
    shared = _matrix(decoded["missions"], 0, 1, robots) if same else None
    for first in range(0, groups, rows):
        last = min(first + rows, groups)
        missions = _matrix(decoded["missions"], first, last, robots) if shared is None else shared
        judged = _Base(missions, last - first)
        for name in MEASURES:
            events = _part(decoded[name], first, last)
            parts[name].append(_clustered(judged, events, robots, joined=name == "parked"))
    return {name: _joined(part) for name, part in parts.items()}


class _Base:
    """How many missions each robot has in each group: a matrix, of one row where all groups have the same."""

    def __init__(self, matrix: npt.NDArray[np.int64], groups: int) -> None:
        self._matrix, self.groups = matrix, groups
        self.shared = len(matrix) == 1
        self.observations = self._each(matrix.sum(1))
        self.clusters = self._each(np.count_nonzero(matrix, axis=1))
        self.squares = self._each(np.einsum("ij,ij->i", matrix, matrix))

    def at(self, groups: Integers, robots: Integers) -> Integers:
        """How many missions these robots have in these groups."""
        return np.asarray(self._matrix[np.zeros_like(groups) if self.shared else groups, robots])

    def _each(self, values: Integers) -> Integers:
        return np.broadcast_to(values, (self.groups,)) if self.shared else values


def _clustered(base: _Base, events: _Decoded, robots: int, joined: bool) -> Clustered:
    """`joined`: the events are no part of the missions of `base`, but observations beside them."""
    keys, counts = np.unique(events.groups * robots + events.robots, return_counts=True)
    groups = keys // robots
    before = base.at(groups, keys % robots)

    def each(values: Integers) -> Floats:
        return np.asarray(np.bincount(groups, weights=values, minlength=base.groups), np.float64)

    more = counts if joined else np.zeros_like(counts)
    return Clustered(
        observations=base.observations + each(more).astype(np.int64),
        clusters=base.clusters + (each(before == 0).astype(np.int64) if joined else 0),
        squares=base.squares + each(2 * before * more + more * more),
        events=each(counts).astype(np.int64),
        event_squares=each(counts * counts),
        products=each(counts * (before + more)),
    )


def _part(of: _Decoded, first: int, last: int) -> _Decoded:
    within = slice(*np.searchsorted(of.groups, [first, last]))
    return _Decoded(of.robots[within], of.groups[within] - first)


def _matrix(of: _Decoded, first: int, last: int, robots: int) -> npt.NDArray[np.int64]:
    part = _part(of, first, last)
    cells = np.bincount(part.groups * robots + part.robots, minlength=(last - first) * robots)
    return cells.reshape(last - first, robots)


def _joined(parts: Sequence[Clustered]) -> Clustered:
    if len(parts) == 1:
        return parts[0]
    return Clustered(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


def _figures(groups: Sequence[Group], sums: Mapping[str, Clustered], total: Mapping[str, Clustered]) -> list[Figures]:
    shares: dict[str, list[Share]] = {name: _shares(sums[name], total[name]) for name in MEASURES}
    missions, robots = sums["transfer"].observations.tolist(), sums["parked"].clusters.tolist()
    return [
        Figures(group.key, missions[i], robots[i], {name: shares[name][i] for name in MEASURES})
        for i, group in enumerate(groups)
    ]


def _shares(groups: Clustered, total: Clustered) -> list[Share]:
    found = intervals(groups, total)
    columns: tuple[Floats | Integers, ...] = (groups.events, groups.observations, found.low, found.high, found.effect)
    named = [CLUSTERINGS[how] for how in found.clustering.tolist()]
    return list(map(Share, *(column.tolist() for column in columns), named))
