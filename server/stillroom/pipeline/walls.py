"""Walls and clutter: the floor that walls enclose, its outline, and which obstacles are furniture.

The outline is traced on the cells, straightened edge by edge, and lies on the walls' faces, not on cell centres.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import GRID_M, Points, as_points, polygons_in
from stillroom.maps.grid import GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.semantics import Clutter, Wall, WallKind
from stillroom.pipeline.params import Params
from stillroom.pipeline.straightening import straightened
from stillroom.pipeline.tracing import Corners, enclosed, trace

Pixels = npt.NDArray[np.int32]
"""Shape (n, 2), column and row of cells."""

EDGE = 0.01
"""Cells."""
BIAS_M = 1e-7
"""Coordinates halfway between two millimetres, as those of cells often are, go to the upper one and not where rounding errors send them."""
SPECK = 0.5
"""A part with less than this share of the smallest area stays below it however its edges are straightened."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """What stops a robot, told apart: `wall` and `clutter` are masks of occupied cells, `floor` is where rooms are (clutter included)."""

    wall: Mask
    clutter: Mask
    floor: Mask


def separate_clutter(grid: OccupancyGrid, params: Params) -> Obstacles:
    """Walls and clutter of a map without history, told apart by shape and never by area alone.

    An enclosed obstacle is clutter if it is short, or compact and not too large; unexplored pockets under it belong to the floor.
    """
    floor = np.zeros(grid.cells.shape, np.bool_)
    left, bottom, width, height = cv2.boundingRect(grid.free.view(np.uint8))
    # with a margin, so that what is outside of everything free is one obstacle
    rows = slice(max(bottom - 1, 0), bottom + height + 1)
    columns = slice(max(left - 1, 0), left + width + 1)
    free = without_small(grid.free[rows, columns], params.floor_speck_m2 / grid.frame.resolution**2)
    floor[rows, columns] = free | _movable(~free, grid.frame.resolution, params)
    clutter = grid.occupied & floor
    return Obstacles(grid.occupied & ~clutter, clutter, floor)


def without_small(mask: Mask, cells: float) -> Mask:
    """`mask` without its 4-connected components of fewer than `cells` cells."""
    count, labels = cv2.connectedComponents(np.ascontiguousarray(mask).view(np.uint8), connectivity=4)
    keep = np.bincount(labels[mask], minlength=count) >= cells
    keep[0] = False
    return np.asarray(np.take(keep, np.asarray(labels, np.int32)))


def _movable(obstacles: Mask, cell: float, params: Params) -> Mask:
    """The 8-connected `obstacles` that are clutter by their shape, and what they enclose. `cell`: metres."""
    found = np.zeros(obstacles.shape, np.uint8)
    outlines, links = cv2.findContours(obstacles.view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    rows, columns = obstacles.shape
    for outline_, (_, _, _, parent) in zip(
        outlines, links.reshape(-1, 4).tolist() if len(outlines) else [], strict=True
    ):
        left, top, width, height = cv2.boundingRect(outline_)
        enclosed = left > 0 and top > 0 and left + width < columns and top + height < rows
        if parent < 0 and enclosed:
            part = obstacles[top : top + height, left : left + width]
            if _is_movable(np.asarray(outline_ - (left, top), np.int32), part, cell, params):
                cv2.drawContours(found, [outline_], 0, 1, cv2.FILLED)
    return found > 0


def _is_movable(around: Pixels, part: Mask, cell: float, params: Params) -> bool:
    """Whether the obstacle with the outline `around` in `part` of the map is short, or compact and not too large."""
    if np.hypot(*part.shape) * cell <= params.clutter_length_m:
        return True
    _, sides, _ = cv2.minAreaRect(around)
    length, thickness = (max(sides) + 1) * cell, (min(sides) + 1) * cell
    if length <= params.clutter_length_m:
        return True
    if thickness < params.clutter_thickness_m or params.clutter_fill * length * thickness > params.clutter_area_m2:
        return False
    own = cv2.drawContours(np.zeros(part.shape, np.uint8), [around], 0, 1, cv2.FILLED)
    area = np.count_nonzero(part & (own > 0)) * cell**2
    return bool(params.clutter_fill * length * thickness <= area <= params.clutter_area_m2)


def seal_diagonals(floor: Mask) -> Mask:
    """`floor` without connections over a corner only: a diagonal wall of one cell must hold."""
    sealed = floor.copy()
    a, b, c, d = sealed[:-1, :-1], sealed[:-1, 1:], sealed[1:, :-1], sealed[1:, 1:]
    leaks = True
    while leaks:
        rising, falling = a & d & ~b & ~c, b & c & ~a & ~d
        leaks = bool(rising.any() or falling.any())
        a &= ~rising
        b &= ~falling
    return sealed


# -- outline -------------------------------------------------------------------------------------------------------


def outline(floor: Mask, frame: GridFrame, params: Params, smallest_m2: float = 0.0) -> MultiPolygon:
    """The floor as polygons in the map frame (metres): few vertices, straight edges on the walls' faces, holes where there are pillars.

    Exterior rings run counter-clockwise and holes clockwise: the floor is on the left. Parts below `smallest_m2` are left out.
    """
    cell = frame.resolution
    borders = trace(floor)
    areas = np.array([enclosed(border) for border in borders]) * cell**2
    # straight edges don't bring the many specks to `smallest_m2`; a pillar in one of them takes nothing from other parts
    around = [borders[k] for k in np.flatnonzero((areas > 0) & (areas >= SPECK * smallest_m2))]
    pillars = [borders[k] for k in np.flatnonzero(areas <= -params.pillar_area_m2)]
    straight = straightened([*pillars, *around], cell, params)
    holes: dict[int, list[Polygon]] = {}
    for rings, part in zip(straight, _parts_of(pillars, around), strict=False):
        holes.setdefault(part, []).extend(ring for ring in rings if ring.area * cell**2 >= params.pillar_area_m2)
    left, bottom, width, height = cv2.boundingRect(floor.view(np.uint8))
    # a little more, or edges on the very border would be cut by rounding errors
    extent = shapely.box(left - EDGE, bottom - EDGE, left + width + EDGE, bottom + height + EDGE)
    parts: list[Polygon] = []
    for k, whole in enumerate(straight[len(pillars) :]):
        if holes.get(k):
            pillar_area = shapely.union_all(holes[k], grid_size=GRID_M)
            whole = polygons_in(shapely.difference(whole, pillar_area, grid_size=GRID_M))
        parts += whole
    parts = [
        p for p in polygons_in(shapely.intersection(parts, extent)) if p.area * cell**2 >= max(smallest_m2, GRID_M)
    ]
    # to whole millimetres along the grid's axes first: then it does not matter where the grid lies
    local = shapely.transform(np.array(parts, dtype=object), lambda p: as_points(p) * cell + BIAS_M)
    apart = np.array(_apart(polygons_in(shapely.set_precision(local, GRID_M))), dtype=object)
    placed = shapely.transform(apart, lambda p: frame.origin.apply(as_points(p)))
    return shapely.orient_polygons(MultiPolygon(polygons_in(shapely.set_precision(placed, GRID_M))))


def _parts_of(holes: list[Corners], around: list[Corners]) -> list[int]:
    """For each hole the index of the part that it is in."""
    if len(around) == 1 or not holes:
        return [0] * len(holes)
    parts = [Polygon(border) for border in around]
    # the mask lies on the left of a hole's border
    along = np.array([np.sign(hole[1] - hole[0]) for hole in holes]).reshape(-1, 2)
    beside = np.array([hole[0] for hole in holes]).reshape(-1, 2) + 0.5 * (
        along + np.stack([-along[:, 1], along[:, 0]], 1)
    )
    hole, part = shapely.STRtree(parts).query(shapely.points(beside), predicate="within")
    found = dict.fromkeys(range(len(holes)), 0)
    for h, p in sorted(zip(hole.tolist(), part.tolist(), strict=True), key=lambda pair: -parts[pair[1]].area):
        found[h] = p
    return [found[h] for h in range(len(holes))]


def _apart(parts: list[Polygon]) -> list[Polygon]:
    """Parts that thin walls hold apart, and straightened edges don't: the larger keeps what both claim."""
    parts = sorted(parts, key=lambda p: -p.area)
    grown: dict[int, tuple[Polygon, shapely.Geometry]] = {}
    for i, j in np.sort(shapely.STRtree(parts).query(parts, predicate="intersects").T).tolist() if parts else []:
        if i < j:
            # A large part with hundreds of small ones beside it is grown once.
            if i not in grown or grown[i][0] is not parts[i]:
                grown[i] = parts[i], shapely.buffer(parts[i], 2 * GRID_M)
            rest = polygons_in(shapely.difference(parts[j], grown[i][1], grid_size=GRID_M))
            parts[j] = max(rest, key=lambda p: p.area, default=Polygon())
    return [part for part in parts if not part.is_empty]


# -- features ------------------------------------------------------------------------------------------------------


def wall_features(floor: MultiPolygon, near_occupied: Mask, frame: GridFrame, version: str) -> tuple[Wall, ...]:
    """The outline as polylines, floor on their left: `wall` within the wall distance of occupied cells, `open` elsewhere.

    `near_occupied`: (height, width), cells within the wall distance of an occupied one.
    `version` keeps ids apart from other versions'.
    """
    pieces: list[tuple[WallKind, Points]] = []
    for polygon in floor.geoms:
        for ring in (polygon.exterior, *polygon.interiors):
            pieces += _ring_pieces(shapely.get_coordinates(ring), near_occupied, frame)
    return tuple(
        Wall(f"w{version}-{i}", tuple(map(tuple, np.round(line, 4).tolist())), kind)
        for i, (kind, line) in enumerate(pieces, 1)
    )


def _ring_pieces(ring: Points, near_occupied: Mask, frame: GridFrame) -> list[tuple[WallKind, Points]]:
    """A closed ring (n, 2) cut where it changes between wall and open."""
    step = frame.resolution
    lengths = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    stations = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.arange(0.0, stations[-1], step)
    samples = np.stack([np.interp(at, stations, ring[:, k]) for k in (0, 1)], 1)
    runs = look_up(near_occupied, frame.to_cells_inside(samples), False)
    runs &= np.roll(runs, 1) | np.roll(runs, -1)
    if runs.all() or not runs.any():
        return [("wall" if runs[0] else "open", ring)]
    cuts = np.flatnonzero(runs != np.roll(runs, 1))
    kinds = runs[cuts]
    cuts = (cuts - ~kinds) % len(runs)
    around = np.concatenate([stations[:-1], stations + stations[-1]])
    corners = np.concatenate([ring[:-1], ring])
    nexts = np.roll(cuts, -1)
    first = np.searchsorted(around, at[cuts] + GRID_M, side="right")
    last = np.searchsorted(around, np.where(nexts > cuts, at[nexts], at[nexts] + stations[-1]) - GRID_M)
    pieces: list[tuple[WallKind, Points]] = []
    for wall, a, b, i, j in np.stack([kinds, cuts, nexts, first, last], 1).tolist():
        line = np.concatenate([samples[a : a + 1], corners[i:j], samples[b : b + 1]])
        pieces.append(("wall" if wall else "open", line))
    return pieces


def clutter_features(clutter: Mask, frame: GridFrame, version: str, params: Params) -> tuple[Clutter, ...]:
    """Each object as a polygon in the map frame around its cells."""
    contours, _ = cv2.findContours(clutter.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    boxes, rough = [], []
    for contour in contours:
        left, bottom, width, height = cv2.boundingRect(contour)
        if width * height * frame.resolution**2 < params.clutter_shown_m2:
            continue
        if clutter[bottom : bottom + height, left : left + width].all():
            boxes.append((left, bottom, left + width, bottom + height))
        else:
            rough.append(_shape(as_points(cv2.approxPolyDP(contour, 1.0, True)) + 0.5))
    grown = shapely.buffer(_valid(rough), 0.5, join_style="mitre", cap_style="square", mitre_limit=1.5)
    parts = np.array(polygons_in(grown) + polygons_in(shapely.box(*np.array(boxes).reshape(-1, 4).T)), dtype=object)
    large = parts[shapely.area(parts) * frame.resolution**2 >= params.clutter_shown_m2]
    whole = shapely.polygons(shapely.get_exterior_ring(large))
    placed = shapely.transform(whole, lambda p: np.round(frame.to_map(as_points(p)), 4))
    return tuple(Clutter(f"k{version}-{i}", polygon) for i, polygon in enumerate(placed, 1))


def _valid(shapes: list[shapely.Geometry]) -> npt.NDArray[np.object_]:
    made = np.array(shapes, dtype=object)
    broken = ~shapely.is_valid(made)
    made[broken] = shapely.make_valid(made[broken])
    return made


def _shape(points: Points) -> shapely.Geometry:
    if len(points) >= 3:
        return shapely.polygons(points)
    return shapely.linestrings(points) if len(points) == 2 else shapely.points(points[0])
