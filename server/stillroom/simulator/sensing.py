"""What a robot senses of a home: where it gets to, and the range scans that it takes there."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from numpy.random import Generator
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose, as_points, polygons_in
from stillroom.maps.grid import GridFrame, Mask, distance_to
from stillroom.simulator.changes import World
from stillroom.simulator.homes import Door
from stillroom.simulator.plans import thick_line

ROBOT_RADIUS_M = 0.17
SCAN_SPACING_M = 0.8
"""No place that the robot gets to is farther than this from a scan."""
RAYS = 600
RANGE_M = 7.0
TRUTH_RESOLUTION_M = 0.025
"""Of the raster that scans are taken in."""
_CHUNK = 40
"""Cells along a ray that are looked at in one go."""
_STEP_CELLS = 4
_SUBPIXEL_BITS = 4


@dataclass(frozen=True, eq=False)
class Floor:
    """A home as a raster: where a ray ends. `solid` includes all that lies outside, but for what is seen through windows."""

    frame: GridFrame
    solid: Mask
    glass: Mask
    """Where rays pass and the robot does not."""

    def centres(self, cells: npt.NDArray[np.int64]) -> Points:
        """Middles (n, 2) of cells (n, 2) given as row, column."""
        return self.frame.to_map(cells[:, ::-1].astype(np.float64) + 0.5)


@dataclass(frozen=True, eq=False)
class Scans:
    """`places` (v, 2) in the home; `ranges` (v, RAYS) metres, infinite where nothing was hit."""

    places: Points
    ranges: npt.NDArray[np.float64]

    def ends(self, ranges: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Where rays of these lengths end (v, RAYS, 2); those that hit nothing end at the sensor's reach."""
        clipped = np.clip(ranges, TRUTH_RESOLUTION_M, RANGE_M)
        return self.places[:, None] + clipped[..., None] * _directions()[None]


def rasterise(world: World) -> Floor:
    home = world.home
    x0, y0, x1, y1 = shapely.union_all([home.walls, *(window.view for window in home.windows)]).bounds
    step, margin = TRUTH_RESOLUTION_M, 2 * TRUTH_RESOLUTION_M
    width, height = (int(np.ceil((high - low + 2 * margin) / step)) for low, high in ((x0, x1), (y0, y1)))
    frame = GridFrame(step, width, height, Pose(x0 - margin, y0 - margin))
    solid, glass = np.ones((height, width), np.uint8), np.zeros((height, width), np.uint8)
    clear = [window for window in home.windows if window.id in world.clear]
    for part in (part for window in clear for part in (*window.panes.geoms, *window.view.geoms)):
        fill(solid, frame, part, 0)
    for pane in (pane for window in clear for pane in window.panes.geoms):
        fill(glass, frame, pane, 1)
    # all that the edge touches is filled: without half a cell less, rays would slip through thin walls
    shrunk = shapely.buffer([room.polygon for room in home.rooms], -step / 2, join_style="mitre")
    for part in polygons_in(shrunk):
        fill(solid, frame, part, 0)
    for door in home.doors:
        fill(solid, frame, _threshold(door), 0)
        if door.id in world.shut:
            fill(solid, frame, door.polygon, 1)
    for thing in (*world.in_doorways, *(part for piece in home.furniture for part in piece.solid.geoms)):
        fill(solid, frame, thing, 1)
    return Floor(frame, solid > 0, glass > 0)


def _threshold(door: Door) -> Polygon:
    """A doorway with a cell of both rooms, so that the raster has no seam between them."""
    length = float(np.linalg.norm(np.diff(as_points(door.line), axis=0)))
    return thick_line(door.line, door.polygon.area / length + 2 * TRUTH_RESOLUTION_M)


def fill(image: npt.NDArray[np.uint8], frame: GridFrame, polygon: Polygon, value: int) -> None:
    """Draws a polygon, but for its holes, into an image whose row 0 is the lowest y."""
    rings = [frame.to_cells(shapely.get_coordinates(ring)) for ring in (polygon.exterior, *polygon.interiors)]
    _fill(image, rings, value)


def fill_ring(image: npt.NDArray[np.uint8], corners: Points, value: int) -> None:
    """Draws what lies in a ring (n, 2) in continuous cell coordinates."""
    _fill(image, [corners], value)


def _fill(image: npt.NDArray[np.uint8], rings: Sequence[Points], value: int) -> None:
    scaled = [np.round((ring - 0.5) * (1 << _SUBPIXEL_BITS)).astype(np.int32) for ring in rings]
    cv2.fillPoly(image, scaled, value, shift=_SUBPIXEL_BITS)


@dataclass(frozen=True, eq=False)
class Reach:
    """The cells of the floor that the robot's middle gets to, and the one (row, column) that it starts from."""

    cells: Mask
    start: tuple[int, int]


def reach(world: World, floor: Floor) -> Reach:
    """All that the robot gets to from its dock before its battery ends, in the rooms that it enters."""
    clear = distance_to(floor.solid | floor.glass, TRUTH_RESOLUTION_M) >= ROBOT_RADIUS_M
    for name in sorted(world.skipped):
        left_out = clear.astype(np.uint8)
        fill(left_out, floor.frame, shapely.buffer(world.home.room(name).polygon, 0.3), 0)
        clear = left_out > 0
    labels = cv2.connectedComponents(clear.astype(np.uint8), connectivity=4)[1]
    cells = np.argwhere(labels > 0)
    dock = floor.frame.to_cells(as_points(world.home.dock))[0, ::-1]
    row, column = cells[((cells - dock) ** 2).sum(1).argmin()].tolist()
    reached = labels == labels[row, column]
    if world.battery < 1.0:
        inside = np.argwhere(reached)
        way = _way_to(np.concatenate([[[row, column]], inside]), reached)[1:]
        reached[tuple(inside[way > np.quantile(way, world.battery)].T)] = False
    return Reach(reached, (row, column))


def route(floor: Floor, reached: Reach, rng: Generator) -> Points:
    """Where the robot scans (n, 2), at its dock first: all over what it gets to."""
    coarse = np.argwhere(reached.cells)
    coarse = coarse[rng.permutation(len(coarse))[: max(len(coarse) // 25, 1)]]
    return _spread(floor.centres(np.concatenate([[reached.start], coarse])), SCAN_SPACING_M)


def _way_to(cells: npt.NDArray[np.int64], reached: Mask) -> npt.NDArray[np.int64]:
    """How far the robot has to go to each of the cells (n, 2) from the first, in steps of `_STEP_CELLS`; shape (n,)."""
    height, width = (np.array(reached.shape) // _STEP_CELLS + 1).tolist()
    rows, columns = (np.argwhere(reached) // _STEP_CELLS).T
    passable = np.zeros((height, width), np.uint8)
    passable[rows, columns] = 1
    front = np.zeros_like(passable)
    coarse = cells // _STEP_CELLS
    front[tuple(coarse[0])] = 1
    way = np.zeros(passable.shape, np.int64)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    while True:
        grown = cv2.dilate(front, cross) & passable
        if (grown == front).all():
            return np.asarray(way[coarse[:, 0], coarse[:, 1]])
        way += (passable > 0) & (grown == 0)
        front = grown


def _spread(points: Points, spacing: float) -> Points:
    """Farthest points first, from the first one on, until every point is within `spacing` of one of them."""
    chosen = [0]
    nearest = np.linalg.norm(points - points[0], axis=1)
    while nearest.max() > spacing:
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def take_scans(floor: Floor, places: Points) -> Scans:
    """Ranges from the middle of the cell of each place, to the resolution of the floor's raster."""
    reach = round(RANGE_M / TRUTH_RESOLUTION_M)
    padded = np.pad(floor.solid, reach + 1, constant_values=True)
    cells = np.floor(floor.frame.to_cells(places)).astype(np.int64)
    starts = (cells[:, 1] + reach + 1) * padded.shape[1] + cells[:, 0] + reach + 1
    directions = _directions()
    offsets = np.round(np.arange(1, reach + 1)[None, :, None] * directions[:, None]).astype(np.int64)
    flat = (offsets[..., 1] * padded.shape[1] + offsets[..., 0]).astype(np.int32)
    around = padded.ravel()
    ranges = np.full(len(places) * RAYS, np.inf)
    going = np.arange(len(ranges))
    for done in range(0, reach, _CHUNK):
        blocked = around[starts[going // RAYS, None] + flat[going % RAYS, done : done + _CHUNK]]
        ends = blocked.any(1)
        ranges[going[ends]] = (done + blocked[ends].argmax(1) + 1) * TRUTH_RESOLUTION_M
        going = going[~ends]
    return Scans(floor.centres(cells[:, ::-1]), ranges.reshape(len(places), RAYS))


def _directions() -> Points:
    angles = np.arange(RAYS) * (2 * np.pi / RAYS)
    return np.stack([np.cos(angles), np.sin(angles)], 1)
