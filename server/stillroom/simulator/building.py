"""A whole home from a seed."""

import numpy as np
import shapely
from numpy.random import Generator

from stillroom.maps.geometry import Pose, as_points, polygons_in
from stillroom.simulator.furnishing import furnish
from stillroom.simulator.homes import Home, clear_of_furniture
from stillroom.simulator.plans import ROOMS, draw_plan

_DOCK_CLEARANCE_M = 0.25


def draw_home(rng: Generator, room_count: int | None = None, yaw: float | None = None) -> Home:
    """A furnished home around its dock, of `room_count` rooms and turned by `yaw`; either is drawn where not given."""
    plan = draw_plan(rng, int(rng.integers(ROOMS[0], ROOMS[1] + 1)) if room_count is None else room_count)
    turn = Pose(yaw=float(rng.uniform(-np.pi, np.pi)) if yaw is None else yaw)
    home = Home(plan.rooms, plan.walls, plan.doors, furnish(rng, plan.rooms, plan.doors), dock=(0.0, 0.0))
    dock = _dock(rng, home)
    ((x, y),) = turn.apply(as_points(dock)).tolist()
    return Home(home.rooms, home.walls, home.doors, home.furniture, dock).moved(Pose(-x, -y, turn.yaw))


def _dock(rng: Generator, home: Home) -> tuple[float, float]:
    """A place in the living room that the whole home can be reached from."""
    reachable = max(polygons_in(clear_of_furniture(home, _DOCK_CLEARANCE_M)), key=lambda part: part.area)
    there = shapely.intersection(reachable, home.room("Living room").polygon)
    x0, y0, x1, y1 = there.bounds
    while True:
        x, y = float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
        if shapely.contains_xy(there, x, y):
            return x, y
