"""One abstraction for every kind of tracking: a map of points from one version's frame to a mission's frame."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose, as_numbers, as_points, distinct

EXACT_M = 1e-6
"""Two coordinates nearer than this are the same vertex."""
BLEND_M = 0.25
"""Below this distance from a control point all points move with it alike."""
CONSENSUS_ROUNDS = 3
MOST_PAIRS = 4_000_000
"""Of points and control points looked at together: buildings have tens of thousands of both."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Piecewise rigid: control points that were tracked move exactly, everything else with the rigid motion of what is near it.

    `source`, `target`: (n, 2), metres. Points between are moved by the weighted rigid fit of all control points
    (moving least squares, Schaefer, McPhail, Warren 2006). Without control points, the identity.
    """

    source: Points
    target: Points

    @staticmethod
    def rigid(pose: Pose) -> "Motion":
        """One rigid motion for everything."""
        source = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        return Motion(source, pose.apply(source))

    @staticmethod
    def through(source: Points, target: Points) -> "Motion":
        """From tracked points (n, 2); a vertex that was tracked more than once takes the mean."""
        _, first, group = distinct(np.round(source / EXACT_M))
        count = np.bincount(group, minlength=len(first))
        mean = np.stack([np.bincount(group, target[:, k], len(first)) / count for k in (0, 1)], 1)
        return Motion(source.take(first, 0), mean)

    def apply(self, points: Points) -> Points:
        """Points (n, 2) of the source frame in the target frame."""
        points = as_points(points)
        if not len(points) or not len(self.source):
            return points.copy()
        known, where = _same(points, self.source)
        moved = np.empty_like(points)
        moved[known] = self.target.take(where[known], 0)
        if not known.all():
            # equal points must stay equal, or rings would not close
            others, _, where_again = distinct(points[~known])
            fitted = _fitted(others, self.source, self.target, BLEND_M, np.ones(len(self.source)))
            moved[~known] = fitted.take(where_again, 0)
        return moved

    def consensus(self, points: Points, reach_m: float, outlier_m: float) -> Points:
        """Points (n, 2) moved by what the control points around them say together, not by any single one.

        Tracking errs from vertex to vertex, the ground does not: those within `reach_m` are averaged, and one that stands apart from
        its neighbours by more than `outlier_m` counts little (iteratively reweighted least squares).
        """
        trust = np.ones(len(self.source))
        for _ in range(CONSENSUS_ROUNDS):
            expected = _fitted(self.source, self.source, self.target, reach_m, trust)
            trust = 1.0 / (1.0 + ((self.target - expected) ** 2).sum(1) / outlier_m**2) ** 2
        return _fitted(points, self.source, self.target, reach_m, trust)

    def inverse(self) -> "Motion":
        return Motion(self.target, self.source)

    def after(self, first: "Motion") -> "Motion":
        """Does `first`, then this: its control points are those of `first`, carried on."""
        if not len(first.source):
            return self
        return Motion(first.source, self.apply(first.target))


def _same(points: Points, source: Points) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.int64]]:
    """Which points are control points, and where in `source` (valid for those alone): both (n,)."""
    ours, theirs = (as_numbers(np.round(some / EXACT_M)) for some in (points, source))
    order = np.argsort(theirs, kind="stable")
    where = order.take(np.searchsorted(theirs, ours, sorter=order), mode="clip")
    return theirs[where] == ours, where


def _fitted(points: Points, source: Points, target: Points, reach_m: float, trust: npt.NDArray[np.float64]) -> Points:
    """Rigid moving least squares of points (n, 2) by the control points (m, 2), each by its trust (m,), those within the reach above all."""
    blocks = np.array_split(points, 1 + len(points) * len(source) // MOST_PAIRS)
    return np.concatenate([_fitted_together(block, source, target, reach_m, trust) for block in blocks])


def _fitted_together(
    points: Points, source: Points, target: Points, reach_m: float, trust: npt.NDArray[np.float64]
) -> Points:
    """The same with arrays of all pairs. Complex numbers stand for plane vectors."""
    middle = source.mean(0)
    p, q, v = (as_numbers(some - middle) for some in (source, target, points))
    # all weighted sums in one product of real numbers
    terms = trust[:, None] * np.stack([p, q, np.conj(p) * q, np.ones(len(p))], 1)
    sums = _nearness(v, p, reach_m) @ terms.view(np.float64)
    p_mean, q_mean, turn, weight = sums.view(np.complex128).T
    p_mean, q_mean, turn = p_mean / weight.real, q_mean / weight.real, turn / weight.real
    # sum of w conj(p - p_mean) (q - q_mean), multiplied out so that no more arrays of all pairs are made
    turn = turn - np.conj(p_mean) * q_mean
    size = np.abs(turn)
    turn = np.where(size > 1e-12, turn / np.where(size > 1e-12, size, 1.0), 1.0)
    moved = (v - p_mean) * turn + q_mean
    return np.asarray(np.stack([moved.real, moved.imag], 1) + middle)


def _nearness(
    points: npt.NDArray[np.complex128], source: npt.NDArray[np.complex128], reach_m: float
) -> npt.NDArray[np.float64]:
    """How much each control point (m,) has to say about each point (n,): (n, m)."""
    across, up = points.real[:, None] - source.real, points.imag[:, None] - source.imag
    across *= across
    up *= up
    across += up
    across += reach_m**2
    across *= across
    return np.asarray(np.divide(1.0, across, out=across))


IDENTITY = Motion(np.zeros((0, 2)), np.zeros((0, 2)))
