"""The occupancy grid that a robot makes of what it senses, as its SLAM puts it together, with what its sensors got wrong."""

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
from stillroom.simulator.sensing import TRUTH_RESOLUTION_M, Floor, Scans, fill_ring, rasterise, reach, route, take_scans
from stillroom.simulator.touching import bodies, go_over, noisy, on_map, touch_grid

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
    reached = reach(world, floor)
    places = route(floor, reached, streams.of("route", mission))
    slam = streams.of("slam", mission)
    fails = mission > 0 and slam.random() < effects.slam_failures and len(places) >= _FEWEST_SCANS
    failure = draw_slam_failure(places, slam) if fails else None
    bumps, turned, yaw = streams.of("model", 2).random(3).tolist()
    drawn = Drawn(distortion, resolution, np.pi / 2 * yaw if turned < effects.turned_grids else 0.0, failure)
    rng = streams.of("scans", mission)
    if bumps < effects.bumpers:
        touched = go_over(floor, reached.cells, streams.of("touch", mission))
        grid, seen = drawn.touches(places, bodies(floor, touched), noisy(touched.contacts, effects, rng)), touched.swept
    else:
        scans = take_scans(floor, places)
        grid, seen = drawn.scans(scans, effects, rng), _seen(floor, scans)
    gaps = draw_gaps(world.home, mission, effects, streams.of("gaps", mission))
    grid = OccupancyGrid(grid.frame, with_gaps(grid, gaps, distortion))
    grid = OccupancyGrid(grid.frame, with_specks(grid, world.home, distortion, effects, streams.of("specks", mission)))
    happened = {
        "slam_failures": fails,
        "gaps": any(gap.length_m > LONG_GAP_M for gap in gaps),
        "bumpers": bumps < effects.bumpers,
        "turned_grids": turned < effects.turned_grids,
    }
    return Sensed(grid, floor, seen, frozenset(name for name, has in happened.items() if has))


def _seen(floor: Floor, scans: Scans) -> Mask:
    seen = np.zeros(floor.solid.shape, np.uint8)
    for ring in scans.ends(scans.ranges - TRUTH_RESOLUTION_M):
        fill_ring(seen, floor.frame.to_cells(ring), 1)
    return np.asarray(seen > 0) & ~floor.solid


@dataclass(frozen=True, eq=False)
class Drawn:
    """How a robot draws its map: what bends it, metres a cell, the grid's angle in its frame, and where SLAM failed."""

    distortion: Distortion
    resolution: float
    yaw: float = 0.0
    failure: SlamFailure | None = None

    def scans(self, scans: Scans, effects: Effects, rng: Generator) -> OccupancyGrid:
        """On a grid that is just large enough: what most rays swept is free, where enough of them ended is occupied."""
        ranges = scans.ranges + effects.range_noise_m * rng.normal(size=scans.ranges.shape)
        noise = effects.scan_noise_m, effects.scan_noise_m, radians(effects.scan_noise_deg)
        errors = rng.normal(size=(len(scans.places), 3)) * noise

        def placed(reach: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
            ends = _misplaced(scans.ends(reach), scans.places, errors)
            on_map = self.distortion.apply(ends.reshape(-1, 2)).reshape(ends.shape)
            return on_map if self.failure is None else _put_off(on_map, self.failure)

        hits, rims = placed(ranges), placed(ranges - _SHORT_OF_WALL_CELLS * self.resolution)
        frame = self._frame_around(hits.reshape(-1, 2))
        real = np.isfinite(ranges)
        if self.failure is not None:
            real = np.concatenate([real, real[self.failure.scans[self.failure.again]]])
        ended, swept = _ended(frame, hits, real), _swept(frame, rims)
        cells = np.where(swept > 0, np.uint8(Cell.FREE), np.uint8(Cell.UNEXPLORED))
        cells[(ended > 0) & (ended >= _OCCUPIED_SHARE * (ended + swept))] = Cell.OCCUPIED
        return OccupancyGrid(frame, cells)

    def touches(self, places: Points, swept: Points, contacts: Points) -> OccupancyGrid:
        """Of points of the home (n, 2) that the robot passed over and (m, 2) that it touched; `places` as for scans."""
        bodies, hits = (on_map(points, places, self.distortion, self.failure) for points in (swept, contacts))
        return touch_grid(self._frame_around(np.concatenate([bodies, hits])), bodies, hits)

    def _frame_around(self, points: Points) -> GridFrame:
        """Around all points, its cells' edges on multiples of the resolution."""
        turn = Pose(yaw=self.yaw)
        straight = turn.inverse().apply(points)
        low = np.floor(straight.min(0) / self.resolution) - _MARGIN_CELLS
        width, height = (np.ceil(straight.max(0) / self.resolution) + _MARGIN_CELLS - low).astype(int).tolist()
        ((x, y),) = turn.apply((low * self.resolution)[None]).tolist()
        return GridFrame(self.resolution, width, height, Pose(round(x, 6), round(y, 6), self.yaw))


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
