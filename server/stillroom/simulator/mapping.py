"""The occupancy grid that a robot makes of its scans, as its SLAM puts them together, with what its sensors got wrong."""

from dataclasses import dataclass
from math import radians

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from stillroom.maps.geometry import Points, Pose
from stillroom.maps.grid import Cell, GridFrame, Mask, OccupancyGrid
from stillroom.simulator.changes import World
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.faults import LONG_GAP_M, SlamFailure, draw_gaps, draw_slam_failure, with_gaps, with_specks
from stillroom.simulator.sensing import TRUTH_RESOLUTION_M, Floor, Scans, fill_ring, rasterise, route, take_scans

_OCCUPIED_SHARE = 0.25
"""A cell is occupied where at least this share of the scans that came to it ended in it."""
_SHORT_OF_WALL_CELLS = 0.75
"""A ray has swept the cells up to this far before its end."""
_MARGIN_CELLS = 4
_FEWEST_SCANS = 6
"""Of a mission that is long enough for SLAM to fail in."""


@dataclass(frozen=True, eq=False)
class Sensed:
    """A mission's grid, and which cells of the home's `floor` were really seen to be free."""

    grid: OccupancyGrid
    floor: Floor
    seen: Mask
    happened: frozenset[str] = frozenset()
    """The effects, by their names in EFFECTS, that made this grid another."""


def sense(
    world: World, distortion: Distortion, mission: int, resolution: float, effects: Effects, streams: Streams
) -> Sensed:
    """One mission's grid of a home. The distortion moves where things land on the map, never what is seen."""
    floor = rasterise(world)
    scans = take_scans(floor, route(world, floor, streams.of("route", mission)))
    slam = streams.of("slam", mission)
    fails = mission > 0 and slam.random() < effects.slam_failures and len(scans.places) >= _FEWEST_SCANS
    failure = draw_slam_failure(scans.places, slam) if fails else None
    grid = grid_of(scans, distortion, resolution, effects, streams.of("scans", mission), failure)
    gaps = draw_gaps(world.home, mission, effects, streams.of("gaps", mission))
    grid = OccupancyGrid(grid.frame, with_gaps(grid, gaps, distortion))
    grid = OccupancyGrid(grid.frame, with_specks(grid, world.home, distortion, effects, streams.of("specks", mission)))
    happened = {"slam_failures": fails, "gaps": any(gap.length_m > LONG_GAP_M for gap in gaps)}
    return Sensed(grid, floor, _seen(floor, scans), frozenset(name for name, has in happened.items() if has))


def _seen(floor: Floor, scans: Scans) -> Mask:
    seen = np.zeros(floor.solid.shape, np.uint8)
    for ring in scans.ends(scans.ranges - TRUTH_RESOLUTION_M):
        fill_ring(seen, floor.frame.to_cells(ring), 1)
    return np.asarray(seen > 0) & ~floor.solid


def grid_of(
    scans: Scans,
    distortion: Distortion,
    resolution: float,
    effects: Effects,
    rng: Generator,
    failure: SlamFailure | None = None,
) -> OccupancyGrid:
    """Scans on a grid that is just large enough: what most rays swept is free, where enough of them ended is occupied."""
    ranges = scans.ranges + effects.range_noise_m * rng.normal(size=scans.ranges.shape)
    errors = rng.normal(size=(len(scans.places), 3)) * (
        effects.scan_noise_m,
        effects.scan_noise_m,
        radians(effects.scan_noise_deg),
    )

    def placed(reach: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        ends = scans.ends(reach)
        on_map = distortion.apply(_misplaced(ends, scans.places, errors).reshape(-1, 2)).reshape(ends.shape)
        return on_map if failure is None else _put_off(on_map, failure)

    hits, rims = placed(ranges), placed(ranges - _SHORT_OF_WALL_CELLS * resolution)
    frame = _frame_around(hits.reshape(-1, 2), resolution)
    real = np.isfinite(ranges)
    ended = _ended(frame, hits, real if failure is None else np.concatenate([real, real[failure.scans[failure.again]]]))
    swept = _swept(frame, rims)
    cells = np.where(swept > 0, np.uint8(Cell.FREE), np.uint8(Cell.UNEXPLORED))
    cells[(ended > 0) & (ended >= _OCCUPIED_SHARE * (ended + swept))] = Cell.OCCUPIED
    return OccupancyGrid(frame, cells)


def _put_off(ends: npt.NDArray[np.float64], failure: SlamFailure) -> npt.NDArray[np.float64]:
    """Scans (v, RAYS, 2) as a SLAM that failed puts them down; those that it has twice come after all others."""
    moved = failure.off.apply(ends[failure.scans].reshape(-1, 2)).reshape(-1, *ends.shape[1:])
    put = ends.copy()
    put[failure.scans[~failure.again]] = moved[~failure.again]
    return np.concatenate([put, moved[failure.again]])


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
    seen = np.sort((scan * size + cells[:, 1] * frame.width + cells[:, 0])[real.ravel()])
    once = seen[np.diff(seen, prepend=-1) > 0]
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
