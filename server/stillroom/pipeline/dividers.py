"""Dividers end on walls or on other dividers (paper, Table I): where a drawn or tracked one has to end."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon

from stillroom.maps.geometry import GRID_M, Line, Points, as_line, as_points

Numbers = npt.NDArray[np.float64]

TOUCH_M = 0.002
EXACT_M = 1e-9
"""What lies this near to a line lies on it, but for rounding errors."""
SHORTEST_M = 0.10
"""A divider that would be shorter than this divides nothing."""
STATIONS = np.linspace(0.02, 0.98, 33)
THICKEST_WALL_M = 0.6
ACROSS = 0.5
"""Cosine of the smallest angle between a divider and the face of a doorpost."""
CORNER = np.radians(25)
"""The outline turns at least so much at a doorpost's corners."""
PARALLEL = 0.94
DETOUR, DETOUR_M = 2.0, 0.10
"""Along its line a tracked end goes at most this many times as far as to the nearest wall, and this much more."""


@dataclass(frozen=True)
class Attached:
    """A divider whose ends lie on walls or dividers."""

    line: Line


@dataclass(frozen=True)
class Adrift:
    """A divider of which `end` (0 or 1) finds nothing to end on; the nearest wall or divider is `gap_m` metres away."""

    end: int
    gap_m: float


@dataclass(frozen=True, eq=False)
class Outline:
    """A floor, and what its outline has for all dividers that end on it."""

    floor: MultiPolygon

    def barriers(self, others: Sequence[Line]) -> "Barriers":
        """What dividers end on: the outline and other dividers."""
        edges = np.array(others, np.float64).reshape(-1, 2, 2)
        drawn = shapely.multilinestrings(np.concatenate([self._rings, shapely.linestrings(edges)]))
        return Barriers(drawn, np.concatenate([self._edges, edges]))

    @cached_property
    def boundary(self) -> shapely.Geometry:
        return shapely.boundary(self.floor)

    @cached_property
    def doorposts(self) -> Numbers:
        """Edges of the outline, (n, 2, 2), as short as a wall is thick, between two corners that stick into the floor."""
        found = []
        for ring in shapely.get_rings(shapely.get_parts(shapely.orient_polygons(self.floor))):
            points = shapely.get_coordinates(ring)[:-1]
            out = np.roll(points, -1, axis=0) - points
            into = np.roll(out, 1, axis=0)
            turn = np.arctan2(into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0], (into * out).sum(1))
            sticks_in = turn < -CORNER
            post = sticks_in & np.roll(sticks_in, -1) & (np.hypot(*out.T) < THICKEST_WALL_M)
            found.append(np.stack([points, points + out], 1)[post])
        return np.concatenate(found)

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Of the doorposts."""
        return shapely.STRtree(shapely.linestrings(self.doorposts))

    @cached_property
    def _edges(self) -> Numbers:
        """Of all rings, (n, 2, 2)."""
        points, ring = shapely.get_coordinates(self._rings, return_index=True)
        return np.asarray(np.stack([points[:-1], points[1:]], 1)[ring[:-1] == ring[1:]])

    @cached_property
    def _rings(self) -> npt.NDArray[np.object_]:
        points, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(self.floor)), return_index=True)
        return np.asarray(shapely.linestrings(points, indices=ring))


@dataclass(frozen=True, eq=False)
class Barriers:
    """What dividers end on, drawn as lines, and its straight edges, (n, 2, 2)."""

    drawn: shapely.Geometry
    edges: Numbers

    def crossings(self, start: Points, along: Points, length: float, reach_m: float) -> Numbers:
        """Distances from `start` at which a line in the direction `along` meets a barrier, from reach before it to reach beyond its end."""
        offset = self.edges - start
        station, aside = offset @ along, offset @ (-along[1], along[0])
        aside[np.abs(aside) < EXACT_M] = 0.0
        across = aside[:, 0] * aside[:, 1] < 0
        a, b = aside[across].T
        p, q = station[across].T
        met = np.round(np.sort(np.concatenate([p + (q - p) * a / (a - b), station[aside == 0]])), 6)
        return np.asarray(met[(met > -reach_m - TOUCH_M) & (met < length + reach_m + TOUCH_M)])


def attach(
    line: Line, outline: Outline, others: Sequence[Line], reach_m: float, tracked: bool = False
) -> Attached | Adrift:
    """Moves each end to the first wall or divider along the divider's own line within `reach_m`, else to the nearest one within it.

    An end in a wall or off the floor is trimmed to the wall's face. Keeping the direction keeps rooms where tracking is noisy (98.5 % of
    rooms at 0.2 m noise, 97.6 % with the nearest wall alone). But a tracked divider ended about where it does now: where a wall is much
    nearer to its end than what its line would find, the end takes that wall, or it would creep along a wall's face mission by mission.
    """
    ends = as_points(line)
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    if length < TOUCH_M or outline.floor.is_empty:
        return Adrift(0, 0.0)
    along = along / length
    reach_m += GRID_M
    barriers = outline.barriers(others)
    stations = barriers.crossings(ends[0], along, length, reach_m)
    moved = ends.copy()
    near = shapely.get_coordinates(shapely.shortest_line(shapely.points(ends), barriers.drawn)).reshape(2, 2, 2)[:, 1]
    gaps = np.hypot(*(near - ends).T).tolist()
    for end, (at, inward, gap) in enumerate(((0.0, 1.0, gaps[0]), (length, -1.0, gaps[1]))):
        station = _crossing(stations, at, inward, length, reach_m, nearest=tracked)
        if gap < TOUCH_M or (gap <= reach_m and (station is None or _detour(tracked, abs(station - at), gap))):
            moved[end] = near[end]
        elif station is not None:
            moved[end] = ends[0] + station * along
        else:
            return Adrift(end, gap)
    placed = _on_grid(moved, barriers.drawn)
    now = moved[1] - moved[0]
    on_floor = _dividing(placed, outline, barriers) * np.hypot(*now)
    if now @ along < SHORTEST_M or on_floor < SHORTEST_M:
        return Adrift(1, 0.0)
    return Attached(as_line(placed))


def _dividing(ends: Points, outline: Outline, barriers: Barriers) -> float:
    """The share of the line between two places that lies on the floor and on no barrier."""
    places = ends[0] + STATIONS[:, None] * (ends[1] - ends[0])
    if not shapely.dwithin(barriers.drawn, shapely.linestrings(places[[0, -1]]), TOUCH_M):
        # what touches no border is on one side of it
        return float(shapely.contains_xy(outline.floor, *places[0]))
    on_barrier = shapely.dwithin(barriers.drawn, shapely.points(places), TOUCH_M)
    return float((shapely.contains_xy(outline.floor, places) & ~on_barrier).mean())


def attach_path(
    path: Points, outline: Outline, others: Sequence[Line], reach_m: float, fixed: Sequence[bool] = (False, False)
) -> Points | None:
    """A path (n, 2) over the floor whose two ends are moved to the walls or dividers that they end on; None where one finds none.

    Each goes on in its direction, or back, to the nearest crossing within reach, else to the nearest place within reach. Ends that are
    `fixed` stay.
    """
    if len(path) < 2 or outline.floor.is_empty:
        return None
    barriers = outline.barriers(others)
    moved = np.round(path, 3)
    for end, inner, stays in ((0, 1, fixed[0]), (-1, -2, fixed[1])):
        found = path[end] if stays else _end_of_path(path[inner], path[end], barriers, reach_m)
        if found is None:
            return None
        moved[end] = found if stays else _on_grid(found[None], barriers.drawn)[0]
    return moved if np.hypot(*(moved[-1] - moved[0])) > TOUCH_M or len(moved) > 2 else None


def _end_of_path(inner: Points, end: Points, barriers: Barriers, reach_m: float) -> Points | None:
    """Where a path's last edge, from `inner` to `end`, ends on a barrier."""
    along = end - inner
    length = float(np.hypot(*along))
    near = shapely.get_coordinates(shapely.shortest_line(shapely.Point(end), barriers.drawn))
    gap = float(np.hypot(*(near[1] - near[0])))
    if length > TOUCH_M and gap > TOUCH_M:
        stations = barriers.crossings(inner, along / length, length, reach_m)
        station = _crossing(stations, length, -1.0, length, reach_m, nearest=True)
        if station is not None and abs(station - length) <= DETOUR * gap + DETOUR_M:
            return inner + station * along / length
    return near[1] if gap <= reach_m else None


def _on_grid(points: Points, barriers: shapely.Geometry) -> Points:
    """Each point (n, 2) at whole millimetres, on that side on which it stays nearest to what it lies on: cutting must find it there."""
    near = (np.floor(points / GRID_M + 1e-6)[:, None] + [(0, 0), (1, 0), (0, 1), (1, 1)]) * GRID_M
    best = shapely.distance(shapely.points(near), barriers).argmin(1)
    return as_points(np.round(near[np.arange(len(points)), best], 3))


def _detour(tracked: bool, along_m: float, gap_m: float) -> bool:
    return tracked and along_m > DETOUR * gap_m + DETOUR_M


def _crossing(stations: Points, at: float, inward: float, length: float, reach_m: float, nearest: bool) -> float | None:
    """The crossing within reach on which an end comes to lie: the nearest to it, or the first from the divider's middle outwards."""
    outward = (at - stations) * inward  # metres beyond the end, negative towards the middle
    possible = outward[(outward <= reach_m) & (-outward <= min(reach_m, length / 2))]
    if not len(possible):
        return None
    chosen = possible[np.abs(possible).argmin()] if nearest else possible.min()
    return float(at - chosen * inward)


def centre(line: Line, outline: Outline) -> Line:
    """A divider in a doorway, moved to the middle of the wall's thickness; any other as it is.

    Nothing holds a tracked divider across its own line, so that it would wander from one face of the wall to the other.
    """
    return centre_all([line], outline)[0]


def centre_all(lines: Sequence[Line], outline: Outline) -> list[Line]:
    """The same for each of `lines`."""
    if outline.floor.is_empty or not lines:
        return list(lines)
    end, edge = outline.tree.query(
        shapely.points(np.array(lines).reshape(-1, 2)), predicate="dwithin", distance=2 * TOUCH_M
    )
    centred = list(lines)
    for k in np.unique(end // 2).tolist():
        at_begin, at_end = (outline.doorposts[np.sort(edge[end == 2 * k + side])] for side in (0, 1))
        centred[k] = _centred(lines[k], at_begin, at_end, outline.boundary)
    return centred


def _centred(line: Line, at_begin: Numbers, at_end: Numbers, boundary: shapely.Geometry) -> Line:
    """`at_begin`, `at_end`: doorposts, (n, 2, 2), on which the line's ends lie."""
    ends = as_points(line)
    along = (ends[1] - ends[0]) / max(float(np.hypot(*(ends[1] - ends[0]))), 1e-9)
    jambs = [_jamb(edges, along) for edges in (at_begin, at_end)]
    if jambs[0] is None or jambs[1] is None:
        return line
    moved = _on_grid(as_points([jambs[0], jambs[1]]), boundary)
    turned = (moved[1] - moved[0]) / max(float(np.hypot(*(moved[1] - moved[0]))), 1e-9)
    return as_line(moved) if turned @ along > PARALLEL else line


def _jamb(edges: Numbers, along: Points) -> Points | None:
    """The middle of the doorpost's face, (2,), among the `edges` (n, 2, 2) on which a divider ends; None where none runs across the divider."""
    for begin, end in edges:
        if abs(float((end - begin) @ along)) < ACROSS * float(np.hypot(*(end - begin))):
            return np.asarray((begin + end) / 2)
    return None
