"""Semantic map transfer (paper, Algorithm 1): the previous map's semantics on a new grid.

Step 1, tracking, is the `Motion`; here are steps 2 to 6. Shapes come from the new grid's walls every time, so that no error adds up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line, Point, Points, as_line, as_points, as_tuples, line_strings, polygons_in
from stillroom.maps.grid import GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.meta import MapMeta, MetaDivider
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap, Wall
from stillroom.pipeline.anchor import carry_anchors
from stillroom.pipeline.dividers import Adrift, Outline, attach, attach_path, centre
from stillroom.pipeline.obstacles import SUBPIXEL, are_shut, classify_obstacles, corrected, drawn, filled, room_cells
from stillroom.pipeline.params import Params
from stillroom.pipeline.phantoms import carry_phantoms, without_phantoms
from stillroom.pipeline.rooms import absorb, most_common, new_rooms, partition, rooms_beside
from stillroom.pipeline.walls import Obstacles, clutter_features, outline, wall_features

RESTS_M = 0.05
"""An end nearer than this to another divider lies on it."""
SEEN_SHARE = 0.5
"""A room counts as visited where this share of it is explored."""
KNOWN_M = 0.4
"""The boundary of new floor that is nearer than this to a room borders on it."""
NEW_SHARE = 0.3
"""A piece of floor is new where less than this share of it was a room before."""


@dataclass(frozen=True)
class Transfer:
    """`tracked`: the previous map in the mission's frame; `candidate`: its semantics on the mission's `grid`, meta-occupancy included."""

    tracked: SemanticMap
    candidate: SemanticMap
    grid: OccupancyGrid
    before: Mask
    """The cells of the tracked rooms."""
    obstacles: Obstacles
    floor: MultiPolygon
    """What the candidate's rooms are cut from."""
    lost_dividers: tuple[str, ...]
    shut_dividers: tuple[str, ...]
    new_rooms: tuple[str, ...]
    visited: frozenset[str]
    common: Mapping[str, float]
    """Square metres that each previous room and the room that it is now have in common."""


def track(previous: SemanticMap, motion: Motion, frame: GridFrame) -> SemanticMap:
    """The previous map moved into the frame of a mission, shapes unchanged otherwise."""

    polygons = shapely.transform(
        np.array([room.polygon for room in previous.rooms], dtype=object),
        lambda points: motion.apply(as_points(points)),
    )
    rooms = tuple(
        replace(
            room, polygon=moved if moved.is_valid else _largest(shapely.make_valid(moved), room.polygon), anchor=anchor
        )
        for room, moved, anchor in zip(previous.rooms, polygons, carry_anchors(previous.rooms, motion), strict=True)
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
        phantoms=carry_phantoms(previous.phantoms, motion),
    )


def _moved(lines: Sequence[Sequence[Point]], motion: Motion) -> list[Points]:
    """Every line moved, all in one go."""
    if not lines:
        return []
    moved = np.round(motion.apply(as_points(list(chain.from_iterable(lines)))), 4)
    return np.split(moved, np.cumsum([len(line) for line in lines])[:-1])


def _largest(geometry: shapely.Geometry, otherwise: Polygon) -> Polygon:
    return max(polygons_in(geometry), key=lambda polygon: polygon.area, default=otherwise)


def transfer_semantics(
    tracked: SemanticMap,
    grid: OccupancyGrid,
    mission_id: str,
    params: Params,
    meta: MapMeta = MapMeta.EMPTY,
    drawn_in: Sequence[Divider] = (),
) -> Transfer:
    """Steps 2 to 6: obstacles into wall and clutter, walls, divider ends, rooms.

    `meta` corrects the grid and cuts the floor; `drawn_in` are new dividers, whose ids are given here.
    """
    fresh_ids, ids = tracked.ids.take("d", len(drawn_in))
    found = tuple(replace(divider, id=id_) for id_, divider in zip(fresh_ids, drawn_in, strict=True))
    sensed = without_phantoms(grid, tracked.phantoms)
    grid = corrected(sensed, meta.occupancy)
    is_shut = are_shut([d.line for d in tracked.dividers], sensed, params)
    shut = tuple(d.id for d, cannot_pass in zip(tracked.dividers, is_shut, strict=True) if cannot_pass)
    meta_walls = [o.polygon for o in meta.occupancy if o.cell == "occupied"]
    before = room_cells(tracked, grid.frame)
    obstacles = classify_obstacles(tracked, before, grid, shut, params, meta_walls)
    whole = outline(obstacles.floor, grid.frame, params, smallest_m2=params.face_area_m2)
    floor = _worth(whole, tracked, before, grid, params)
    border = Outline(floor)
    dividers, lost = _attach_dividers((*tracked.dividers, *found), tracked.walls, border, params)
    meta = replace(meta, dividers=_attach_meta(meta.dividers, dividers, border, params))
    lines = [d.line for d in dividers] + [d.line for d in meta.dividers]
    pieces = partition(floor, lines, params.face_area_m2)
    visited = _visited(tracked, sensed)
    rooms, fresh, ids, common = _identify(tracked, pieces, sensed, visited, mission_id, ids, params)
    beside = [tuple(rooms[i].id for i in sides) for sides in rooms_beside(lines, [room.polygon for room in rooms])]
    (version,), ids = ids.take("v")
    near_walls = grid.near_occupied(params.wall_reach_m)
    candidate = replace(
        tracked,
        rooms=rooms,
        dividers=tuple(
            replace(d, rooms=ids_)
            for d, ids_ in zip(dividers, beside[: len(dividers)], strict=True)
            if d.id not in fresh_ids or len(ids_) > 1
        ),
        walls=_remembered(wall_features(floor, near_walls, grid.frame, version[1:]), tracked, params),
        clutter=clutter_features(obstacles.clutter, grid.frame, version[1:], params),
        meta=replace(
            meta,
            dividers=tuple(
                replace(d, rooms=ids_) for d, ids_ in zip(meta.dividers, beside[len(dividers) :], strict=True)
            ),
        ),
        ids=ids,
    )
    lost = tuple(d for d in lost if d not in fresh_ids)
    return Transfer(tracked, candidate, grid, before, obstacles, floor, lost, shut, fresh, visited, common)


def _worth(
    floor: MultiPolygon, tracked: SemanticMap, before: Mask, grid: OccupancyGrid, params: Params
) -> MultiPolygon:
    """The parts of the floor that were rooms, the cells `before`, or are large enough and enclosed enough to become one."""

    def is_known(part: Polygon) -> bool:
        cells = filled([part], grid.frame)
        return bool(np.count_nonzero(cells & before) >= NEW_SHARE * np.count_nonzero(cells))

    def is_room(part: Polygon) -> bool:
        return part.area >= params.room_area_m2 and enclosure(part, tracked, grid, params) >= params.room_enclosure

    return MultiPolygon([part for part in polygons_in(floor) if is_known(part) or is_room(part)])


def _remembered(walls: Sequence[Wall], tracked: SemanticMap, params: Params) -> tuple[Wall, ...]:
    """Walls of which the open ones that were walls before are told apart: the mission did not look there."""
    open_ = [wall for wall in walls if wall.kind == "open"]
    if not open_:
        return tuple(walls)
    lines = line_strings([wall.line for wall in open_])
    before = line_strings([wall.line for wall in tracked.walls if wall.kind != "open"])
    near = _near(before, shapely.multilinestrings(lines), params.wall_reach_m)
    band = shapely.buffer(near, params.wall_reach_m, cap_style="flat", quad_segs=2)
    hidden = shapely.length(shapely.intersection(lines, band)) > SEEN_SHARE * shapely.length(lines)
    unseen = {wall.id for wall, is_unseen in zip(open_, hidden, strict=True) if is_unseen}
    return tuple(replace(wall, kind="unseen") if wall.id in unseen else wall for wall in walls)


def _near(lines: npt.NDArray[np.object_], what: shapely.Geometry, reach_m: float) -> shapely.Geometry:
    """Of polylines the parts within reach, whole edges."""
    points, line = shapely.get_coordinates(lines, return_index=True)
    edges = np.stack([points[:-1], points[1:]], 1)[np.diff(line) == 0]
    edges = shapely.linestrings(edges)
    return shapely.line_merge(shapely.multilinestrings(edges[shapely.dwithin(edges, what, reach_m)]))


def enclosure(region: Polygon, tracked: SemanticMap, grid: OccupancyGrid, params: Params) -> float:
    """Share of a region's boundary that lies on walls, of what does not border tracked rooms."""
    rooms = np.array([room.polygon for room in tracked.rooms], dtype=object)
    known = shapely.buffer(rooms[shapely.dwithin(rooms, region, KNOWN_M)], KNOWN_M)
    samples = shapely.get_coordinates(shapely.segmentize(region.exterior, grid.frame.resolution))
    foreign = ~shapely.contains_xy(shapely.union_all(known), samples)
    if not foreign.any():
        return 1.0
    near_walls = grid.near_occupied(params.wall_reach_m)
    return float(look_up(near_walls, grid.frame.to_cells_inside(samples[foreign]), False).mean())


# -- steps 5 and 6: dividers and rooms -----------------------------------------------------------------------------


def _attach_dividers(
    dividers: Sequence[Divider], walls: Sequence[Wall], border: Outline, params: Params
) -> tuple[tuple[Divider, ...], tuple[str, ...]]:
    """Dividers with their ends on the new walls, and the ids of those that find none. `walls`: as they were tracked.

    Those that end on others come after these; those that meet end to end away from walls, as accepted meta-dividers do, keep their corners.
    """
    placed: dict[str, Divider] = {}
    lost: list[str] = []
    waiting = [d.id for d in dividers]
    resting = _resting(dividers)
    by_id = {d.id: d for d in dividers}
    ends = [end for d in dividers for end in d.line]
    if len(set(ends)) < len(ends):
        lines = shapely.multilinestrings(line_strings([wall.line for wall in walls]))
        on_walls = shapely.intersects_xy(shapely.buffer(lines, RESTS_M, quad_segs=2), as_points(ends))
        ends = [end for end, is_on_wall in zip(ends, on_walls, strict=True) if not is_on_wall]
    while waiting:
        now = next((d for d in waiting if not any(o in waiting for o in resting[d])), waiting[0])
        waiting.remove(now)
        others = [placed[o].line for o in placed]
        line = by_id[now].line
        if any(meets := _corners(line, ends)):
            found = _attach_chained(line, meets, border, others, params)
        else:
            attached = attach(line, border, others, params.transfer_reach_m, tracked=True)
            found = None if isinstance(attached, Adrift) else centre(attached.line, border)
        if found is None:
            lost.append(now)
        else:
            placed[now] = replace(by_id[now], line=found)
    return tuple(placed[d.id] for d in dividers if d.id in placed), tuple(lost)


def _attach_meta(
    meta: Sequence[MetaDivider], dividers: Sequence[Divider], border: Outline, params: Params
) -> tuple[MetaDivider, ...]:
    """Meta-dividers whose ends, where no two of them meet, are moved to the nearest wall or divider; without those that find none."""
    placed: list[MetaDivider] = []
    ends = [end for d in meta for end in d.line]
    lines = [d.line for d in dividers]
    for d in meta:
        line = _attach_chained(d.line, _corners(d.line, ends), border, lines, params)
        if line is not None:
            placed.append(replace(d, line=line))
    return tuple(placed)


def _corners(line: Line, ends: Sequence[Point]) -> list[bool]:
    """Which ends of a line are the end of another one too; `ends` are those of all lines."""
    return [ends.count(end) > 1 for end in line]


def _attach_chained(
    line: Line, meets: list[bool], border: Outline, others: Sequence[Line], params: Params
) -> Line | None:
    """The line with its loose end moved to the nearest wall or other line; None where there is none."""
    if all(meets):
        return line
    path = attach_path(as_points(line), border, others, params.divider_reach_m, meets)
    return None if path is None else as_line(path)


def _resting(dividers: Sequence[Divider]) -> dict[str, list[str]]:
    """For each divider those on which one of its ends lies."""
    if not dividers:
        return {}
    ends = shapely.points(np.array([d.line for d in dividers]))
    gaps = shapely.distance(ends[..., None], shapely.linestrings(np.array([d.line for d in dividers]))).min(1)
    np.fill_diagonal(gaps, np.inf)
    return {d.id: [dividers[j].id for j in np.flatnonzero(gaps[i] < RESTS_M).tolist()] for i, d in enumerate(dividers)}


def _visited(tracked: SemanticMap, grid: OccupancyGrid) -> frozenset[str]:
    seen = _explored([room.polygon for room in tracked.rooms], grid)
    return frozenset(room.id for room, is_seen in zip(tracked.rooms, seen, strict=True) if is_seen)


def _explored(polygons: Sequence[Polygon], grid: OccupancyGrid) -> list[bool]:
    """Which of the polygons are explored for the most part."""
    if not polygons:
        return []
    numbers = np.zeros(grid.cells.shape, np.uint16)
    for number, polygon in enumerate(polygons, 1):
        cv2.fillPoly(numbers, [drawn(shapely.get_coordinates(polygon.exterior), grid.frame)], number, shift=SUBPIXEL)
    count = len(polygons) + 1
    cells = cv2.calcHist([numbers], [0], (~grid.unexplored).view(np.uint8), [count], [0, count]).ravel()[1:]
    seen = cells.astype(np.float64) * grid.frame.resolution**2
    return [bool(area >= SEEN_SHARE * polygon.area) for area, polygon in zip(seen, polygons, strict=True)]


def _identify(
    tracked: SemanticMap,
    pieces: Sequence[Polygon],
    sensed: OccupancyGrid,
    visited: frozenset[str],
    mission_id: str,
    ids: Ids,
    params: Params,
) -> tuple[tuple[Room, ...], tuple[str, ...], Ids, Mapping[str, float]]:
    """Gives each piece of floor to the room it was: by overlap, the largest piece to its room. What is left is a new room, or joins a neighbour.

    What the robot did not see, as below a bed that was pushed into a corner, is no new room. Last comes what previous rooms have in common
    with themselves, square metres.
    """
    common = most_common([room.polygon for room in tracked.rooms], pieces)
    shapes: dict[str, Polygon] = {}
    same: dict[str, float] = {}
    taken: set[int] = set()
    owner = common.argmax(0) if len(tracked.rooms) else np.zeros(len(pieces), int)
    for i, room in enumerate(tracked.rooms):
        mine = [j for j in range(len(pieces)) if owner[j] == i and common[i, j] > 0]
        if mine:
            best = max(mine, key=lambda j: common[i, j])
            shapes[room.id] = pieces[best]
            same[room.id] = float(common[i, best])
            taken.add(best)
    rest = [j for j in range(len(pieces)) if j not in taken]
    large = [j for j in rest if pieces[j].area >= params.room_area_m2]
    large = [j for j, is_seen in zip(large, _explored([pieces[j] for j in large], sensed), strict=True) if is_seen]
    fresh, ids = new_rooms([pieces[j] for j in large], mission_id, ids)
    names = [*shapes, *(room.id for room in fresh)]
    shapes.update((room.id, room.polygon) for room in fresh)
    joined = absorb([shapes[name] for name in names], [pieces[j] for j in rest if j not in large])
    grown = {name: shape for name, shape in zip(names, joined, strict=True) if shape is not shapes[name]}
    shapes.update(grown)
    same.update(
        (room.id, float(shapely.intersection(room.polygon, grown[room.id]).area))
        for room in tracked.rooms
        if room.id in grown
    )
    kept = tuple(
        replace(room, polygon=shapes[room.id], last_visited=mission_id if room.id in visited else room.last_visited)
        for room in tracked.rooms
        if room.id in shapes
    )
    parents = [tracked.rooms[owner[j]].id if common[:, j].sum() >= NEW_SHARE * pieces[j].area else None for j in large]
    fresh = tuple(
        replace(room, polygon=shapes[room.id], anchor=shapes[room.id], derived_from=parent)
        for room, parent in zip(fresh, parents, strict=True)
    )
    return kept + fresh, tuple(room.id for room in fresh), ids, same
