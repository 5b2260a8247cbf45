"""What the owner of a simulated home does in the app when rooms are new: parts and joins them, says what is no room, and names them."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import shapely
from shapely import LineString, Polygon

from stillroom.maps.geometry import as_points
from stillroom.simulator.client import Json, Refused
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Door, Home, carried

_COMMON_M2 = 0.8
"""A served room is common to two true ones where it covers more than this of each."""
_ASKEW_M = 0.5
"""A divider whose middle is this near to a doorway's is meant for it."""
_SCRAP_M2 = 0.5
_WITHIN = 0.6
"""It is a part of a true room where more than this share of it lies there."""

Shapes = Mapping[str, Polygon]
"""The true rooms by name, as they lie on the map."""


_LONGER_M = (0.0, 0.5, 1.0)
"""By how much a divider is drawn longer than its doorway, one try after the other."""

Step = Callable[[Json], Sequence[Json]]
"""The operations for a map document."""
Edit = Callable[[Step], object]
"""Applies the operations that a function finds for the map in force, as `Client.edit`. Raises Refused."""


def tidy_up(edit: Edit, home: Home, distortion: Distortion) -> tuple[str, ...]:
    """Brings the map in force, bent by `distortion`, in line with the home; what the service refused, in its words."""
    shapes = {room.name: carried(room.polygon, distortion.apply) for room in home.rooms}
    steps: list[list[Step]] = [
        [partial(part, door, distortion, shapes, more) for more in _LONGER_M] for door in home.doors
    ]
    views = [
        shapely.make_valid(carried(view, distortion.apply)) for window in home.windows for view in window.view.geoms
    ]
    steps += [[partial(not_a_place, view)] for view in views]
    steps += [[partial(join, name, shapes)] for name in shapes]
    steps += [[drop_scraps], [partial(name_rooms, shapes)], [drop_scraps]]
    return tuple(refusal for attempts in steps if (refusal := _try(edit, attempts)) is not None)


def _try(edit: Edit, attempts: Sequence[Step]) -> str | None:
    """The first of the attempts that is not refused; else what was said to the last one."""
    said = None
    for attempt in attempts:
        try:
            edit(attempt)
        except Refused as refusal:
            said = str(refusal)
        else:
            return None
    return said


def part(door: Door, distortion: Distortion, shapes: Shapes, longer_m: float, document: Json) -> list[Json]:
    """A divider in a doorway where one served room covers both sides; one that is there already, but lies askew, is moved.

    Where the walls beside the doorway are missing, it has to be longer at both ends.
    """
    sides = [shapes[name] for name in door.rooms]
    if not any(
        all(shapely.intersection(side, room).area > _COMMON_M2 for side in sides)
        for room in served_rooms(document).values()
    ):
        return []
    ends = as_points(door.line)
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    line = np.round(distortion.apply(ends + longer_m * np.stack([-along, along])), 4).tolist()
    middle = LineString(line).centroid
    near = min(_dividers(document).items(), key=lambda item: item[1].centroid.distance(middle), default=None)
    if near is not None and near[1].centroid.distance(middle) < _ASKEW_M:
        return [{"op": "move_divider", "id": near[0], "line": line}]
    return [{"op": "add_divider", "line": line, "kind": "door" if door.kind == "door" else "open"}]


def not_a_place(view: shapely.Geometry, document: Json) -> list[Json]:
    """What a served room has of the outside that is seen through a window, marked as no real place."""
    outside = [shapely.intersection(room, view).convex_hull for room in served_rooms(document).values()]
    rings = [np.round(shapely.get_coordinates(part)[:-1], 4).tolist() for part in outside if part.area > _SCRAP_M2]
    return [{"op": "mark_phantom", "shape": ring} for ring in rings]


def join(name: str, shapes: Shapes, document: Json) -> list[Json]:
    """The served rooms that a true one fell into made one."""
    parts = [key for key, room in served_rooms(document).items() if _share(room, shapes[name]) > _WITHIN]
    return [{"op": "merge_rooms", "ids": parts}] if len(parts) > 1 else []


def drop_scraps(document: Json) -> list[Json]:
    """Rooms that are too small to be one joined to a neighbour, by way of one of their dividers."""
    scraps = {key for key, room in served_rooms(document).items() if room.area < _SCRAP_M2}
    dividers = [f for f in document["features"] if f["properties"]["semantic"] == "divider"]
    removable = {scrap: f["id"] for f in dividers for scrap in scraps & set(f["properties"]["rooms"])}
    return [{"op": "remove_divider", "id": key} for key in sorted(set(removable.values()))]


def name_rooms(shapes: Shapes, document: Json) -> list[Json]:
    """Each true room's name for the served room that it overlaps best."""
    rooms = served_rooms(document)
    names = {f["id"]: f["properties"].get("name") for f in document["features"]}
    operations = []
    for name, shape in shapes.items():
        best = max(rooms, key=lambda key: _common_area(rooms[key], shape), default=None)
        if best is not None and _share(rooms[best], shape) > _WITHIN and names[best] != name:
            operations.append({"op": "rename_room", "id": best, "name": name})
    return operations


def served_rooms(document: Json) -> dict[str, Polygon]:
    rooms = [feature for feature in document["features"] if feature["properties"]["semantic"] == "room"]
    return {room["id"]: Polygon(*_rings(room["geometry"]["coordinates"])) for room in rooms}


def _dividers(document: Json) -> dict[str, LineString]:
    dividers = [feature for feature in document["features"] if feature["properties"]["semantic"] == "divider"]
    return {divider["id"]: LineString(divider["geometry"]["coordinates"]) for divider in dividers}


def _rings(coordinates: list[list[list[float]]]) -> tuple[list[list[float]], list[list[list[float]]]]:
    return coordinates[0], coordinates[1:]


def _share(of: Polygon, within: Polygon) -> float:
    return _common_area(of, within) / float(of.area)


def _common_area(a: Polygon, b: Polygon) -> float:
    return float(shapely.intersection(a, b).area)
