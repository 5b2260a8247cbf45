"""A first map with the rooms that the robot's own app already has: dividers where its segments meet, rooms between walls and those.

The robot's segments are cells; ours are polygons that walls and dividers enclose. Where two segments meet on the floor, the border
between them is straightened into dividers. Rooms then come from `partition` as everywhere, and take the name of the segment that
fills most of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import GRID_M, Line, Points, as_line, as_points
from stillroom.maps.grid import GridFrame, Mask, OccupancyGrid
from stillroom.maps.semantics import Ids, Restriction, Room, SemanticMap
from stillroom.pipeline.cells import cells_in, nearest_cells
from stillroom.pipeline.creation import create_map, new_dividers
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.restrictions import faults_of
from stillroom.pipeline.rooms import new_rooms, partition, rooms_beside
from stillroom.pipeline.walls import clutter_features, outline, separate_clutter, wall_features

Labels = npt.NDArray[np.int32]
"""Shape (height, width), 0 where there is no segment; row 0 is the lowest y."""
Corner = tuple[int, int]

TOUCH_M = 0.005
SHORTEST_M = 0.03
"""Pieces of a divider that walls leave over and that are shorter than this are dropped."""


@dataclass(frozen=True, eq=False)
class RobotSemantics:
    """What the robot's app says about its map: segment k + 1 of `labels` is called `names[k]` (None: nobody named it)."""

    labels: Labels
    names: tuple[str | None, ...] = ()
    restrictions: tuple[Restriction, ...] = ()
    """Without ids."""

    @property
    def has_rooms(self) -> bool:
        return bool((self.labels > 0).any())


def adopt_map(
    grid: OccupancyGrid, semantics: RobotSemantics | None, mission_id: str, ids: Ids, params: Params = PARAMS
) -> SemanticMap:
    """A first map from `grid` with the robot's rooms, names and restrictions; its rooms by algorithm where the robot has none."""
    if semantics is None:
        return create_map(grid, mission_id, ids, params)
    if semantics.has_rooms:
        made = create_map_from_segments(grid, semantics.labels, semantics.names, mission_id, ids, params)
    else:
        made = create_map(grid, mission_id, ids, params)
    fresh, ids = made.ids.take("z", len(semantics.restrictions))
    restrictions = tuple(
        replace(r, id=key, placed=faults_of(r.kind, as_points(r.shape), grid.frame) is None)
        for key, r in zip(fresh, semantics.restrictions, strict=True)
    )
    return replace(made, restrictions=restrictions, ids=ids)


def create_map_from_segments(
    grid: OccupancyGrid,
    labels: Labels,
    names: Sequence[str | None],
    mission_id: str,
    ids: Ids,
    params: Params = PARAMS,
) -> SemanticMap:
    """Walls and clutter as `create_map` finds them, rooms as `labels` (height, width) has them as far as the walls allow.

    A segment that walls part becomes several rooms; floor without a segment joins the nearest one, or is a room of its own where it
    is as large as one.
    """
    obstacles = separate_clutter(grid, params)
    floor = outline(obstacles.floor, grid.frame, params, smallest_m2=params.pocket_area_m2)
    inside = cells_in(floor.geoms, grid.frame)
    filled = _fill(labels, inside, grid.frame.resolution, params)
    lines = _dividers(floor, inside, filled, grid.frame, params)
    polygons = partition(floor, lines, params.face_area_m2)
    polygons, lines = _drop_needless(floor, polygons, lines, filled, grid.frame, params)
    rooms, ids = new_rooms(polygons, mission_id, ids)
    rooms = _named(rooms, _label_of(polygons, filled, grid.frame), names)
    dividers, ids = new_dividers(lines, rooms, ids)
    (version,), ids = ids.take("v")
    return SemanticMap(
        frame=grid.frame,
        rooms=rooms,
        dividers=dividers,
        walls=wall_features(floor, grid.near_occupied(params.wall_reach_m), grid.frame, version[1:]),
        clutter=clutter_features(obstacles.clutter, grid.frame, version[1:], params),
        ids=ids,
    )


# -- cells ---------------------------------------------------------------------------------------------------------


def _fill(labels: Labels, inside: Mask, resolution: float, params: Params) -> Labels:
    """A label for every cell of the floor: its own, that of the nearest segment, or a new one where as much as a room has none."""
    known = np.where(inside, labels, 0).astype(np.int32)
    _drop_crumbs(known, params.face_area_m2 / resolution**2)
    count, open_, stats, _ = cv2.connectedComponentsWithStats((inside & (known == 0)).view(np.uint8), connectivity=4)
    large = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] * resolution**2 >= params.room_area_m2)
    new = np.zeros(count, np.int32)
    large = large[large > 0]
    new[large] = max(int(labels.max()), 0) + 1 + np.arange(len(large))
    known = np.where(known > 0, known, new[open_])
    if not known.any():
        return known
    _, nearest = cv2.distanceTransformWithLabels(
        (known == 0).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_zone = np.zeros(int(nearest.max()) + 1, np.int32)
    of_zone[nearest[known > 0]] = known[known > 0]
    return np.asarray(np.where(inside, of_zone[nearest], 0))


def _drop_crumbs(labels: Labels, cells: float) -> None:
    """Forgets the label of all connected parts of a segment that are smaller than `cells`."""
    place = np.flatnonzero(labels)
    value = labels.flat[place]
    order = np.argsort(value, kind="stable")
    for mine in np.split(place[order], np.flatnonzero(np.diff(value[order])) + 1):
        if not len(mine):
            continue
        rows, columns = np.divmod(mine, labels.shape[1])
        box = labels[rows[0] : rows[-1] + 1, columns.min() : columns.max() + 1]
        mask = (box == labels.flat[mine[0]]).view(np.uint8)
        _, parts, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
        small = stats[:, cv2.CC_STAT_AREA] < cells
        small[0] = False
        box[small[parts]] = 0


# -- dividers ------------------------------------------------------------------------------------------------------


def _dividers(floor: MultiPolygon, inside: Mask, labels: Labels, frame: GridFrame, params: Params) -> tuple[Line, ...]:
    """The borders between labels, straightened, from wall to wall or to another border."""
    chains = _borders(floor, inside, labels, frame)
    if not chains:
        return ()
    ends: dict[Corner, int] = {}
    for chain in chains:
        for end in (chain[0], chain[-1]):
            ends[_corner(end)] = ends.get(_corner(end), 0) + 1
    walls = shapely.boundary(floor)
    meeting = {corner: _meeting(corner, walls, frame) for corner, count in ends.items() if count > 1}
    tolerance = params.outline_tolerance_m / frame.resolution
    lines: list[Line] = []
    for chain in chains:
        simple = shapely.get_coordinates(shapely.simplify(LineString(chain), tolerance))
        traced = frame.to_map(simple)
        points = traced.copy()
        for end, inner in ((0, 1), (-1, -2)):
            corner = _corner(simple[end])
            if corner in meeting:
                points[end] = meeting[corner]
            else:
                points[end] = _on_wall(traced[inner], traced[end], walls, params.divider_reach_m)
        lines += _clipped(np.round(points, 3), floor)
    return tuple(lines)


def _borders(floor: MultiPolygon, inside: Mask, labels: Labels, frame: GridFrame) -> list[Points]:
    """Between each two labels the chains of cell sides that part them, each (n, 2) in cell coordinates.

    Sides that lie in a wall between the two cells are left out: rooms there are apart already.
    """
    sides, pairs, links = [], [], []
    for step in (np.array([0, 1]), np.array([1, 0])):
        a = labels[: labels.shape[0] - step[0], : labels.shape[1] - step[1]]
        b = labels[step[0] :, step[1] :]
        both = inside[: a.shape[0], : a.shape[1]] & inside[step[0] :, step[1] :]
        here = np.argwhere(both & (a != b))
        there = here + step
        sides.append(np.stack([there, there + 1 - step], 1)[..., ::-1])
        links.append(np.stack([here, there], 1)[..., ::-1] + 0.5)
        values = np.stack([labels[tuple(here.T)], labels[tuple(there.T)]], 1)
        pairs.append(np.sort(values, axis=1))
    side, pair, link = np.concatenate(sides), np.concatenate(pairs), np.concatenate(links)
    if not len(side):
        return []
    crossing = shapely.linestrings(frame.to_map(link.reshape(-1, 2).astype(np.float64)).reshape(-1, 2, 2))
    walls = shapely.boundary(floor)
    shapely.prepare(walls)
    clear = ~shapely.intersects(walls, crossing)
    side, pair = side[clear], pair[clear]
    chains: list[Points] = []
    for one in np.unique(pair, axis=0):
        mine = side[(pair == one).all(1)]
        merged = shapely.line_merge(shapely.multilinestrings(shapely.linestrings(mine.astype(np.float64))))
        chains += [shapely.get_coordinates(part) for part in shapely.get_parts(merged)]
    return chains


def _corner(point: Points) -> Corner:
    return round(float(point[0])), round(float(point[1]))


def _meeting(corner: Corner, walls: shapely.Geometry, frame: GridFrame) -> Points:
    """Where borders meet: on the wall if that is next to it."""
    point = frame.to_map(as_points([corner]))
    near = _nearest(point[0], walls)
    close = float(np.hypot(*(near - point[0]))) < 1.5 * frame.resolution
    chosen: Points = near if close else point[0]
    return chosen


def _nearest(point: Points, walls: shapely.Geometry) -> Points:
    """The nearest place on `walls`, shape (2,)."""
    nearest: Points = shapely.get_coordinates(shapely.shortest_line(shapely.Point(point), walls))[1]
    return nearest


def _on_wall(inner: Points, end: Points, walls: shapely.Geometry, reach_m: float) -> Points:
    """The end moved along the border's last stretch to the nearest wall, else to the nearest wall at all."""
    along = end - inner
    length = float(np.hypot(*along))
    along = along / length
    ray = LineString([inner + min(length / 2, GRID_M) * along, end + reach_m * along])
    met = shapely.get_coordinates(shapely.intersection(ray, walls))
    if len(met):
        nearest = met[np.abs((met - end) @ along).argmin()]
        if float(np.hypot(*(nearest - end))) <= reach_m:
            return np.asarray(nearest)
    return _nearest(end, walls)


def _clipped(points: Points, floor: MultiPolygon) -> list[Line]:
    """The stretches of a polyline on the floor, each a line of two points."""
    stretches = shapely.linestrings(np.stack([points[:-1], points[1:]], 1))
    parts = shapely.get_parts(shapely.intersection(stretches, floor))
    long = [part for part in parts if isinstance(part, LineString) and part.length >= SHORTEST_M]
    return [as_line(np.round(shapely.get_coordinates(part)[[0, -1]], 3)) for part in long]


def _drop_needless(
    floor: MultiPolygon,
    polygons: Sequence[Polygon],
    lines: Sequence[Line],
    labels: Labels,
    frame: GridFrame,
    params: Params,
) -> tuple[tuple[Polygon, ...], tuple[Line, ...]]:
    """Without dividers that have one segment on both sides, or an end in mid-air."""
    while True:
        label = _label_of(polygons, labels, frame)
        sides = rooms_beside(lines, polygons)
        loose = _loose(lines, floor)
        kept = tuple(
            line
            for line, beside, adrift in zip(lines, sides, loose, strict=True)
            if len({label[i] for i in beside}) > 1 and not adrift
        )
        if len(kept) == len(lines):
            return tuple(polygons), kept
        lines = kept
        polygons = partition(floor, lines, params.face_area_m2)


def _loose(lines: Sequence[Line], floor: MultiPolygon) -> list[bool]:
    walls = shapely.boundary(floor)
    shapes = shapely.linestrings(np.array(lines)) if lines else np.zeros(0, object)
    loose = []
    for i, line in enumerate(lines):
        others = [walls, *shapes[:i], *shapes[i + 1 :]]
        gaps = shapely.distance(shapely.points(np.array(line))[:, None], np.array(others, dtype=object)[None])
        loose.append(bool((gaps.min(1) > TOUCH_M).any()))
    return loose


# -- rooms ---------------------------------------------------------------------------------------------------------


def _label_of(polygons: Sequence[Polygon], labels: Labels, frame: GridFrame) -> list[int]:
    """The label that fills most of each polygon."""
    found = []
    for polygon in polygons:
        rings = [nearest_cells(shapely.get_coordinates(ring), frame) for ring in shapely.get_rings(polygon)]
        (x0, y0), (x1, y1) = np.maximum(rings[0].min(0), 0).tolist(), (rings[0].max(0) + 1).tolist()
        seen = labels[y0:y1, x0:x1]
        mask = np.zeros(seen.shape, np.uint8)
        cv2.fillPoly(mask, [ring - (x0, y0) for ring in rings], 1)
        found.append(int(np.bincount(seen[(mask > 0) & (seen > 0)], minlength=1).argmax()))
    return found


def _named(rooms: Sequence[Room], label_of: Sequence[int], names: Sequence[str | None]) -> tuple[Room, ...]:
    """Rooms with their segment's name; of several from one segment the largest, which comes first, the others numbered."""
    named: list[Room] = []
    count: dict[int, int] = {}
    for room, label in zip(rooms, label_of, strict=True):
        name = names[label - 1] if 1 <= label <= len(names) else None
        count[label] = count.get(label, 0) + 1
        if name is not None:
            name = name if count[label] == 1 else f"{name} {count[label]}"
            room = replace(room, name=name, named_by="user")
        named.append(room)
    return tuple(named)
