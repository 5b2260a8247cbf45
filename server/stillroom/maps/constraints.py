"""Semantic constraints (paper, Tables I and II) as functions that return what violates them.

That occupancy pixels are sensed by the robot and never altered holds by construction: grids are read-only and stored by content.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from stillroom.maps.geometry import line_strings
from stillroom.maps.grid import OccupancyGrid, look_up
from stillroom.maps.meta import MetaDivider
from stillroom.maps.semantics import Divider, SemanticMap, Wall

TOUCH_M = 0.01
"""Nearer than this is touching: coordinates are kept to the millimetre and edges to rounding."""
OVERLAP_M2 = 0.001
INTERIORS_MEET = "T********"
"""DE-9IM."""
SAMPLE_M = 0.05


@dataclass(frozen=True)
class Violation:
    """`feature` is the id of what is wrong."""

    constraint: str
    feature: str
    detail: str


Features = Sequence[Wall | Divider | MetaDivider]
Constraint = Callable[[SemanticMap, OccupancyGrid, float], Iterator[Violation]]
"""The map, the grid it lies on, and the paper's wall distance in metres."""


def violations(semantic_map: SemanticMap, grid: OccupancyGrid, wall_reach_m: float) -> tuple[Violation, ...]:
    """Everything in the map that breaks a constraint. Rooms that were not visited may reach beyond the grid."""
    grid = grid.covering(shapely.get_coordinates(_lines(semantic_map.walls)))
    return tuple(violation for constraint in CONSTRAINTS for violation in constraint(semantic_map, grid, wall_reach_m))


def clutter_lies_on_occupancy(semantic_map: SemanticMap, grid: OccupancyGrid, _reach: float) -> Iterator[Violation]:
    shapes = np.array([clutter.polygon for clutter in semantic_map.clutter], dtype=object)
    for k, gap in _off_occupancy(shapes, grid, 2 * grid.frame.resolution):
        detail = f"a corner is {gap:.2f} m away from any"
        yield Violation("clutter lies on occupancy pixels", semantic_map.clutter[k].id, detail)


def walls_lie_near_occupancy(semantic_map: SemanticMap, grid: OccupancyGrid, reach_m: float) -> Iterator[Violation]:
    walls = [wall for wall in semantic_map.walls if wall.kind == "wall"]
    shapes = shapely.segmentize(_lines(walls), SAMPLE_M)
    for k, gap in _off_occupancy(shapes, grid, reach_m + 2 * grid.frame.resolution):
        constraint = "a wall lies within the wall distance of occupied pixels"
        yield Violation(constraint, walls[k].id, f"{gap:.2f} m away from any")


def dividers_end_on_walls_or_dividers(
    semantic_map: SemanticMap, _grid: OccupancyGrid, _reach: float
) -> Iterator[Violation]:
    """Where a wall is missing, the meta-divider that stands in for it holds a divider as well."""
    walls: Features = (*semantic_map.walls, *semantic_map.meta.dividers)
    yield from _loose_ends("a divider ends on a wall or another divider", semantic_map.dividers, walls)


def meta_dividers_end_on_walls_or_meta_dividers(
    semantic_map: SemanticMap, _grid: OccupancyGrid, _reach: float
) -> Iterator[Violation]:
    """A plain divider holds a meta-divider as well as a wall does: the robot respects both."""
    walls: Features = (*semantic_map.walls, *semantic_map.dividers)
    yield from _loose_ends("a meta-divider ends on a wall or meta-divider", semantic_map.meta.dividers, walls)


def _loose_ends(
    constraint: str, dividers: Sequence[Divider] | Sequence[MetaDivider], walls: Features
) -> Iterator[Violation]:
    """Ends that lie neither on a wall nor on another of the dividers."""
    if not dividers:
        return
    ends = np.array([divider.line for divider in dividers])
    gaps = shapely.distance(shapely.points(ends)[..., None], _lines((*walls, *dividers)))
    own = np.arange(len(dividers))
    gaps[own, :, len(walls) + own] = np.inf
    for i, end in np.argwhere(gaps.min(2) > TOUCH_M).tolist():
        x, y = ends[i, end]
        gap = gaps[i, end].min()
        yield Violation(constraint, dividers[i].id, f"the end at ({x:.2f}, {y:.2f}) is {gap:.2f} m away from any")


def rooms_are_enclosed(semantic_map: SemanticMap, _grid: OccupancyGrid, _reach: float) -> Iterator[Violation]:
    """Every edge of a room is a wall section, a divider or a meta-divider."""
    lines = _lines((*semantic_map.walls, *semantic_map.dividers, *semantic_map.meta.dividers))
    barriers = shapely.buffer(shapely.multilinestrings(lines), TOUCH_M, quad_segs=1)
    shapely.prepare(barriers)
    boundaries = shapely.boundary([room.polygon for room in semantic_map.rooms])
    for k in np.flatnonzero(~shapely.covers(barriers, boundaries)).tolist():
        open_ = shapely.length(shapely.difference(boundaries[k], barriers))
        if open_ > TOUCH_M:
            constraint = "a room is enclosed by wall sections and dividers"
            yield Violation(constraint, semantic_map.rooms[k].id, f"{open_:.2f} m of its boundary are neither")


def rooms_are_valid_and_disjoint(semantic_map: SemanticMap, _grid: OccupancyGrid, _reach: float) -> Iterator[Violation]:
    polygons = np.array([room.polygon for room in semantic_map.rooms], dtype=object)
    valid = shapely.is_valid(polygons)
    for k in np.flatnonzero(~valid | shapely.is_empty(polygons)).tolist():
        room = semantic_map.rooms[k]
        yield Violation("a room is one valid polygon", room.id, shapely.is_valid_reason(room.polygon))
    if valid.all():
        i, j = shapely.STRtree(polygons).query(polygons)
        i, j = i[i < j], j[i < j]
        inner = shapely.relate_pattern(polygons[i], polygons[j], INTERIORS_MEET)
        i, j = i[inner], j[inner]
        common = shapely.area(shapely.intersection(polygons[i], polygons[j]))
        for k in np.flatnonzero(common > OVERLAP_M2).tolist():
            detail = f"{common[k]:.3f} m2 also belong to {semantic_map.rooms[j[k]].id}"
            yield Violation("rooms are disjoint", semantic_map.rooms[i[k]].id, detail)


CONSTRAINTS: tuple[Constraint, ...] = (
    clutter_lies_on_occupancy,
    walls_lie_near_occupancy,
    dividers_end_on_walls_or_dividers,
    meta_dividers_end_on_walls_or_meta_dividers,
    rooms_are_enclosed,
    rooms_are_valid_and_disjoint,
)


def _lines(features: Features) -> npt.NDArray[np.object_]:
    return line_strings([feature.line for feature in features])


def _off_occupancy(shapes: npt.NDArray[np.object_], grid: OccupancyGrid, reach_m: float) -> Iterator[tuple[int, float]]:
    """The shapes with a corner farther than `reach_m` from any occupied cell, by number, and how far it is, metres."""
    corners, shape = shapely.get_coordinates(shapes, return_index=True)
    places = grid.frame.to_cells_inside(corners)
    far = np.flatnonzero(~look_up(grid.near_occupied(reach_m), places, False))
    if len(far):
        gaps = look_up(grid.occupied_distance, places[far], np.inf)
        for k in np.unique(shape[far]).tolist():
            yield k, float(gaps[shape[far] == k].max())
