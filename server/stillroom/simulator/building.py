"""A whole home from a seed."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import shapely
from numpy.random import Generator

from stillroom.maps.geometry import Point as Position
from stillroom.maps.geometry import Pose
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.furnishing import furnish
from stillroom.simulator.homes import Door, Furniture, Home, TrueRoom
from stillroom.simulator.openings import draw_windows
from stillroom.simulator.plans import AS_DRAWN, ROOMS, Plan, Style, draw_plan

_THIN_M = 0.07
_DOCK_M = (0.30, 0.45)
"""How far the dock is from the nearest wall,"""
_DOCK_TO_DOOR_M = 1.0
"""and at least from the nearest doorway."""


def draw_home(rng: Generator, room_count: int | None = None, yaw: float | None = None, style: Style = AS_DRAWN) -> Home:
    """A furnished home around its dock, of `room_count` rooms and turned by `yaw`; either is drawn where not given."""
    plan = draw_plan(rng, int(rng.integers(ROOMS[0], ROOMS[1] + 1)) if room_count is None else room_count, style)
    turn = float(rng.uniform(-np.pi, np.pi)) if yaw is None else yaw
    return around_dock(plan, partial(furnish, rng), rng).moved(Pose(yaw=turn))


Furnish = Callable[[tuple[TrueRoom, ...], tuple[Door, ...], Position], tuple[Furniture, ...]]


def around_dock(plan: Plan, furnished: Furnish, rng: Generator) -> Home:
    """A furnished home whose origin is the robot's dock."""
    dock = _dock(rng, plan)
    home = Home(plan.rooms, plan.walls, plan.doors, furnished(plan.rooms, plan.doors, dock), dock)
    return home.moved(Pose(-dock[0], -dock[1]))


def home_of(streams: Streams, effects: Effects) -> Home:
    """The home of a simulated robot, with what `effects` make of it."""
    draws = streams.of("style").random(4).tolist()
    shares = {
        "thin_walls": effects.thin_walls,
        "diagonal_walls": effects.diagonal_walls,
        "open_plan": effects.open_plan,
    }
    traits = frozenset(name for (name, share), draw in zip(shares.items(), draws, strict=False) if draw < share)
    style = Style(_THIN_M if "thin_walls" in traits else None, "diagonal_walls" in traits, "open_plan" in traits)
    home = replace(draw_home(streams.of("home"), yaw=turn_of(streams, effects), style=style), traits=traits)
    return draw_windows(home, effects.windows, streams.of("windows"))


def turn_of(streams: Streams, effects: Effects) -> float:
    """By how much a robot's home stands turned, radians."""
    return (2 * float(streams.of("style").random(4)[3]) - 1) * np.pi if effects.turned else 0.0


def _dock(rng: Generator, plan: Plan) -> tuple[float, float]:
    """By a wall of the living room."""
    living = next(room.polygon for room in plan.rooms if room.use == "living")
    doors = shapely.union_all([door.polygon for door in plan.doors])
    by_the_walls = shapely.difference(shapely.buffer(living, -_DOCK_M[0]), shapely.buffer(living, -_DOCK_M[1]))
    there = shapely.difference(by_the_walls, shapely.buffer(doors, _DOCK_TO_DOOR_M))
    x0, y0, x1, y1 = there.bounds
    while True:
        x, y = float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
        if shapely.contains_xy(there, x, y):
            return x, y
