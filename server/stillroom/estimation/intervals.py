"""Intervals of shares whose observations come in clusters: missions of one robot are alike, so they say less than as many robots would.

Wilson's interval is taken at the effective number of observations, n / design effect (Kish 1965; Korn and Graubard 1998). The
design effect is measured from how failures gather in clusters (linearised variance against that of independent observations).
Where too little is there to measure it, it follows from the correlation within clusters of a larger selection, and where that
can't be measured either, from an assumed one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Z95 = 1.959963984540054
LEAST_CLUSTERS = 30
LEAST_EVENTS = 5
"""With fewer clusters, or fewer observations of either kind, a design effect is not measured."""
ASSUMED_CORRELATION = 0.2
"""Within a cluster, where nothing is known: twice what simulated and real homes show."""
RESAMPLES = 1000
MOST_DRAWS = 30_000_000
"""Clusters times resamples of one answer: some seconds."""

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Clustering = Literal["measured", "selection", "assumed"]
CLUSTERINGS: tuple[Clustering, ...] = ("measured", "selection", "assumed")


@dataclass(frozen=True, eq=False)
class Clustered:
    """Sums over the clusters of each of several groups; every array has one entry a group."""

    observations: Integers
    """n."""
    clusters: Integers
    """How many have at least one observation."""
    squares: Floats
    """Of each cluster's number of observations, summed."""
    events: Integers
    """y."""
    event_squares: Floats
    """Of each cluster's number of events, summed."""
    products: Floats
    """Of each cluster's events and observations, summed."""

    @property
    def share(self) -> Floats:
        return self.events / np.maximum(self.observations, 1)

    @property
    def weight(self) -> Floats:
        """Observations that an average observation's cluster has."""
        return self.squares / np.maximum(self.observations, 1)

    @property
    def is_measurable(self) -> npt.NDArray[np.bool_]:
        fewest = np.minimum(self.events, self.observations - self.events)
        return np.asarray((self.clusters >= LEAST_CLUSTERS) & (fewest >= LEAST_EVENTS))

    def measured_effect(self) -> Floats:
        """Variance of the share over that of independent observations; meaningless where it is not measurable."""
        n, p, k = np.maximum(self.observations, 1), self.share, np.maximum(self.clusters, 2)
        spread = self.event_squares - 2 * p * self.products + p * p * self.squares
        independent = np.maximum(p * (1 - p), 1e-12)
        return np.asarray(k / (k - 1) * spread / (n * independent))


@dataclass(frozen=True, eq=False)
class Intervals:
    low: Floats
    high: Floats
    effect: Floats
    """Design effect, at least 1."""
    clustering: npt.NDArray[np.int8]
    """How it was come by: index into `CLUSTERINGS`."""


def wilson(events: Floats, observations: Floats, z: float = Z95) -> tuple[Floats, Floats]:
    """Wilson's interval (1927), of 95 %; 0 to 1 where nothing was observed. Both may be effective numbers, not whole ones."""
    n = np.maximum(observations, 1e-9)
    p = events / n
    centre = p + z**2 / (2 * n)
    half = z * np.sqrt(np.maximum(p * (1 - p), 0) / n + z**2 / (4 * n * n))
    scale = 1 + z**2 / n
    seen = observations > 0
    low, high = np.where(seen, (centre - half) / scale, 0.0), np.where(seen, (centre + half) / scale, 1.0)
    # the ends where nothing or all failed are exact; rounding must not put the share outside of its own interval
    return np.where(events <= 0, 0.0, np.clip(low, 0, 1)), np.where(seen & (p >= 1), 1.0, np.clip(high, 0, 1))


def correlation(selection: Clustered) -> float | None:
    """Within clusters, of a selection of one group; None where it can't be measured."""
    if not selection.is_measurable[0] or selection.weight[0] < 1.05:
        return None
    excess = (selection.measured_effect()[0] - 1) / (selection.weight[0] - 1)
    return float(np.clip(excess, 0, 1))


def intervals(groups: Clustered, selection: Clustered, z: float = Z95) -> Intervals:
    """The intervals, of 95 %, of the share in each group. `selection`: all groups as one, of one entry."""
    known = correlation(selection)
    within = ASSUMED_CORRELATION if known is None else known
    modelled = 1 + np.maximum(groups.weight - 1, 0) * within
    measurable = groups.is_measurable
    effect = np.maximum(np.where(measurable, groups.measured_effect(), modelled), 1)
    n = groups.observations / effect
    low, high = wilson(groups.share * n, n, z)
    how = np.where(measurable, 0, 2 if known is None else 1).astype(np.int8)
    return Intervals(low, high, effect, how)


def bootstrap(events: Integers, observations: Integers, seed: int = 0) -> tuple[Floats, Floats]:
    """95 % percentile interval of each share when whole clusters are drawn anew.

    `observations` has shape (clusters,), `events` (measures, clusters); the answers (measures,). The same numbers come to the
    same interval every time. Raises ValueError without a cluster.
    """
    clusters = len(observations)
    if clusters == 0:
        raise ValueError("no cluster to draw from")
    draw = np.random.default_rng(seed)
    stacked = np.vstack([events, observations[None, :]]).astype(np.float64)
    shares = []
    at_once = max(1, 2_000_000 // clusters)
    for first in range(0, RESAMPLES, at_once):
        count = min(at_once, RESAMPLES - first)
        weights = draw.multinomial(clusters, np.full(clusters, 1 / clusters), size=count)
        sums = weights @ stacked.T
        shares.append(sums[:, :-1] / np.maximum(sums[:, -1:], 1))
    low, high = np.quantile(np.concatenate(shares), [0.025, 0.975], axis=0)
    return low, high


def clustered(counts: Sequence[int], events: Sequence[int]) -> Clustered:
    """One group from each cluster's number of observations and of events."""
    n, y = np.asarray(counts, np.int64), np.asarray(events, np.int64)
    return Clustered(
        observations=np.array([n.sum()]),
        clusters=np.array([(n > 0).sum()]),
        squares=np.array([(n * n).sum()], np.float64),
        events=np.array([y.sum()]),
        event_squares=np.array([(y * y).sum()], np.float64),
        products=np.array([(y * n).sum()], np.float64),
    )
