"""How right the map in force is after a mission, and how much of it rests on the meta layer."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString

from stillroom.maps.geometry import Points, as_points
from stillroom.maps.grid import OccupancyGrid, look_up
from stillroom.maps.semantics import SemanticMap
from stillroom.simulator.truth import MapFit

_STEP_M = 0.05
"""Room boundaries are looked at in pieces of this length."""
_ON_M = 0.08
"""A boundary lies on what is this near to it, and half a cell."""


@dataclass(frozen=True)
class Record:
    """One mission of a benchmark."""

    seed: int
    robot: int
    mission: int
    effects: tuple[str, ...]
    """What happened in it."""
    refuse: str | None
    """Why it must not be taken; None: it should be."""
    outcome: str
    taken: bool
    succeeded_at: str | None
    transfer: bool
    meta_occupancy: bool
    meta_dividers: bool
    error: bool
    """It was not taken though it should have been, or a room that its owner had named is not where it should be."""
    silent: bool
    """The same, and the mission was taken."""
    mean_iou: float
    meta_share: float
    """Of the length of the rooms' boundaries, what only the meta layer holds."""
    lost: tuple[str, ...]
    """Rooms that were named and are gone."""
    wrong: tuple[str, ...]
    """Rooms that were named and are elsewhere: precision or recall of 0.5 or less."""
    core_ms: float
    """Of CPU."""
    reason: str


def lost_and_wrong(found: MapFit, named: Collection[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Of the true rooms that the owner had named: those whose name is gone, and those that are not where they should be."""
    judged = [room for room in found.rooms if room.name in named]
    lost = tuple(room.name for room in judged if room.named is None)
    return lost, tuple(room.name for room in judged if room.named is not None and not room.named.passed)


def meta_share(of: SemanticMap, grid: OccupancyGrid) -> float:
    """Length of the rooms' boundaries on meta-dividers and edges of meta-occupancy, and on no divider or sensed wall, by their whole length."""
    if not of.rooms or not (of.meta.dividers or of.meta.occupancy):
        return 0.0
    points = np.concatenate([_stations(room.polygon.exterior) for room in of.rooms])
    reach = _ON_M + grid.frame.resolution / 2
    meta = [LineString(d.line) for d in of.meta.dividers] + [o.polygon for o in of.meta.occupancy]
    on_meta = _near(points, meta, reach)
    held = _near(points, [LineString(d.line) for d in of.dividers], reach)
    held |= look_up(grid.occupied_distance, grid.frame.to_cells(points), np.inf) <= reach
    return float((on_meta & ~held).mean())


def _stations(ring: shapely.Geometry) -> Points:
    """Points (n, 2) at even distances along a ring."""
    stops = np.arange(_STEP_M / 2, ring.length, _STEP_M)
    return as_points(shapely.get_coordinates(shapely.line_interpolate_point(ring, stops)))


def _near(points: Points, shapes: list[shapely.Geometry], reach: float) -> npt.NDArray[np.bool_]:
    if not shapes:
        return np.zeros(len(points), bool)
    return np.asarray(shapely.dwithin(shapely.points(points), shapely.GeometryCollection(shapes), reach))
