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

Pixels = npt.NDArray[np.int32]
"""Shape (n, 2), column and row of cells."""

STEP = 0.8
"""Cells by which parallel edges must lie apart to be told from one edge."""
SHORTEST_FIT = 6
"""An edge of fewer cells than this is too short to fit a line to."""


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
    free = _drop_specks(grid.free[rows, columns], params.floor_speck_m2 / grid.frame.resolution**2)
    floor[rows, columns] = free | _movable(~free, grid.frame.resolution, params)
    clutter = grid.occupied & floor
    return Obstacles(grid.occupied & ~clutter, clutter, seal_diagonals(floor))


def _drop_specks(mask: Mask, cells: float) -> Mask:
    """`mask` without its 4-connected components of fewer than `cells` cells."""
    count, labels = cv2.connectedComponents(np.ascontiguousarray(mask).view(np.uint8), connectivity=4)
    keep = np.bincount(labels.ravel(), minlength=count) >= cells
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
    cells = floor.view(np.uint8)
    contours, hierarchy = cv2.findContours(cells, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if not len(contours):
        return MultiPolygon()
    parents = hierarchy.reshape(-1, 4)[:, 3]
    tolerance = max(params.outline_tolerance_m / frame.resolution, 1.1)
    shells: dict[int, list[Polygon]] = {}
    holes: dict[int, list[Polygon]] = {}
    for i, contour in enumerate(contours):
        if parents[i] >= 0 and cv2.contourArea(contour) * frame.resolution**2 < params.pillar_area_m2:
            continue
        rings = _ring(contour.reshape(-1, 2).astype(np.int32), tolerance, hole=parents[i] >= 0)
        if parents[i] < 0:
            shells[i] = rings
        else:
            large = [ring for ring in rings if ring.area * frame.resolution**2 >= params.pillar_area_m2]
            holes.setdefault(int(parents[i]), []).extend(large)
    parts: list[Polygon] = []
    for i, shell in shells.items():
        whole: list[Polygon] = shell
        if holes.get(i):
            pillars = shapely.union_all(holes[i], grid_size=GRID_M)
            whole = polygons_in(shapely.difference(shell, pillars, grid_size=GRID_M))
        whole = polygons_in(shapely.intersection(whole, shapely.box(0, 0, frame.width, frame.height)))
        parts += [p for p in whole if p.area * frame.resolution**2 >= max(smallest_m2, GRID_M)]
    moved = shapely.transform(np.array(parts, dtype=object), lambda p: frame.to_map(as_points(p)))
    snapped = polygons_in(shapely.set_precision(moved, GRID_M))
    return shapely.orient_polygons(MultiPolygon(_apart(snapped)))


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


def _ring(contour: Pixels, tolerance: float, hole: bool) -> list[Polygon]:
    """One border of the floor as valid polygons in continuous cell coordinates, mostly one.

    `contour`: (n, 2), indices of the floor's border cells in order, as findContours gives them.
    """
    for finer in (tolerance, tolerance / 2, 1.0):
        corners = cv2.approxPolyDP(contour, finer, True).reshape(-1, 2).astype(np.int32)
        fitted = _straighten(contour, corners, finer, hole) if len(corners) >= 3 else []
        if fitted:
            return fitted
    rough = Polygon(contour + 0.5) if len(contour) >= 3 else shapely.MultiPoint(contour + 0.5).envelope
    grown = shapely.buffer(shapely.make_valid(rough), -0.5 if hole else 0.5, join_style="mitre", cap_style="square")
    return [shapely.simplify(Polygon(p.exterior), 0.5) for p in polygons_in(grown)]


def _straighten(contour: Pixels, corners: Pixels, tolerance: float, hole: bool) -> list[Polygon]:
    """Fits a line to the border cells of each edge, moves it out to the wall's face, and intersects neighbours; nothing where that fails.

    Straight edges on both sides of a thin wall may cross. What both claim is left to the wall, so that it still holds.
    """
    order, at = _in_order(contour, corners)
    if len(at) < 3:
        return []
    points = order.astype(np.float64) + 0.5
    starts = points[at]
    ends = np.roll(starts, -1, axis=0)
    signed = float(np.sum(starts[:, 0] * ends[:, 1] - ends[:, 0] * starts[:, 1]))
    centres, directions = _fit_edges(points, at, (starts + ends) / 2, ends - starts)
    normals = np.stack([directions[:, 1], -directions[:, 0]], 1) * (np.sign(signed) * (-1.0 if hole else 1.0))
    centres = centres + normals * (0.5 * np.abs(normals).max(1, keepdims=True))
    polygon = Polygon(_meet(centres, directions, normals, starts, tolerance))
    parts = [polygon] if polygon.is_valid else polygons_in(shapely.make_valid(polygon))
    missing = abs(sum(part.area for part in parts) - abs(signed) / 2)
    return parts if missing <= 0.5 * polygon.length + 0.1 * abs(signed) else []


def _in_order(contour: Pixels, corners: Pixels) -> tuple[Pixels, npt.NDArray[np.int64]]:
    """The contour turned so that it begins at the first corner, and where in it each corner stands."""
    key = contour[:, 0].astype(np.int64) << 32 | contour[:, 1]
    wanted = corners[:, 0].astype(np.int64) << 32 | corners[:, 1]
    start = int(np.flatnonzero(key == wanted[0])[0])
    key, order = np.roll(key, -start), np.roll(contour, -start, axis=0)
    ranked = np.argsort(key, kind="stable")
    first, last = (np.searchsorted(key[ranked], wanted, side) for side in ("left", "right"))
    found = [0]
    for i in range(1, len(wanted)):
        later = [k for k in ranked[first[i] : last[i]].tolist() if k > found[-1]]
        if later:
            found.append(later[0])
    return order, np.array(found)


def _fit_edges(points: Points, at: npt.NDArray[np.int64], centres: Points, directions: Points) -> tuple[Points, Points]:
    """Least-squares line of the border cells between consecutive corners; too short edges keep the line through their corners."""
    length = np.diff(np.append(at, len(points)))
    trim = np.maximum(1, length // 10)
    begin, end = at + trim, at + length - trim + 1
    x, y = points.T
    moments = np.stack([x, y, x * x, x * y, y * y], 1)
    total = np.concatenate([np.zeros((1, 5)), np.cumsum(np.concatenate([moments, moments[:1]]), axis=0)])
    fit = length >= SHORTEST_FIT
    mean = (total[end] - total[begin])[fit] / (end - begin)[fit, None]
    xx, xy, yy = mean[:, 2] - mean[:, 0] ** 2, mean[:, 3] - mean[:, 0] * mean[:, 1], mean[:, 4] - mean[:, 1] ** 2
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    axis = np.stack([np.cos(angle), np.sin(angle)], 1)
    axis *= np.where((axis * directions[fit]).sum(1, keepdims=True) >= 0, 1.0, -1.0)
    centres, directions = centres.copy(), directions.copy()
    centres[fit], directions[fit] = mean[:, :2], axis
    return centres, directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-9)


def _meet(centres: Points, directions: Points, normals: Points, corners: Points, tolerance: float) -> Points:
    """Corners of a ring of lines: line i - 1 with line i.

    Nearly parallel neighbours that lie apart (the two faces of a wall that ends, or a step) keep the short edge between them.
    """
    before = np.roll(np.arange(len(centres)), 1)
    u, v, gap = directions[before], directions, centres - centres[before]
    sine = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    along = (gap[:, 0] * v[:, 1] - gap[:, 1] * v[:, 0]) / np.where(np.abs(sine) > 1e-6, sine, 1.0)
    crossing = centres[before] + along[:, None] * u
    a = corners - ((corners - centres[before]) * normals[before]).sum(1, keepdims=True) * normals[before]
    b = corners - ((corners - centres) * normals).sum(1, keepdims=True) * normals
    meets = (np.abs(sine) > 0.35) & (np.linalg.norm(crossing - corners, axis=1) < 2.5 * tolerance)
    apart = ~meets & (np.linalg.norm(a - b, axis=1) > STEP)
    first = np.where(meets[:, None], crossing, np.where(apart[:, None], a, (a + b) / 2))
    return as_points(np.stack([first, b], 1)[np.stack([np.ones_like(apart), apart], 1)])


# -- features ------------------------------------------------------------------------------------------------------


def wall_features(
    floor: MultiPolygon, occupied_distance: npt.NDArray[np.float32], frame: GridFrame, version: str, params: Params
) -> tuple[Wall, ...]:
    """The outline as polylines, floor on their left: `wall` within the wall distance of occupied cells, `open` elsewhere.

    `occupied_distance`: (height, width), metres from each cell's centre to the nearest occupied cell's.
    `version` keeps ids apart from other versions'.
    """
    pieces: list[tuple[WallKind, Points]] = []
    for polygon in floor.geoms:
        for ring in (polygon.exterior, *polygon.interiors):
            pieces += _ring_pieces(shapely.get_coordinates(ring), occupied_distance, frame, params)
    return tuple(
        Wall(f"w{version}-{i}", tuple(map(tuple, np.round(line, 4).tolist())), kind)
        for i, (kind, line) in enumerate(pieces, 1)
    )


def _ring_pieces(
    ring: Points, occupied_distance: npt.NDArray[np.float32], frame: GridFrame, params: Params
) -> list[tuple[WallKind, Points]]:
    """A closed ring (n, 2) cut where it changes between wall and open."""
    step = frame.resolution
    lengths = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    stations = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.arange(0.0, stations[-1], step)
    samples = np.stack([np.interp(at, stations, ring[:, k]) for k in (0, 1)], 1)
    runs = look_up(occupied_distance, frame.to_cells_inside(samples), np.inf) <= params.wall_reach_m
    runs &= np.roll(runs, 1) | np.roll(runs, -1)
    if runs.all() or not runs.any():
        return [("wall" if runs[0] else "open", ring)]
    cuts = np.flatnonzero(runs != np.roll(runs, 1))
    kinds = runs[cuts]
    cuts = (cuts - ~kinds) % len(runs)
    around = np.concatenate([stations[:-1], stations + stations[-1]])
    corners = np.concatenate([ring[:-1], ring])
    pieces: list[tuple[WallKind, Points]] = []
    for wall, a, b in zip(kinds.tolist(), cuts.tolist(), np.roll(cuts, -1).tolist(), strict=True):
        end = at[b] if b > a else at[b] + stations[-1]
        inner = corners[(around > at[a] + GRID_M) & (around < end - GRID_M)]
        pieces.append(("wall" if wall else "open", np.concatenate([samples[a : a + 1], inner, samples[b : b + 1]])))
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
    parts = polygons_in(grown) + polygons_in(shapely.box(*np.array(boxes).reshape(-1, 4).T))
    large = [Polygon(p.exterior) for p in parts if p.area * frame.resolution**2 >= params.clutter_shown_m2]
    placed = shapely.transform(np.array(large, dtype=object), lambda p: np.round(frame.to_map(as_points(p)), 4))
    return tuple(Clutter(f"k{version}-{i}", polygon) for i, polygon in enumerate(placed, 1))


def _valid(shapes: list[shapely.Geometry]) -> npt.NDArray[np.object_]:
    made = np.array(shapes, dtype=object)
    broken = ~shapely.is_valid(made)
    made[broken] = shapely.make_valid(made[broken])
    return made


def _shape(points: Points) -> shapely.Geometry:
    if len(points) >= 3:
        return Polygon(points)
    return shapely.LineString(points) if len(points) == 2 else shapely.Point(points[0])
