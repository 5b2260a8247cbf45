"""Floor plans: rooms in two rows along a hall, with an open-plan living room and kitchen at its end."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.random import Generator
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import Line, Points, as_line, as_points, polygons_in
from stillroom.simulator.homes import Door, Passage, RoomUse, TrueRoom, as_multipolygon, box

ROOMS = (5, 12)
"""The fewest and the most rooms of a plan."""
_ROWS: tuple[tuple[str, RoomUse], ...] = (
    ("Bathroom", "bath"),
    ("Bedroom", "bed"),
    ("Office", "work"),
    ("Children's room", "bed"),
    ("Guest room", "bed"),
    ("Laundry", "store"),
    ("Study", "work"),
    ("Storage", "store"),
)
_WIDTHS: dict[RoomUse, tuple[float, float]] = {
    "bath": (1.9, 2.5),
    "store": (1.8, 2.3),
    "bed": (3.0, 4.1),
    "work": (2.6, 3.5),
}
_DOOR_MARGIN_M = 0.12
"""From a doorway's jamb to the nearest corner of a room."""


@dataclass(frozen=True)
class Space:
    """A room up to the middle of its walls."""

    name: str
    use: RoomUse
    outline: Polygon


@dataclass(frozen=True)
class Plan:
    rooms: tuple[TrueRoom, ...]
    walls: MultiPolygon
    doors: tuple[Door, ...]


@dataclass(frozen=True)
class Style:
    """What is particular about a plan. None: as it is drawn."""

    inner_m: float | None = None
    """Thickness of the inner walls."""
    diagonal: bool | None = None
    """Whether walls cut corners off."""
    open_plan: bool = False
    """A dining room beside the living room, and the kitchen, without any wall between them."""


AS_DRAWN = Style()


def draw_plan(rng: Generator, room_count: int, style: Style = AS_DRAWN) -> Plan:
    """A plan with its walls along x and y, but for cut corners. An open one has a dining room more than `room_count`.

    Raises ValueError for a count out of `ROOMS`.
    """
    if not ROOMS[0] <= room_count <= ROOMS[1]:
        raise ValueError(f"{room_count} rooms; a plan has {ROOMS[0]} to {ROOMS[1]}")
    spaces = _draw_spaces(rng, room_count, style)
    if rng.random() < 0.5:
        spaces = [Space(s.name, s.use, shapely.transform(s.outline, lambda p: p * (-1.0, 1.0))) for s in spaces]
    drawn_inner, outer = rng.uniform(0.10, 0.18), rng.uniform(0.14, 0.20)
    inner = drawn_inner if style.inner_m is None else style.inner_m
    rooms = tuple(TrueRoom(s.name, s.use, _mitred(s.outline, -inner / 2)) for s in spaces)
    doors = tuple(_cut_doors(rng, spaces, inner))
    building = _mitred(shapely.union_all([s.outline for s in spaces]), outer - inner / 2)
    floor = shapely.union_all([room.polygon for room in rooms] + [door.polygon for door in doors])
    return Plan(rooms, as_multipolygon(shapely.difference(building, floor)), doors)


def _draw_spaces(rng: Generator, room_count: int, style: Style) -> list[Space]:
    with_ensuite = room_count >= 8
    names = _ROWS[: room_count - 3 - with_ensuite]
    rows = [names[0::2], names[1::2]]
    widths = [[rng.uniform(*_WIDTHS[use]) for _, use in row] for row in rows]
    length = max(sum(row) for row in widths)
    if rng.random() < 0.6:
        widths = [[w * length / sum(row) for w in row] for row in widths]
    south, hall, north = rng.uniform(2.9, 4.2), rng.uniform(1.3, 1.7), rng.uniform(2.9, 4.2)
    spaces = _row(rng, rows[0], widths[0], length, 0.0, south)
    spaces += _row(rng, rows[1], widths[1], length, south + hall, south + hall + north)
    if with_ensuite:
        spaces = _with_ensuite(rng, spaces, south)
    spaces.append(Space("Hall", "hall", _hall(rng, length, south, hall)))
    if style.diagonal:
        spaces = _with_diagonal(spaces, south)
    return spaces + _living(rng, length, south + hall, south + hall + north, style)


def _row(
    rng: Generator, row: tuple[tuple[str, RoomUse], ...], widths: list[float], end: float, y0: float, y1: float
) -> list[Space]:
    """Rooms side by side up to x = `end`."""
    order = rng.permutation(len(row))
    right = end - np.cumsum([0.0] + [widths[i] for i in order])
    return [Space(row[i][0], row[i][1], box(float(right[k + 1]), y0, float(right[k]), y1)) for k, i in enumerate(order)]


def _hall(rng: Generator, length: float, y: float, width: float) -> Polygon:
    """A corridor; every other one ends in an entrance that makes it L-shaped."""
    corridor = box(0.0, y, length, y + width)
    if rng.random() < 0.5:
        return corridor
    entrance = box(-rng.uniform(1.4, 1.9), y - rng.uniform(0.7, 1.3), 0.0, y + width)
    return polygons_in(shapely.union_all([corridor, entrance]))[0]


def _with_diagonal(spaces: list[Space], hall_y: float) -> list[Space]:
    """The outer corner of the last bedroom of the lower row cut off, or of another room there: the row's far end."""
    row = [
        space
        for space in spaces
        if space.outline.bounds[3] <= hall_y + 1e-6 and len(space.outline.exterior.coords) == 5
    ]
    if not row:
        return spaces
    end = min(row, key=lambda space: space.outline.bounds[0])
    x0, y0, x1, y1 = end.outline.bounds
    along = 0.4 * min(x1 - x0, y1 - y0)
    corner = Polygon(np.array([(x0, y0), (x0 + along, y0), (x0, y0 + along)]))
    cut = Space(end.name, end.use, polygons_in(shapely.difference(end.outline, corner))[0])
    return [cut if space is end else space for space in spaces]


def _living(rng: Generator, x: float, hall_end: float, top: float, style: Style) -> list[Space]:
    """The block at the hall's end: the kitchen in a corner of it, beside or behind the living room."""
    depth, kitchen_height = rng.uniform(4.0, 5.2), min(rng.uniform(2.4, 3.2), top - hall_end)
    block = box(x, 0.0, x + depth, top)
    left = x + rng.uniform(1.3, 1.7) if rng.random() < 0.5 else x
    kitchen = box(left, top - kitchen_height, x + depth, top)
    living = polygons_in(shapely.difference(block, kitchen))[0]
    diagonal = rng.random() < 0.4
    cut = rng.uniform(1.0, 1.6, 2).tolist()
    if diagonal if style.diagonal is None else style.diagonal:
        living = _without_corner(living, x + depth, *cut)
    spaces = [Space("Living room", "living", living), Space("Kitchen", "kitchen", kitchen)]
    return _with_dining(spaces, x, x + depth, top - kitchen_height) if style.open_plan else spaces


def _with_dining(spaces: list[Space], x0: float, x1: float, y1: float) -> list[Space]:
    """The part of the living room that lies nearer to the kitchen is a dining room."""
    living, kitchen = spaces
    y = 0.45 * y1
    lower = polygons_in(shapely.intersection(living.outline, box(x0, 0.0, x1, y)))[0]
    upper = polygons_in(shapely.difference(living.outline, lower))[0]
    return [Space("Living room", "living", lower), Space("Dining room", "dining", upper), kitchen]


def _without_corner(room: Polygon, x: float, along_x: float, along_y: float) -> Polygon:
    """The lower right corner cut off by a diagonal wall."""
    corner = Polygon(np.array([(x - along_x, 0.0), (x, 0.0), (x, along_y)]))
    return polygons_in(shapely.difference(room, corner))[0]


def _with_ensuite(rng: Generator, spaces: list[Space], hall_y: float) -> list[Space]:
    """A bathroom cut out of the outer corner of the largest bedroom, which becomes L-shaped."""
    host = max((s for s in spaces if s.use == "bed"), key=lambda s: s.outline.area)
    x0, y0, x1, y1 = host.outline.bounds
    width, depth = min(rng.uniform(1.6, 1.9), (x1 - x0) * 0.5), min(rng.uniform(1.8, 2.1), (y1 - y0) * 0.6)
    left, right = (x0, x0 + width) if rng.random() < 0.5 else (x1 - width, x1)
    bottom, top = (y0, y0 + depth) if y1 <= hall_y + 1e-6 else (y1 - depth, y1)
    bath = box(left, bottom, right, top)
    rest = polygons_in(shapely.difference(host.outline, bath))[0]
    others = [s for s in spaces if s is not host]
    return [*others, Space(host.name, host.use, rest), Space("Shower room", "bath", bath)]


def _cut_doors(rng: Generator, spaces: list[Space], wall: float) -> list[Door]:
    """A door from the hall to each room in the rows, openings in the open-plan part, a second way now and then."""
    named = {space.name: space for space in spaces}
    living = [name for name in ("Living room", "Dining room") if name in named]
    before_hall, before_kitchen = (
        max(living, key=lambda name: _shared(named[name], named[other]).length) for other in ("Hall", "Kitchen")
    )
    pairs: list[tuple[str, str, Passage]] = [
        ("Hall", before_hall, "door" if rng.random() < 0.4 else "opening"),
        (before_kitchen, "Kitchen", "opening"),
    ]
    beside_hall = [s.name for s in spaces if s.name not in ("Hall", *living, "Kitchen", "Shower room")]
    pairs += [("Hall", name, "door") for name in beside_hall]
    if "Shower room" in named:
        host = max(beside_hall, key=lambda name: _shared(named[name], named["Shower room"]).length)
        pairs.append((host, "Shower room", "door"))
    for name in beside_hall:
        living_too = named[name].use in ("work", "bed") and _shared(named[name], named["Living room"]).length > 2.0
        if living_too and rng.random() < 0.3:
            pairs.append(("Living room", name, "door"))
    doors = [_cut(rng, f"door-{i}", kind, named[a], named[b], wall) for i, (a, b, kind) in enumerate(pairs)]
    if "Dining room" in named:
        doors[1] = _whole(doors[1], named, wall)
        between = replace(doors[1], id=f"door-{len(pairs)}", rooms=("Living room", "Dining room"))
        doors.append(_whole(between, named, wall))
    return doors


def _whole(door: Door, named: Mapping[str, Space], wall: float) -> Door:
    """An opening as wide as the wall that it is in."""
    a, b = (named[name] for name in door.rooms)
    ends = shapely.get_coordinates(_shared(a, b))
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    line = as_line(np.stack([ends[0] + along * wall / 2, ends[1] - along * wall / 2]))
    return replace(door, line=line, polygon=thick_line(line, wall))


def _shared(a: Space, b: Space) -> LineString:
    """The longest straight wall between two rooms; empty where there is none."""
    common = shapely.line_merge(shapely.intersection(a.outline.exterior, b.outline.exterior))
    straight = [line for part in shapely.get_parts(common) for line in _segments(part)]
    return max(straight, key=lambda line: line.length, default=LineString())


def _segments(line: shapely.Geometry) -> list[LineString]:
    points = shapely.get_coordinates(line)
    return [LineString(pair) for pair in itertools.pairwise(points)]


def _cut(rng: Generator, key: str, kind: Passage, a: Space, b: Space, wall: float) -> Door:
    shared = _shared(a, b)
    clear = shared.length - wall - 2 * _DOOR_MARGIN_M
    width = rng.uniform(0.8, 1.0) if kind == "door" else rng.uniform(1.6, 2.8)
    width = min(width, clear)
    ends = shapely.get_coordinates(shared)
    along = (ends[1] - ends[0]) / shared.length
    start = ends[0] + along * (wall / 2 + _DOOR_MARGIN_M + rng.uniform(0.0, clear - width))
    line = as_line(np.stack([start, start + along * width]))
    return Door(key, kind, (a.name, b.name), line, thick_line(line, wall))


def thick_line(line: Line, thickness: float) -> Polygon:
    """The rectangle of that width along a line, which is its middle."""
    points: Points = as_points(line)
    along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    side = np.array([-along[1], along[0]]) * thickness / 2
    return Polygon(np.stack([points[0] - side, points[1] - side, points[1] + side, points[0] + side]))


def _mitred(outline: shapely.Geometry, distance: float) -> Polygon:
    return shapely.buffer(outline, distance, join_style="mitre", mitre_limit=10)
