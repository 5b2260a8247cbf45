"""Points and rigid motions in the plane. Points are float64 arrays of shape (n, 2), metres, x right and y up (REP-103)."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import atan2, cos, sin

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

Points = npt.NDArray[np.float64]
"""Shape (n, 2)."""
Point = tuple[float, float]
Line = tuple[Point, Point]
"""A straight segment, end to end."""


GRID_M = 0.001
"""Coordinates are kept to the millimetre, so that equal corners are equal numbers."""


def as_points(coordinates: object) -> Points:
    """Any sequence of n pairs as an array of shape (n, 2); an empty one as (0, 2)."""
    return np.asarray(coordinates, dtype=np.float64).reshape(-1, 2)


def as_numbers(points: Points) -> npt.NDArray[np.complex128]:
    """Points (n, 2) as complex numbers (n,), which have the same order and are sorted much faster than rows."""
    return np.ascontiguousarray(points).view(np.complex128).ravel()


def distinct(points: Points) -> tuple[Points, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The points (n, 2) by x, then y, each once; where each of those comes first; and which of them each point is (n,)."""
    found, first, which = np.unique(as_numbers(points), return_index=True, return_inverse=True)
    return found.view(np.float64).reshape(-1, 2), first, which


def as_tuples(points: Points) -> tuple[Point, ...]:
    """Points (n, 2) as a hashable sequence."""
    return tuple((x, y) for x, y in points.tolist())


def as_line(points: Points) -> Line:
    """Two points, shape (2, 2), as a hashable line."""
    (x0, y0), (x1, y1) = points.tolist()
    return (x0, y0), (x1, y1)


def line_strings(lines: Sequence[Sequence[Point]]) -> npt.NDArray[np.object_]:
    """Lines of two points or more as shapely has them, shape (n,), made in one go."""
    points = as_points(list(chain.from_iterable(lines)))
    return np.asarray(shapely.linestrings(points, indices=np.repeat(np.arange(len(lines)), [*map(len, lines)])))


@dataclass(frozen=True)
class Pose:
    """A rigid motion p -> R(yaw) p + (x, y); metres and radians, counter-clockwise."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def rotation(self) -> npt.NDArray[np.float64]:
        """R(yaw), shape (2, 2)."""
        c, s = cos(self.yaw), sin(self.yaw)
        return np.array([[c, -s], [s, c]])

    def apply(self, points: Points) -> Points:
        if not self.yaw:
            return np.asarray(points + np.array([self.x, self.y]))
        # coordinate by coordinate, not as a matrix product: equal points must stay equal, or rings would not close
        c, s = cos(self.yaw), sin(self.yaw)
        x, y = points[:, 0], points[:, 1]
        moved = np.empty((len(points), 2))
        moved[:, 0] = c * x - s * y + self.x
        moved[:, 1] = s * x + c * y + self.y
        return moved

    def inverse(self) -> "Pose":
        c, s = cos(self.yaw), sin(self.yaw)
        return Pose(-c * self.x - s * self.y, s * self.x - c * self.y, -self.yaw)

    def after(self, first: "Pose") -> "Pose":
        """The motion that does `first` and then this one."""
        c, s = cos(self.yaw), sin(self.yaw)
        yaw = self.yaw + first.yaw
        return Pose(self.x + c * first.x - s * first.y, self.y + s * first.x + c * first.y, atan2(sin(yaw), cos(yaw)))


def fit_pose(source: Points, target: Points, weights: npt.NDArray[np.float64] | None = None) -> Pose:
    """The rigid motion that takes `source` (n, 2) nearest to `target` (n, 2) in weighted least squares (Umeyama 1991, no scale).

    A single point gives a translation.
    """
    w = np.ones(len(source)) if weights is None else weights
    w = w / w.sum()
    a, b = w @ source, w @ target
    (xx, xy), (yx, yy) = ((w[:, None] * (source - a)).T @ (target - b)).tolist()
    yaw = atan2(xy - yx, xx + yy)
    (u, v), (x, y), c, s = a.tolist(), b.tolist(), cos(yaw), sin(yaw)
    return Pose(x - (c * u - s * v), y - (s * u + c * v), yaw)


def polygons_in(geometry: shapely.Geometry | Sequence[shapely.Geometry]) -> list[Polygon]:
    """The polygons in any geometry or geometries."""
    parts = shapely.get_parts(shapely.get_parts(geometry))
    found: list[Polygon] = parts[
        (shapely.get_type_id(parts) == shapely.GeometryType.POLYGON) & ~shapely.is_empty(parts)
    ].tolist()
    return found
