"""Semantic map transfer (paper, Algorithm 1): the previous map's semantics on a new grid.

Step 1, tracking, is the `Motion`; here are steps 2 to 6. Shapes come from the new grid's walls every time, so that no error adds up.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line, Point, Points, as_line, as_points, as_tuples, polygons_in
from stillroom.maps.grid import GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap
from stillroom.pipeline.dividers import Adrift, attach, centre
from stillroom.pipeline.params import Params
from stillroom.pipeline.rooms import absorb, new_rooms, overlaps, partition, rooms_beside
from stillroom.pipeline.walls import (
    Obstacles,
    clutter_features,
    outline,
    seal_diagonals,
    separate_clutter,
    wall_features,
)

SUBPIXEL = 4
"""Binary digits that OpenCV keeps of a coordinate when it draws."""
RESTS_M = 0.05
"""An end nearer than this to another divider lies on it."""
SEEN_SHARE = 0.5
"""A room counts as visited where this share of it is explored."""
NEW_SHARE = 0.3
"""A piece of floor is new where less than this share of it was a room before."""


@dataclass(frozen=True)
class Transfer:
    """`tracked`: the previous map in the mission's frame; `candidate`: its semantics on the mission's grid."""

    tracked: SemanticMap
    candidate: SemanticMap
    lost_dividers: tuple[str, ...]
    shut_dividers: tuple[str, ...]
    new_rooms: tuple[str, ...]
    visited: frozenset[str]


def track(previous: SemanticMap, motion: Motion, frame: GridFrame) -> SemanticMap:
    """The previous map moved into the frame of a mission, shapes unchanged otherwise."""

    polygons = shapely.transform(
        np.array([room.polygon for room in previous.rooms], dtype=object),
        lambda points: motion.apply(as_points(points)),
    )
    rooms = tuple(
        replace(room, polygon=moved if moved.is_valid else _largest(shapely.make_valid(moved), room.polygon))
        for room, moved in zip(previous.rooms, polygons, strict=True)
    )
    return replace(
        previous,
        frame=frame,
        rooms=rooms,
        dividers=tuple(
            replace(d, line=as_line(line))
            for d, line in zip(previous.dividers, _moved([d.line for d in previous.dividers], motion), strict=True)
        ),
        walls=tuple(
            replace(w, line=as_tuples(line))
            for w, line in zip(previous.walls, _moved([w.line for w in previous.walls], motion), strict=True)
        ),
    )


def _moved(lines: Sequence[Sequence[Point]], motion: Motion) -> list[Points]:
    """Every line moved, all in one go."""
    if not lines:
        return []
    moved = np.round(motion.apply(np.concatenate([as_points(line) for line in lines])), 4)
    return np.split(moved, np.cumsum([len(line) for line in lines])[:-1])


def _largest(geometry: shapely.Geometry, otherwise: Polygon) -> Polygon:
    return max(polygons_in(geometry), key=lambda polygon: polygon.area, default=otherwise)


def transfer_semantics(tracked: SemanticMap, grid: OccupancyGrid, mission_id: str, params: Params) -> Transfer:
    """Steps 2 to 6: obstacles into wall and clutter, walls, divider ends, rooms."""
    shut = tuple(d.id for d in tracked.dividers if _is_shut(d.line, grid, params))
    obstacles = classify_obstacles(tracked, grid, shut, params)
    floor = _worth(outline(obstacles.floor, grid.frame, params, smallest_m2=params.face_area_m2), tracked, params)
    dividers, lost = _attach_dividers(tracked.dividers, floor, params)
    pieces = partition(floor, [d.line for d in dividers], params.face_area_m2)
    visited = _visited(tracked, grid)
    rooms, fresh, ids = _identify(tracked, pieces, visited, mission_id, tracked.ids, params)
    beside = rooms_beside([d.line for d in dividers], [room.polygon for room in rooms])
    (version,), ids = ids.take("v")
    candidate = replace(
        tracked,
        rooms=rooms,
        dividers=tuple(
            replace(d, rooms=tuple(rooms[i].id for i in sides)) for d, sides in zip(dividers, beside, strict=True)
        ),
        walls=wall_features(floor, grid.occupied_distance, grid.frame, version[1:], params),
        clutter=clutter_features(obstacles.clutter, grid.frame, version[1:], params),
        ids=ids,
    )
    return Transfer(tracked, candidate, lost, shut, fresh, visited)


def _worth(floor: MultiPolygon, tracked: SemanticMap, params: Params) -> MultiPolygon:
    """The parts of the floor that were rooms or are large enough to become one."""
    parts = polygons_in(floor)
    known = overlaps(parts, [room.polygon for room in tracked.rooms]).sum(1)
    return MultiPolygon(
        [
            part
            for part, before in zip(parts, known.tolist(), strict=True)
            if part.area >= params.room_area_m2 or before >= NEW_SHARE * part.area
        ]
    )


# -- steps 2 to 4: obstacles ---------------------------------------------------------------------------------------


def classify_obstacles(tracked: SemanticMap, grid: OccupancyGrid, shut: Sequence[str], params: Params) -> Obstacles:
    """Obstacles near a tracked room boundary are wall, those inside tracked rooms are clutter; the others are judged by their shape.

    What the robot did not see inside a tracked room still is floor; a shut door is an obstacle that moves, not a wall.
    """
    frame, cell = grid.frame, grid.frame.resolution
    inside = _filled([room.polygon for room in tracked.rooms], frame)
    boundary = [as_points(wall.line) for wall in tracked.walls]
    near = _band(boundary, params.wall_classification_m, frame)
    doors = _filled([_doorway(d.line, params.door_thickness_m) for d in tracked.dividers if d.id in shut], frame)
    wall = grid.occupied & (near | ~inside) & ~doors
    wall &= ~_furniture(grid.occupied & inside, near, _band(boundary, params.wall_offset_m, frame), params, cell)
    floor = grid.free.copy()
    if (floor & ~inside & ~near).sum() * cell**2 > params.floor_speck_m2:
        beyond = separate_clutter(grid, params).floor & ~inside & ~near
        floor |= beyond
        wall &= ~beyond
    wall |= _bridged(boundary, wall, frame, params)
    wall &= ~(_spurs(wall, params.wall_spur_m / cell) & (near | inside))
    floor &= ~wall
    unseen = grid.unexplored & inside & ~wall
    rim = unseen & _band(boundary, params.outline_margin_m, frame)
    unseen &= ~rim
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for _ in range(2 * round(params.outline_margin_m / cell) + 2):
        unseen |= (cv2.dilate(unseen.view(np.uint8), cross) > 0) & rim
    floor |= (grid.occupied & ~wall & (inside | near)) | unseen
    return Obstacles(wall, grid.occupied & ~wall & inside, seal_diagonals(floor))


def _filled(polygons: Sequence[Polygon], frame: GridFrame) -> Mask:
    """Cells whose centre lies in one of the polygons."""
    mask = np.zeros((frame.height, frame.width), np.uint8)
    # OpenCV fills every cell that the edge touches: half a cell less keeps shapes from growing mission by mission
    for polygon in polygons_in(shapely.buffer(list(polygons), -frame.resolution / 2, join_style="mitre")):
        rings = [_drawn(shapely.get_coordinates(ring), frame) for ring in (polygon.exterior, *polygon.interiors)]
        hollow = np.zeros_like(mask) if len(rings) > 1 else mask
        cv2.fillPoly(hollow, rings, 1, shift=SUBPIXEL)
        mask |= hollow
    return mask > 0


def _band(lines: Sequence[Points], reach_m: float, frame: GridFrame) -> Mask:
    """Cells within `reach_m` of one of the lines."""
    mask = np.zeros((frame.height, frame.width), np.uint8)
    thickness = max(1, 2 * round(reach_m / frame.resolution) + 1)
    cv2.polylines(mask, [_drawn(line, frame) for line in lines], False, 1, thickness, shift=SUBPIXEL)
    return mask > 0


def _drawn(points: Points, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Map coordinates as OpenCV draws them: fixed point, cell centres at whole numbers."""
    return np.round((frame.to_cells(points) - 0.5) * (1 << SUBPIXEL)).astype(np.int32)


def _spurs(mask: Mask, cells: float) -> Mask:
    """Components of `mask` shorter than `cells`: edges of cupboards that touch a wall, not walls."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    short = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) < cells
    short[0] = False
    return np.asarray(short[labels])


def _furniture(obstacles: Mask, near: Mask, along: Mask, params: Params, cell: float) -> Mask:
    """Of the obstacles inside rooms those that are no wall: what stands off the walls and is short, or reaches on into the room.

    `along` is the band of cells in which walls are expected. What touches furniture there belongs to it, or else the slice of a cupboard
    that is next to the wall would become wall, and with the next mission the next slice.
    """
    _, labels, stats, _ = cv2.connectedComponentsWithStats((obstacles & ~along).view(np.uint8), connectivity=8)
    longest = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    large = np.zeros(len(stats), bool)
    large[labels[obstacles & ~along & ~near]] = True
    small = (longest < params.wall_spur_m / cell) & ~large
    large[0] = small[0] = False
    reach = 2 * (round(params.wall_offset_m / cell) + 1) + 1
    grown = cv2.dilate(large[labels].view(np.uint8), np.ones((reach, reach), np.uint8)) > 0
    return np.asarray(small[labels] | (grown & obstacles))


def _bridged(boundary: Sequence[Points], wall: Mask, frame: GridFrame, params: Params) -> Mask:
    """Gaps in walls that were whole, closed where every point still lies within the wall distance of an obstacle (paper, Table I)."""
    drawn = np.zeros(wall.shape, np.uint8)
    longest = 2 * params.wall_reach_m + frame.resolution
    for line in boundary:
        cells = frame.to_cells(line)
        stations = shapely.get_coordinates(shapely.segmentize(shapely.LineString(cells), 1.0))
        along = np.gradient(stations, axis=0)
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        hit, place = _nearest_wall(
            stations, np.stack([along[:, 1], -along[:, 0]], 1), wall, params.wall_classification_m / frame.resolution
        )
        found = np.flatnonzero(hit)
        for a, b in pairwise(found.tolist()):
            if b > a + 1 and np.hypot(*(place[b] - place[a])) * frame.resolution <= longest:
                cv2.line(drawn, place[a].tolist(), place[b].tolist(), 1, 1)
    return drawn > 0


def _nearest_wall(stations: Points, normals: Points, wall: Mask, cells: float) -> tuple[Mask, npt.NDArray[np.int64]]:
    """For each station whether a wall cell lies within `cells` along the normal, and which is the nearest: (n,) and (n, 2)."""
    steps = np.arange(-np.ceil(cells), np.ceil(cells) + 1)
    steps = steps[np.argsort(np.abs(steps), kind="stable")]
    at = stations[:, None] + steps[None, :, None] * normals[:, None]
    seen = look_up(wall, at, False)
    first = seen.argmax(1)
    return np.asarray(seen.any(1)), np.floor(at[np.arange(len(at)), first]).astype(np.int64)


def _doorway(line: Line, reach_m: float) -> Polygon:
    """The rectangle `reach_m` to both sides of a divider, no longer than it."""
    return shapely.buffer(shapely.LineString(line), reach_m, cap_style="flat")


def _is_shut(line: Line, grid: OccupancyGrid, params: Params) -> bool:
    """Whether obstacles cover most of a divider."""
    ends = as_points(line)
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    if length < grid.frame.resolution:
        return False
    normal = np.array([-along[1], along[0]]) / length
    cell = grid.frame.resolution
    stations = ends[0] + np.linspace(0.1, 0.9, max(3, round(length / cell)))[:, None] * along
    depth = np.arange(-params.door_thickness_m, params.door_thickness_m + cell / 2, cell)
    at = stations[:, None] + depth[None, :, None] * normal
    covered = look_up(grid.occupied, grid.frame.to_cells(at.reshape(-1, 2)).reshape(at.shape), False)
    return float(covered.any(1).mean()) > params.door_cover


# -- steps 5 and 6: dividers and rooms -----------------------------------------------------------------------------


def _attach_dividers(
    dividers: Sequence[Divider], floor: MultiPolygon, params: Params
) -> tuple[tuple[Divider, ...], tuple[str, ...]]:
    """Dividers with their ends on the new walls, and the ids of those that find none. Those that end on others come after these."""
    placed: dict[str, Divider] = {}
    lost: list[str] = []
    waiting = [d.id for d in dividers]
    resting = _resting(dividers)
    by_id = {d.id: d for d in dividers}
    while waiting:
        now = next((d for d in waiting if not any(o in waiting for o in resting[d])), waiting[0])
        waiting.remove(now)
        others = [placed[o].line for o in placed]
        found = attach(by_id[now].line, floor, others, params.transfer_reach_m, tracked=True)
        if isinstance(found, Adrift):
            lost.append(now)
        else:
            placed[now] = replace(by_id[now], line=centre(found.line, floor))
    return tuple(placed[d.id] for d in dividers if d.id in placed), tuple(lost)


def _resting(dividers: Sequence[Divider]) -> dict[str, list[str]]:
    """For each divider those on which one of its ends lies."""
    if not dividers:
        return {}
    ends = shapely.points(np.array([d.line for d in dividers]))
    gaps = shapely.distance(ends[..., None], shapely.linestrings(np.array([d.line for d in dividers]))).min(1)
    np.fill_diagonal(gaps, np.inf)
    return {d.id: [dividers[j].id for j in np.flatnonzero(gaps[i] < RESTS_M).tolist()] for i, d in enumerate(dividers)}


def _visited(tracked: SemanticMap, grid: OccupancyGrid) -> frozenset[str]:
    """Rooms that are explored for the most part."""
    drawn = np.zeros(grid.cells.shape, np.uint16)
    for number, room in enumerate(tracked.rooms, 1):
        cv2.fillPoly(
            drawn, [_drawn(shapely.get_coordinates(room.polygon.exterior), grid.frame)], number, shift=SUBPIXEL
        )
    seen = np.bincount(drawn[~grid.unexplored], minlength=len(tracked.rooms) + 1) * grid.frame.resolution**2
    return frozenset(
        room.id for number, room in enumerate(tracked.rooms, 1) if seen[number] >= SEEN_SHARE * room.polygon.area
    )


def _identify(
    tracked: SemanticMap, pieces: Sequence[Polygon], visited: frozenset[str], mission_id: str, ids: Ids, params: Params
) -> tuple[tuple[Room, ...], tuple[str, ...], Ids]:
    """Gives each piece of floor to the room it was: by overlap, the largest piece to its room. What is left is a new room, or joins a neighbour."""
    common = overlaps([room.polygon for room in tracked.rooms], pieces)
    shapes: dict[str, Polygon] = {}
    taken: set[int] = set()
    owner = common.argmax(0) if len(tracked.rooms) else np.zeros(len(pieces), int)
    for i, room in enumerate(tracked.rooms):
        mine = [j for j in range(len(pieces)) if owner[j] == i and common[i, j] > 0]
        if mine:
            best = max(mine, key=lambda j: common[i, j])
            shapes[room.id] = pieces[best]
            taken.add(best)
    rest = [j for j in range(len(pieces)) if j not in taken]
    large = [j for j in rest if pieces[j].area >= params.room_area_m2]
    names = list(shapes)
    joined = absorb([shapes[name] for name in names], [pieces[j] for j in rest if j not in large])
    shapes.update(zip(names, joined, strict=True))
    kept = tuple(
        replace(room, polygon=shapes[room.id], last_visited=mission_id if room.id in visited else room.last_visited)
        for room in tracked.rooms
        if room.id in shapes
    )
    fresh, ids = new_rooms([pieces[j] for j in large], mission_id, ids)
    parents = [tracked.rooms[owner[j]].id if common[:, j].sum() >= NEW_SHARE * pieces[j].area else None for j in large]
    fresh = tuple(replace(room, derived_from=parent) for room, parent in zip(fresh, parents, strict=True))
    return kept + fresh, tuple(room.id for room in fresh), ids
