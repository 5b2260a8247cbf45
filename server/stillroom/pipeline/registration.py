"""Registration of a new grid where the robot tracked nothing: any angle, metres of shift, and an honest "not found".

The directions in which walls face give the turn, their correlation the shift (by FFT, one channel for each direction, so that inside and
outside are never mixed up), and alignment the rest. Buildings are nearly symmetric: where two poses explain the walls alike, neither is taken.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import Cell, OccupancyGrid, look_up
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.alignment import WallSamples, align, sample_walls
from stillroom.pipeline.params import Params
from stillroom.pipeline.walls import outline, separate_clutter

CELL_M = 0.15
BLUR_M = 0.25
SECTORS = 8
"""Directions that are correlated apart."""
HYPOTHESES = 6
TURNS_APART_DEG = 8
SHIFTS_PER_TURN = 2
REFINED = 4
"""Hypotheses that are aligned in full."""
SAME_POSE_M = 0.5
FLOOR_SAMPLES = 1500


@dataclass(frozen=True, eq=False)
class Registration:
    """The best motion from the previous frame to the grid's and how sure it is.

    `share` of the previous walls in sight are found again, `floor` of the larger floor is common (of the smaller one, where the robot's
    frame has not moved at all), `rival` is the share of the best pose that is a different one.
    """

    motion: Motion
    share: float
    floor: float
    rival: float

    def found(self, params: Params) -> bool:
        return (
            self.share >= params.registration_share
            and self.floor >= params.registration_floor
            and self.rival <= params.registration_margin * self.share
        )


def register(previous: SemanticMap, grid: OccupancyGrid, params: Params) -> Registration:
    """The pose of `previous` in the grid's frame; it counts only where `found` says so."""
    at_rest = align(previous, IDENTITY, grid, params.search_reach_m, params)
    known, free = _areas(previous, grid)
    common = _common_floor(previous, at_rest.motion, grid)
    enough = at_rest.seen >= params.registration_seen
    if (
        enough
        and at_rest.share >= params.registration_certain
        and common >= params.registration_floor * min(known, free)
    ):
        return Registration(at_rest.motion, at_rest.share, common / min(known, free), 0.0)
    before = sample_walls([as_points(wall.line) for wall in previous.walls])
    floor = outline(separate_clutter(grid, params).floor, grid.frame, params, smallest_m2=params.pocket_area_m2)
    rings = [ring for polygon in floor.geoms for ring in (polygon.exterior, *polygon.interiors)]
    after = sample_walls([shapely.get_coordinates(ring) for ring in rings])
    larger = max(known, free, 1e-9)
    tried = [(common / larger, at_rest)]
    if len(before.points) and len(after.points):
        for pose in _poses(before, after)[:REFINED]:
            aligned = align(previous, Motion.rigid(pose), grid, params.alignment_reach_m, params)
            tried.append((_common_floor(previous, aligned.motion, grid) / larger, aligned))
    tried.sort(key=lambda entry: -entry[0] * entry[1].share)
    floor_share, best = tried[0]
    rivals = [f * other.share for f, other in tried[1:] if not _same(best.motion, other.motion, previous)]
    return Registration(best.motion, best.share, floor_share, max(rivals, default=0.0) / max(floor_share, 1e-9))


def _poses(before: WallSamples, after: WallSamples) -> list[Pose]:
    """Poses that bring the walls of `before` onto those of `after`, best correlation first."""
    centre = before.points.mean(0)
    size = float(max(np.ptp(before.points, axis=0).max() * 1.5, np.ptp(after.points, axis=0).max()) + 2.0)
    cells = cv2.getOptimalDFTSize(int(np.ceil(2 * size / CELL_M)))
    low = after.points.min(0) - 1.0
    target = np.fft.rfft2(_channels(after.points - low, after.normals, cells, blur=True))
    found: list[tuple[float, Pose]] = []
    for yaw in _turns(before.normals, after.normals):
        turn = Pose(yaw=yaw)
        points, normals = turn.apply(before.points - centre), before.normals @ turn.rotation.T
        corner = points.min(0)
        moving = np.fft.rfft2(_channels(points - corner, normals, cells, blur=False))
        match = np.fft.irfft2((target * np.conj(moving)).sum(0), s=(cells, cells))
        for score, shift in _peaks(match):
            x, y = low + shift * CELL_M - corner - turn.apply(centre[None])[0]
            found.append((score, Pose(float(x), float(y), yaw)))
    return [pose for _, pose in sorted(found, key=lambda entry: -entry[0])]


def _turns(before: Points, after: Points) -> list[float]:
    """Angles (radians) at which the directions of two sets of normals agree best, at least `TURNS_APART_DEG` apart."""
    histograms = []
    for normals in (before, after):
        degrees = np.degrees(np.arctan2(normals[:, 1], normals[:, 0])) % 360
        counts = np.bincount(np.round(degrees * 2).astype(int) % 720, minlength=720).astype(float)
        kernel = np.exp(-0.5 * (np.arange(-8, 9) / 3.0) ** 2)
        histograms.append(np.fft.rfft(np.convolve(np.concatenate([counts[-8:], counts, counts[:8]]), kernel, "valid")))
    match = np.fft.irfft(histograms[1] * np.conj(histograms[0]), 720)
    turns: list[float] = []
    for _ in range(HYPOTHESES):
        best = int(match.argmax())
        turns.append(np.radians(best / 2))
        match[np.arange(best - 2 * TURNS_APART_DEG, best + 2 * TURNS_APART_DEG + 1) % 720] = -np.inf
    return turns


def _channels(points: Points, normals: Points, cells: int, blur: bool) -> npt.NDArray[np.float32]:
    """Wall points as one picture a direction, (SECTORS, cells, cells); a direction counts for the two sectors that it lies between."""
    pictures = np.zeros((SECTORS, cells, cells), np.float32)
    sector = (np.arctan2(normals[:, 1], normals[:, 0]) / (2 * np.pi) * SECTORS) % SECTORS
    first = np.floor(sector).astype(int)
    column, row = np.clip(np.round(points / CELL_M).astype(int), 0, cells - 1).T
    np.add.at(pictures, (first % SECTORS, row, column), 1 - (sector - first))
    np.add.at(pictures, ((first + 1) % SECTORS, row, column), sector - first)
    pictures = np.minimum(pictures, 2.0)
    if blur:
        pictures = np.stack([cv2.GaussianBlur(picture, (0, 0), BLUR_M / CELL_M) for picture in pictures])
    return pictures


def _peaks(match: npt.NDArray[np.float64]) -> list[tuple[float, Points]]:
    """The highest values of a cyclic correlation and their shifts (column, row) in cells, apart from each other."""
    size = len(match)
    apart = round(4 * SAME_POSE_M / CELL_M)
    found = []
    for _ in range(SHIFTS_PER_TURN):
        row, column = np.unravel_index(match.argmax(), match.shape)
        found.append((float(match[row, column]), (np.array([column, row]) + size // 2) % size - size // 2.0))
        match[
            np.ix_(np.arange(row - apart, row + apart + 1) % size, np.arange(column - apart, column + apart + 1) % size)
        ] = -np.inf
    return found


def _areas(previous: SemanticMap, grid: OccupancyGrid) -> tuple[float, float]:
    """Square metres of the previous rooms and of the grid's free cells."""
    return sum(float(room.polygon.area) for room in previous.rooms), float(grid.free.sum()) * grid.frame.resolution**2


def _common_floor(previous: SemanticMap, motion: Motion, grid: OccupancyGrid) -> float:
    """Square metres of the previous rooms that lie on free cells."""
    rooms = shapely.union_all([room.polygon for room in previous.rooms])
    if rooms.is_empty:
        return 0.0
    step = float(np.sqrt(rooms.area / FLOOR_SAMPLES))
    west, south, east, north = rooms.bounds
    x, y = np.meshgrid(np.arange(west + step / 2, east, step), np.arange(south + step / 2, north, step))
    points = np.stack([x.ravel(), y.ravel()], 1)
    points = points[shapely.contains_xy(rooms, points)]
    cells = look_up(grid.cells, grid.frame.to_cells(motion.apply(points)), Cell.UNEXPLORED)
    return float((cells == Cell.FREE).mean()) * float(rooms.area)


def _same(first: Motion, second: Motion, previous: SemanticMap) -> bool:
    """Whether two motions put the map in the same place."""
    corners = previous.vertices()
    gap = np.linalg.norm(first.apply(corners) - second.apply(corners), axis=1)
    return float(np.median(gap)) < SAME_POSE_M
