"""The occupancy grid that a robot makes of its scans, as its SLAM puts them together, with what its sensors got wrong."""

from dataclasses import dataclass
from math import radians

import numpy as np
import numpy.typing as npt
import shapely
from numpy.random import Generator

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import Cell, Cells, GridFrame, Mask, OccupancyGrid
from stillroom.simulator.changes import World
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home
from stillroom.simulator.sensing import TRUTH_RESOLUTION_M, Floor, Scans, fill_ring, rasterise, route, take_scans

_OCCUPIED_SHARE = 0.25
"""A cell is occupied where at least this share of the scans that came to it ended in it."""
_SHORT_OF_WALL_CELLS = 0.75
"""A ray has swept the cells up to this far before its end."""
_MARGIN_CELLS = 4
_LEAK = 0.5
"""Share of the gaps that the robot takes for floor; the others stay unexplored."""


@dataclass(frozen=True, eq=False)
class Sensed:
    """A mission's grid, and which cells of the home's `floor` were really seen to be free."""

    grid: OccupancyGrid
    floor: Floor
    seen: Mask


def sense(
    world: World, distortion: Distortion, mission: int, resolution: float, effects: Effects, streams: Streams
) -> Sensed:
    """One mission's grid of a home. The distortion moves where things land on the map, never what is seen."""
    floor = rasterise(world)
    scans = take_scans(floor, route(world, floor, streams.of("route", mission)))
    clean = grid_of(scans, distortion, resolution, effects, streams.of("scans", mission))
    cells = with_gaps(clean, world.home, distortion, effects, streams.of("gaps", mission))
    cells = with_specks(
        OccupancyGrid(clean.frame, cells), world.home, distortion, effects, streams.of("specks", mission)
    )
    return Sensed(OccupancyGrid(clean.frame, cells), floor, _seen(floor, scans))


def _seen(floor: Floor, scans: Scans) -> Mask:
    seen = np.zeros(floor.solid.shape, np.uint8)
    for ring in scans.ends(scans.ranges - TRUTH_RESOLUTION_M):
        fill_ring(seen, floor.frame.to_cells(ring), 1)
    return np.asarray(seen > 0) & ~floor.solid


def grid_of(scans: Scans, distortion: Distortion, resolution: float, effects: Effects, rng: Generator) -> OccupancyGrid:
    """Scans on a grid that is just large enough: what most rays swept is free, where enough of them ended is occupied."""
    ranges = scans.ranges + effects.range_noise_m * rng.normal(size=scans.ranges.shape)
    errors = rng.normal(size=(len(scans.places), 3)) * (
        effects.scan_noise_m,
        effects.scan_noise_m,
        radians(effects.scan_noise_deg),
    )

    def placed(reach: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        ends = scans.ends(reach)
        return distortion.apply(_misplaced(ends, scans.places, errors).reshape(-1, 2)).reshape(ends.shape)

    hits, rims = placed(ranges), placed(ranges - _SHORT_OF_WALL_CELLS * resolution)
    frame = _frame_around(hits.reshape(-1, 2), resolution)
    ended = _ended(frame, hits, np.isfinite(ranges))
    swept = _swept(frame, rims)
    cells = np.where(swept > 0, np.uint8(Cell.FREE), np.uint8(Cell.UNEXPLORED))
    cells[(ended > 0) & (ended >= _OCCUPIED_SHARE * (ended + swept))] = Cell.OCCUPIED
    return OccupancyGrid(frame, cells)


def _misplaced(
    ends: npt.NDArray[np.float64], places: Points, errors: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Each scan moved and turned about its place by its error (v, 3): x, y, yaw."""
    arms = ends - places[:, None]
    cos, sin = np.cos(errors[:, 2])[:, None], np.sin(errors[:, 2])[:, None]
    turned = np.stack([cos * arms[..., 0] - sin * arms[..., 1], sin * arms[..., 0] + cos * arms[..., 1]], -1)
    return np.asarray(places[:, None] + errors[:, None, :2] + turned)


def _frame_around(points: Points, resolution: float) -> GridFrame:
    """Around all points, its cells' edges on multiples of the resolution."""
    low = np.floor(points.min(0) / resolution) - _MARGIN_CELLS
    width, height = (np.ceil(points.max(0) / resolution) + _MARGIN_CELLS - low).astype(int).tolist()
    x, y = (low * resolution).tolist()
    return GridFrame(resolution, width, height, Pose(round(x, 6), round(y, 6)))


def _ended(frame: GridFrame, hits: npt.NDArray[np.float64], real: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """In how many scans a ray ended in each cell."""
    cells = np.floor(frame.to_cells(hits.reshape(-1, 2))).astype(np.int64)
    scan = np.repeat(np.arange(len(hits)), hits.shape[1])
    size = frame.width * frame.height
    once = np.unique((scan * size + cells[:, 1] * frame.width + cells[:, 0])[real.ravel()])
    return np.bincount(once % size, minlength=size).reshape(frame.height, frame.width)


def _swept(frame: GridFrame, rims: npt.NDArray[np.float64]) -> npt.NDArray[np.uint16]:
    """How many scans swept each cell."""
    total = np.zeros((frame.height, frame.width), np.uint16)
    for rim in rims:
        corners = frame.to_cells(rim)
        (left, low), (right, high) = np.floor(corners.min(0)).astype(int), np.ceil(corners.max(0)).astype(int) + 1
        one = np.zeros((high - low, right - left), np.uint8)
        fill_ring(one, corners - (left, low), 1)
        total[low:high, left:right] += one[: frame.height - low, : frame.width - left]
    return total


def with_gaps(grid: OccupancyGrid, home: Home, distortion: Distortion, effects: Effects, rng: Generator) -> Cells:
    """Cells with stretches of wall missing that the robot did not sense; some it takes for floor, through the wall."""
    cells = grid.cells.copy()
    faces = shapely.union_all([room.polygon.exterior for room in home.rooms])
    for _ in range(rng.poisson(effects.gaps_per_10m * faces.length / 10)):
        along, size, leak = rng.random(), rng.uniform(*effects.gap_m), rng.random() < _LEAK
        point = as_points(shapely.get_coordinates(_along(faces, along)))
        gap = _disc(grid.frame, distortion.apply(point), size / 2)
        cells[gap & ((cells != Cell.FREE) if leak else (cells == Cell.OCCUPIED))] = (
            Cell.FREE if leak else Cell.UNEXPLORED
        )
    return cells


def _along(lines: shapely.Geometry, share: float) -> shapely.Geometry:
    """The point after that share of the length of several lines laid end to end."""
    left = share * lines.length
    for line in shapely.get_parts(lines):
        if left <= line.length:
            break
        left -= line.length
    return shapely.line_interpolate_point(line, left)


def with_specks(grid: OccupancyGrid, home: Home, distortion: Distortion, effects: Effects, rng: Generator) -> Cells:
    """Cells with false obstacles on the floor."""
    cells = grid.cells.copy()
    x0, y0, x1, y1 = home.walls.bounds
    floor = shapely.union_all([room.polygon for room in home.rooms])
    for _ in range(rng.poisson(effects.specks * (x1 - x0) * (y1 - y0) / 10)):
        x, y, radius = rng.uniform(x0, x1), rng.uniform(y0, y1), rng.uniform(0.3, 1.2) * grid.frame.resolution
        if shapely.contains_xy(floor, x, y):
            speck = _disc(grid.frame, distortion.apply(as_points((x, y))), radius)
            cells[speck & (cells == Cell.FREE)] = Cell.OCCUPIED
    return cells


def _disc(frame: GridFrame, centre: Points, radius: float) -> Mask:
    """Cells whose middle is within `radius` metres of a point (1, 2), and the cell around it."""
    column, row = frame.to_cells(centre)[0]
    rows, columns = np.ogrid[: frame.height, : frame.width]
    near = np.hypot(rows + 0.5 - row, columns + 0.5 - column) * frame.resolution <= radius
    return np.asarray(near | ((rows == np.floor(row)) & (columns == np.floor(column))))
