"""Homes from floor plans of Sweet Home 3D (`Home.xml`): centimetres, y down; a home for each level."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import shapely
from numpy.random import Generator
from shapely import LineString, Point, Polygon

from stillroom.maps.geometry import Points, Pose, as_line, as_points, polygons_in
from stillroom.simulator.building import around_dock, turn_of
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.furnishing import Piece, place
from stillroom.simulator.homes import (
    Door,
    Furniture,
    Home,
    Passage,
    RoomUse,
    TrueRoom,
    as_multipolygon,
    unreachable_rooms,
)
from stillroom.simulator.openings import draw_windows
from stillroom.simulator.plans import Plan, thick_line

FEWEST_ROOMS = 3
_ROBOT_M = 0.2
_DOCKS = 8
"""So many places for the dock are tried: furniture stands where its owner has drawn it."""
_DOCK_CLEAR_M = 0.6
"""What stands nearer to the dock is not there."""
_SMALLEST_M2 = 1.0
_NICHE_M = 0.10
"""Parts of a room narrower than twice this are no floor: plans draw rooms around door frames."""
_SILL_M = 0.2
"""What hangs higher over the floor than this stands in nobody's way, nor is it a door."""
_FLAT_M = 0.06
"""Carpets."""
_TOUCHING_M = 0.12
"""Rooms nearer to each other than this have no wall between them."""
_NARROWEST_M = 0.6
_FRAME_M = 0.05
_PARALLEL = 0.97
"""Cosine of the greatest angle between a door and its wall."""
_BEFORE_WALL_M = 0.7
"""A door's middle is nearer to its wall than this."""
_OUTDOORS = ("balcony", "terrace", "roof", "garden", "garage")
_USES: tuple[tuple[str, RoomUse], ...] = (
    ("kitchen", "kitchen"),
    ("bath", "bath"),
    ("bed", "bed"),
    ("hall", "hall"),
    ("corridor", "hall"),
    ("office", "work"),
    ("dress", "store"),
)
_ON_LEGS = ("table", "chair", "desk", "stool")
_FIXED = ("stair", "sink", "toilet", "bath", "shower", "kitchen", "cooker", "fridge", "oven", "dishwasher", "cabinet")


class UnusablePlan(ValueError):
    """A floor plan that no home can be made of."""


@dataclass(frozen=True)
class _Level:
    """The elements of one level of a plan."""

    walls: Sequence[Xml.Element]
    rooms: Sequence[Xml.Element]
    doors: Sequence[Xml.Element]
    furniture: Sequence[Xml.Element]


def homes_in(folder: Path) -> list[tuple[Path, str | None]]:
    """(file, level) of every home in a folder of plans, always in the same order. Raises UnusablePlan."""
    roots = [(file, _parse(file)) for file in sorted(folder.glob("*.xml"))]
    levels = [
        (file, root, level)
        for file, root in roots
        for level in [element.get("id") for element in root.findall("level")] or [None]
    ]
    return [(file, level) for file, root, level in levels if len(_rooms(_level(root, level))) >= FEWEST_ROOMS]


def planned_home(folder: Path, streams: Streams, effects: Effects) -> Home:
    """The home of a simulated robot from a folder of plans, with what `effects` make of it. Raises UnusablePlan."""
    plans = homes_in(folder)
    if not plans:
        raise UnusablePlan(f"there is no plan of a home in {folder}")
    file, level = plans[streams.robot % len(plans)]
    home = read_home(file, level, streams.of("home"), turn_of(streams, effects))
    return draw_windows(replace(home, traits=frozenset({"floor_plan"})), effects.windows, streams.of("windows"))


def read_home(file: Path, level: str | None, rng: Generator, yaw: float) -> Home:
    """The home around its dock, turned by `yaw`, one in two mirrored; rooms that the robot can't get to are left out.

    Raises UnusablePlan.
    """
    found = _level(_parse(file), level)
    plan, furniture = _plan(found), _furniture(found, _rooms(found))

    def clear_of_dock(_rooms: object, _doors: object, dock: tuple[float, float]) -> tuple[Furniture, ...]:
        return tuple(piece for piece in furniture if piece.footprint.distance(Point(dock)) > _DOCK_CLEAR_M)

    candidates = [around_dock(plan, clear_of_dock, rng) for _ in range(_DOCKS)]
    home = _with_reachable_rooms(min(candidates, key=lambda home: len(unreachable_rooms(home, _ROBOT_M))))
    mirrored = rng.random() < 0.5
    return (_mirrored(home) if mirrored else home).moved(Pose(yaw=yaw))


def _parse(file: Path) -> Xml.Element:
    try:
        return Xml.parse(file).getroot()
    except Xml.ParseError as error:
        raise UnusablePlan(f"{file.name}: {error}") from None


def _level(root: Xml.Element, level: str | None) -> _Level:
    def of_level(tag: str) -> list[Xml.Element]:
        return [element for element in root.findall(tag) if element.get("level") == level]

    groups = [group for group in root.iter("furnitureGroup") if group.get("level") == level]
    inner = [piece for group in groups for piece in group.findall("pieceOfFurniture")]
    return _Level(of_level("wall"), of_level("room"), of_level("doorOrWindow"), of_level("pieceOfFurniture") + inner)


def _plan(level: _Level) -> Plan:
    rooms = _rooms(level)
    if len(rooms) < FEWEST_ROOMS:
        raise UnusablePlan(f"{len(rooms)} rooms; a home has {FEWEST_ROOMS} at least")
    walls = shapely.union_all(_walls(level))
    doors = [*_doors(level, rooms), *_openings(rooms, walls)]
    floor = shapely.union_all([room.polygon for room in rooms] + [door.polygon for door in doors])
    around = shapely.union_all([walls, shapely.buffer(floor, 0.15, join_style="mitre")])
    return Plan(rooms, as_multipolygon(shapely.difference(around, floor)), tuple(doors))


def _walls(level: _Level) -> list[Polygon]:
    lines = [[(_m(w, "xStart"), -_m(w, "yStart")), (_m(w, "xEnd"), -_m(w, "yEnd"))] for w in level.walls]
    return [
        shapely.buffer(LineString(line), _m(wall, "thickness") / 2, cap_style="square")
        for line, wall in zip(lines, level.walls, strict=True)
    ]


def _rooms(level: _Level) -> tuple[TrueRoom, ...]:
    walls = shapely.union_all(_walls(level))
    rooms: list[TrueRoom] = []
    taken: shapely.Geometry = Polygon()
    for element in level.rooms:
        drawn = Polygon([(_m(p, "x"), -_m(p, "y")) for p in element.findall("point")])
        bare = shapely.difference(shapely.make_valid(drawn), shapely.union_all([walls, taken]))
        wide = shapely.buffer(shapely.buffer(bare, -_NICHE_M, join_style="mitre"), _NICHE_M, join_style="mitre")
        shape = max(polygons_in(wide), key=lambda part: part.area, default=Polygon())
        name = element.get("name", "").strip()
        if shape.area >= _SMALLEST_M2 and not any(word in name.lower() for word in _OUTDOORS):
            shape = Polygon(shapely.simplify(shape, 0.01).exterior)
            rooms.append(TrueRoom(_free_name(name, rooms), _use(name), shape))
            taken = shapely.union(taken, shape)
    return _with_living_room(rooms)


def _with_living_room(rooms: Sequence[TrueRoom]) -> tuple[TrueRoom, ...]:
    """The largest room is where the robot's dock stands."""
    largest = max(rooms, key=lambda room: room.polygon.area, default=None)
    return tuple(replace(room, use="living") if room is largest else room for room in rooms)


def _free_name(name: str, others: Iterable[TrueRoom]) -> str:
    taken = {room.name for room in others}
    plain = name or "Room"
    numbered = (plain if n == 1 else f"{plain} {n}" for n in range(1, len(taken) + 2))
    return next(candidate for candidate in numbered if candidate not in taken)


def _use(name: str) -> RoomUse:
    return next((use for word, use in _USES if word in name.lower()), "store")


def _doors(level: _Level, rooms: Sequence[TrueRoom]) -> list[Door]:
    """What reaches down to the floor in a wall between two rooms."""
    found: list[Door] = []
    for element in level.doors:
        along = _direction(element)
        centre = _in_wall(level, np.array([_m(element, "x"), -_m(element, "y")]), along)
        if _m(element, "elevation") > _SILL_M or centre is None:
            continue
        aside = np.array([-along[1], along[0]])
        left, right = (_beside(rooms, centre, side * aside) for side in (1, -1))
        half = (_m(element, "width") / 2 - _FRAME_M) * along
        line = as_line(np.stack([centre - half, centre + half]))
        twice = any(LineString(line).distance(LineString(door.line)) < _FRAME_M for door in found)
        if left is None or right is None or left[0] == right[0] or twice:
            continue
        kind: Passage = "opening" if "frame" in element.get("name", "").lower() else "door"
        hole = thick_line(line, 2 * max(left[1], right[1]))
        found.append(Door(f"door-{len(found)}", kind, (left[0], right[0]), line, hole))
    return found


def _in_wall(level: _Level, centre: Points, along: Points) -> Points | None:
    """The place in the nearest wall that a door is for: plans draw it with its leaf open, so that its middle is before the wall."""
    places = []
    for wall in level.walls:
        start = np.array([_m(wall, "xStart"), -_m(wall, "yStart")])
        run = np.array([_m(wall, "xEnd"), -_m(wall, "yEnd")]) - start
        length = float(np.hypot(*run))
        if length > 0 and abs(float(run @ along)) > _PARALLEL * length:
            station = float((centre - start) @ run) / length
            if -_FRAME_M <= station <= length + _FRAME_M:
                places.append(start + run * station / length)
    nearest = min(places, key=lambda place: float(np.hypot(*(place - centre))), default=None)
    return nearest if nearest is not None and float(np.hypot(*(nearest - centre))) < _BEFORE_WALL_M else None


def _beside(rooms: Sequence[TrueRoom], centre: Points, side: Points) -> tuple[str, float] | None:
    """The nearest room to one side of a door, and how far its floor is from the door's middle."""
    for distance in np.arange(0.04, 0.45, 0.02):
        x, y = centre + distance * side
        name = next((room.name for room in rooms if shapely.contains_xy(room.polygon, x, y)), None)
        if name is not None:
            return name, float(distance)
    return None


def _openings(rooms: Sequence[TrueRoom], walls: shapely.Geometry) -> list[Door]:
    """Where two rooms lie beside each other without a wall."""
    found: list[Door] = []
    for i, a in enumerate(rooms):
        for b in rooms[i + 1 :]:
            reach = shapely.buffer(b.polygon, _TOUCHING_M, join_style="mitre", cap_style="flat")
            common = shapely.difference(shapely.intersection(a.polygon.exterior, reach), shapely.buffer(walls, 0.02))
            for edge in _straight(common):
                if LineString(edge).length >= _NARROWEST_M:
                    line = as_line(edge)
                    key = f"opening-{len(found)}"
                    found.append(Door(key, "opening", (a.name, b.name), line, thick_line(line, 2 * _TOUCHING_M)))
    return found


def _straight(line: shapely.Geometry) -> list[Points]:
    merged = shapely.line_merge(line) if line.geom_type == "MultiLineString" else line
    parts = [shapely.get_coordinates(part) for part in shapely.get_parts(merged)]
    return [np.stack(pair) for part in parts for pair in pairwise(part)]


def _furniture(level: _Level, rooms: Sequence[TrueRoom]) -> tuple[Furniture, ...]:
    """What stands on the floor of a room."""
    standing: list[Furniture] = []
    for number, element in enumerate(level.furniture):
        low, high = _m(element, "elevation"), _m(element, "height")
        x, y = _m(element, "x"), -_m(element, "y")
        room = next((room for room in rooms if shapely.contains_xy(room.polygon, x, y)), None)
        if room is None or low > _SILL_M or high < _FLAT_M:
            continue
        name = element.get("name", "piece")
        width, depth = _m(element, "width"), _m(element, "depth")
        legs = any(word in name.lower() for word in _ON_LEGS) and min(width, depth) > 0.3
        fixed = any(word in name.lower() for word in _FIXED)
        piece = Piece(name, width, depth, against_wall=False, legs=legs, movable=not fixed)
        along = _direction(element)
        yaw = float(np.arctan2(along[1], along[0]))
        back = np.array([x, y]) - np.array([-along[1], along[0]]) * depth / 2
        pose = Pose(float(back[0]), float(back[1]), yaw)
        standing.append(place(f"{room.name}/{name} {number}", piece, room, pose))
    return tuple(standing)


def _with_reachable_rooms(home: Home) -> Home:
    """Without the rooms that the robot can't get to, which are as if they were none."""
    lost = set(unreachable_rooms(home, _ROBOT_M))
    rooms = tuple(room for room in home.rooms if room.name not in lost)
    if len(rooms) < FEWEST_ROOMS:
        raise UnusablePlan(f"the robot gets to {len(rooms)} rooms")
    return replace(
        home,
        rooms=rooms,
        doors=tuple(door for door in home.doors if not lost & set(door.rooms)),
        furniture=tuple(piece for piece in home.furniture if piece.room not in lost),
    )


def _mirrored(home: Home) -> Home:
    def flip(geometry: shapely.Geometry) -> shapely.Geometry:
        return shapely.transform(geometry, lambda points: points * (-1.0, 1.0))

    return Home(
        tuple(replace(room, polygon=flip(room.polygon)) for room in home.rooms),
        flip(home.walls),
        tuple(
            replace(door, line=as_line(as_points(door.line) * (-1.0, 1.0)), polygon=flip(door.polygon))
            for door in home.doors
        ),
        tuple(replace(f, footprint=flip(f.footprint), solid=flip(f.solid)) for f in home.furniture),
        (-home.dock[0], home.dock[1]),
    )


def _direction(element: Xml.Element) -> Points:
    """Unit vector (2,) along the width of a piece: its angle is clockwise, as y is down."""
    angle = -float(element.get("angle", "0"))
    return np.array([np.cos(angle), np.sin(angle)])


def _m(element: Xml.Element, attribute: str) -> float:
    """A length in metres; 0 where there is none."""
    return float(element.get(attribute, "0")) / 100
