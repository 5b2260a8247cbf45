"""What the owner of a simulated home does in the app when rooms are new: parts and joins them, and names them."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.geometry import as_points
from stillroom.simulator.client import Client, Json, Refused
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Door, Home, carried

_COMMON_M2 = 0.8
"""A served room is common to two true ones where it covers more than this of each."""
_WITHIN = 0.6
"""It is a part of a true room where more than this share of it lies there."""
_NAMED = 0.4
"""It gets a true room's name from this IoU on."""

Shapes = Mapping[str, Polygon]
"""The true rooms by name, as they lie on the map."""


def tidy_up(owner: Client, path: str, home: Home, distortion: Distortion) -> tuple[str, ...]:
    """Brings the map in force, bent by `distortion`, in line with the home; what the service refused, in its words."""
    shapes = {room.name: carried(room.polygon, distortion.apply) for room in home.rooms}
    steps: list[Callable[[Json], Sequence[Json]]] = [partial(part, door, distortion, shapes) for door in home.doors]
    steps += [partial(join, name, shapes) for name in shapes]
    refused = []
    steps.append(partial(name_rooms, shapes))
    for step in steps:
        try:
            owner.edit(path, step)
        except Refused as refusal:
            refused.append(str(refusal))
    return tuple(refused)


def part(door: Door, distortion: Distortion, shapes: Shapes, document: Json) -> list[Json]:
    """A divider in a doorway where one served room covers both sides."""
    sides = [shapes[name] for name in door.rooms]
    if not any(
        all(shapely.intersection(side, room).area > _COMMON_M2 for side in sides)
        for room in served_rooms(document).values()
    ):
        return []
    line = np.round(distortion.apply(as_points(door.line)), 4).tolist()
    return [{"op": "add_divider", "line": line, "kind": "door" if door.kind == "door" else "open"}]


def join(name: str, shapes: Shapes, document: Json) -> list[Json]:
    """The served rooms that a true one fell into made one."""
    parts = [key for key, room in served_rooms(document).items() if _share(room, shapes[name]) > _WITHIN]
    return [{"op": "merge_rooms", "ids": parts}] if len(parts) > 1 else []


def name_rooms(shapes: Shapes, document: Json) -> list[Json]:
    """Each true room's name for the served room that it overlaps best."""
    rooms = served_rooms(document)
    names = {f["id"]: f["properties"].get("name") for f in document["features"]}
    operations = []
    for name, shape in shapes.items():
        best = max(rooms, key=lambda key: _iou(rooms[key], shape), default=None)
        if best is not None and _iou(rooms[best], shape) >= _NAMED and names[best] != name:
            operations.append({"op": "rename_room", "id": best, "name": name})
    return operations


def served_rooms(document: Json) -> dict[str, Polygon]:
    rooms = [feature for feature in document["features"] if feature["properties"]["semantic"] == "room"]
    return {room["id"]: Polygon(*_rings(room["geometry"]["coordinates"])) for room in rooms}


def _rings(coordinates: list[list[list[float]]]) -> tuple[list[list[float]], list[list[list[float]]]]:
    return coordinates[0], coordinates[1:]


def _share(of: Polygon, within: Polygon) -> float:
    return float(shapely.intersection(of, within).area / of.area)


def _iou(a: Polygon, b: Polygon) -> float:
    return float(shapely.intersection(a, b).area / shapely.union(a, b).area)
