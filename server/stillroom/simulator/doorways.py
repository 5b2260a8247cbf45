"""What stands in doorways during a mission and leaves a robot a way past: boxes and bags, and the leaves of doors ajar."""

from math import radians

import numpy as np
import shapely
from numpy.random import Generator
from shapely import Polygon

from stillroom.maps.geometry import Points, as_points
from stillroom.simulator.homes import Door, Home

_WAY_M = 0.42
"""So much of the doorway stays free."""
_LEAF_M = 0.04
_AJAR_DEG = (35.0, 75.0)
"""How far a door that stands ajar is open."""
_THING_M = (0.2, 0.45)
"""Depth of what stands in a doorway,"""
_ASIDE_M = 0.35
"""and how far it may stand before it."""


def in_doorways(home: Home, share: float, rng: Generator) -> dict[str, Polygon]:
    """What stands in that share of the doorways, by the door's id."""
    draws = rng.random((len(home.doors), 5))
    return {
        door.id: _thing(home, door, row[1:].tolist())
        for door, row in zip(home.doors, draws, strict=True)
        if row[0] < share
    }


def _thing(home: Home, door: Door, draws: list[float]) -> Polygon:
    kind, side, size, aside = draws
    ends = as_points(door.line) if side < 0.5 else as_points(door.line)[::-1]
    length = float(np.linalg.norm(ends[1] - ends[0]))
    along = (ends[1] - ends[0]) / length
    across = np.array([-along[1], along[0]])
    if door.kind == "door" and kind < 0.5:
        angle = radians(_AJAR_DEG[0] + size * (_AJAR_DEG[1] - _AJAR_DEG[0]))
        into = np.sign(across @ (shapely.get_coordinates(home.room(door.rooms[1]).polygon.centroid)[0] - ends[0]))
        leaf = length * (np.cos(angle) * along + np.sin(angle) * into * across)
        return _bar(ends[0], ends[0] + leaf, _LEAF_M)
    width = min(length - _WAY_M, 0.25 + 0.5 * size * length)
    depth = _THING_M[0] + kind * (_THING_M[1] - _THING_M[0])
    middle = ends[0] + (2 * aside - 1) * _ASIDE_M * across
    return _bar(middle, middle + along * width, depth)


def _bar(start: Points, end: Points, thickness: float) -> Polygon:
    return shapely.buffer(shapely.LineString(np.stack([start, end])), thickness / 2, cap_style="flat")
