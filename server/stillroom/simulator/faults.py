"""What a robot's sensors and its SLAM get wrong beyond noise: stretches of wall not sensed, false obstacles, scans put far off."""

from dataclasses import dataclass
from math import log, radians

import numpy as np
import numpy.typing as npt
import shapely
from numpy.random import Generator
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose
from stillroom.maps.grid import Cell, Cells, GridFrame, OccupancyGrid
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects
from stillroom.simulator.homes import Home
from stillroom.simulator.openings import edges, outward
from stillroom.simulator.sensing import fill_ring

LONG_GAP_M = 0.5
"""A robot's first map is of several runs: it has no longer gaps than this, and none that leak."""
_LEAK = 0.5
"""Share of the gaps that the robot takes for floor; the others stay unexplored."""
_LEAK_M = (0.15, 0.40)
"""How far beyond a wall's face there is floor then."""
_IN_SIGHT = 0.7
"""There is floor only where this share of a gap's length would have been sensed as wall."""
_FACE_M = 0.10
"""All that was sensed of a wall lies this near to its face."""
_SLAM_M = (0.4, 1.5)
_SLAM_DEG = (3.0, 15.0)
_LOST_SHARE = (0.3, 0.6)
"""Of the scans, those taken after SLAM had failed,"""
_AGAIN = 0.35
"""and of the others, those taken again after that: walls are doubled there."""


@dataclass(frozen=True)
class Gap:
    """A stretch of a room's wall that was not sensed; where it `leaks`, floor was seen in it."""

    strip: Polygon
    length_m: float
    leaks: bool


def draw_gaps(home: Home, mission: int, effects: Effects, rng: Generator) -> tuple[Gap, ...]:
    """As many as the home's walls are long; short ones are likelier."""
    walls = [edge for room in home.rooms for edge in edges(room.polygon)]
    lengths = np.array([np.linalg.norm(wall[1] - wall[0]) for wall in walls])
    shortest, longest = effects.gap_m
    gaps = []
    for _ in range(rng.poisson(effects.gaps_per_10m * lengths.sum() / 10)):
        along, size, leak, depth = rng.random(4).tolist()
        at = along * lengths.sum()
        which = min(int(np.searchsorted(np.cumsum(lengths), at)), len(walls) - 1)
        length = float(np.exp(log(shortest) + size * log(longest / shortest)))
        if mission == 0:
            length = min(length, LONG_GAP_M)
        middle = at - float(lengths[:which].sum())
        leaks = leak < _LEAK and mission > 0
        beyond = _LEAK_M[0] + depth * (_LEAK_M[1] - _LEAK_M[0]) if leaks else _FACE_M
        gaps.append(Gap(_strip(walls[which], middle, length, beyond), length, leaks))
    return tuple(gaps)


def _strip(wall: Points, middle: float, length: float, beyond: float) -> Polygon:
    """Along a wall's face (2, 2), no farther than its ends."""
    whole = float(np.linalg.norm(wall[1] - wall[0]))
    along, off = (wall[1] - wall[0]) / whole, outward(wall)
    a, b = (wall[0] + along * np.clip(middle + half, 0.0, whole) for half in (-length / 2, length / 2))
    return Polygon(np.stack([a - off * _FACE_M, b - off * _FACE_M, b + off * beyond, a + off * beyond]))


def with_gaps(grid: OccupancyGrid, gaps: tuple[Gap, ...], distortion: Distortion) -> Cells:
    """Cells without the stretches of wall that were not sensed; nothing leaks where the wall was out of sight anyway."""
    cells = grid.cells.copy()
    for gap in gaps:
        where = _cells_in(grid.frame, distortion.apply(shapely.get_coordinates(gap.strip.exterior)[:-1]))
        wall = where & (cells == Cell.OCCUPIED)
        in_sight = wall.sum() * grid.frame.resolution >= _IN_SIGHT * gap.length_m
        where &= (cells != Cell.FREE) if gap.leaks and in_sight else wall
        cells[where] = Cell.FREE if gap.leaks else Cell.UNEXPLORED
    return cells


def with_specks(grid: OccupancyGrid, home: Home, distortion: Distortion, effects: Effects, rng: Generator) -> Cells:
    """Cells with false obstacles on the floor."""
    cells = grid.cells.copy()
    x0, y0, x1, y1 = home.walls.bounds
    floor = shapely.union_all([room.polygon for room in home.rooms])
    shapely.prepare(floor)
    count = rng.poisson(effects.specks * (x1 - x0) * (y1 - y0) / 10)
    x, y, size = rng.random((3, count))
    places = np.stack([x0 + x * (x1 - x0), y0 + y * (y1 - y0)], 1)
    inside = shapely.contains_xy(floor, places)
    for centre, radius in zip(distortion.apply(places[inside]), 0.3 + 0.9 * size[inside], strict=True):
        _speck(cells, grid.frame.to_cells(centre[None])[0], float(radius))
    return cells


def _speck(cells: Cells, centre: Points, radius: float) -> None:
    """Free cells whose middle is within `radius` cells of a point (2,), and the one that it is in, are occupied."""
    column, row = np.floor(centre).astype(int).tolist()
    reach = int(np.ceil(radius))
    rows, columns = np.mgrid[row - reach : row + reach + 1, column - reach : column + reach + 1]
    near = np.hypot(columns + 0.5 - centre[0], rows + 0.5 - centre[1]) <= radius
    near[reach, reach] = True
    near &= (rows >= 0) & (columns >= 0) & (rows < cells.shape[0]) & (columns < cells.shape[1])
    rows, columns = rows[near], columns[near]
    free = cells[rows, columns] == Cell.FREE
    cells[rows[free], columns[free]] = Cell.OCCUPIED


def _cells_in(frame: GridFrame, ring: Points) -> npt.NDArray[np.bool_]:
    image = np.zeros((frame.height, frame.width), np.uint8)
    fill_ring(image, frame.to_cells(ring), 1)
    return image > 0


@dataclass(frozen=True, eq=False)
class SlamFailure:
    """`scans` (n,) are put down where `off` takes them: some of them a second time."""

    scans: npt.NDArray[np.int64]
    again: npt.NDArray[np.bool_]
    off: Pose


def draw_slam_failure(places: Points, rng: Generator) -> SlamFailure:
    """Of the scans taken at `places` (v, 2), the ones farther from the first, and some of the others again."""
    share, distance, heading, turn, side = rng.random(5).tolist()
    far = np.linalg.norm(places - places[0], axis=1).argsort()
    lost = far[round(len(far) * (1 - _LOST_SHARE[0] - share * (_LOST_SHARE[1] - _LOST_SHARE[0]))) :]
    others = np.setdiff1d(far, lost)
    twice = others[rng.random(len(others)) < _AGAIN]
    shift = _SLAM_M[0] + distance * (_SLAM_M[1] - _SLAM_M[0])
    yaw = radians(_SLAM_DEG[0] + turn * (_SLAM_DEG[1] - _SLAM_DEG[0])) * (1 if side < 0.5 else -1)
    pivot = places[lost].mean(0)
    there = Pose(
        float(pivot[0] + shift * np.cos(2 * np.pi * heading)),
        float(pivot[1] + shift * np.sin(2 * np.pi * heading)),
        yaw,
    )
    off = there.after(Pose(-float(pivot[0]), -float(pivot[1])))
    return SlamFailure(np.concatenate([lost, twice]), np.isin(np.concatenate([lost, twice]), twice), off)
