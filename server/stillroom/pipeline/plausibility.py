"""Whether a grid shows the floor that it is taken for, whole: not another floor, and not one that a failure of SLAM has drawn twice.

Tracking can't tell: a robot that lost its way tracks its own mistake. The walls can. Where the previous map has walls, obstacles are found
again; a wall that is gone, and an obstacle where floor was, speak against it. Furniture, doors and gaps do so a little, another floor a lot.
After a failure of SLAM the walls are found and a second time beside, all moved and turned alike.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.alignment import SAMPLE_M, WallSamples, sample_walls
from stillroom.pipeline.evidence import (
    FOUND_M,
    count_in_large_pieces,
    faces_of_obstacles,
    floor_cells,
    grown,
    known_cells,
    look_for_walls,
)
from stillroom.pipeline.params import Params

ROOM_SIDE_M = 0.20
"""A wall's own side is free so far away from it."""
COPY_M = 0.10
"""A wall is there a second time where new obstacles lie within this distance of its copy."""
COPY_ACROSS = 1 / 3
"""So much of a copy lies where floor was."""
FEWEST_WALLS = 3
WALL_TURN_DEG, WALL_APART_M, WALL_M = 30.0, 0.5, 0.8
"""What counts as one wall: nearly the same direction and place, and so long."""
COPY_TURNS_DEG = np.arange(-15.0, 15.1, 2.5)
COPY_SHIFT_M = 3.0
"""The copy's shift at the home's middle, at the most: it turns about a place in the home,"""
COPY_FAR_M = 1.75
"""but no wall is looked for farther away than this: new rooms may have the shape of old ones."""
CELL_M = 0.15
CANDIDATES = 6


@dataclass(frozen=True)
class Plausibility:
    """What the walls say. Shares are of `in_sight_m`, the length of the previous walls whose places were explored.

    `walls_found`: obstacles lie where they were; `walls_new`: obstacles where floor was, as a length; `walls_twice`: the walls that
    are there a second time, all moved alike. `floor_known`: the common floor, as a share of the smaller of the grid's free cells and the previous
    rooms.
    """

    floor_known: float
    in_sight_m: float
    walls_found: float
    walls_new: float
    walls_twice: float

    @property
    def agreement(self) -> float:
        """Walls that both have, of all that either has."""
        return self.walls_found / (1.0 + self.walls_new)

    def other_floor(self, params: Params) -> bool:
        """The walls are others than those of the previous map; or none of them is in sight, and the floor is elsewhere."""
        if self.in_sight_m < params.plausible_length_m:
            return self.floor_known < params.plausible_floor
        return self.agreement < params.plausible_agreement

    def wrecked(self, params: Params) -> bool:
        """The floor is the right one, but a part of its walls is there twice."""
        enough = self.in_sight_m >= params.plausible_length_m
        return enough and self.walls_twice >= params.plausible_twice and not self.other_floor(params)


def plausibility(tracked: SemanticMap, grid: OccupancyGrid, params: Params) -> Plausibility:
    """Compares `tracked`, the previous map moved into the mission's frame (aligned), with the mission's grid."""
    samples = sample_walls([as_points(wall.line) for wall in tracked.walls if wall.kind != "open"])
    found, seen = look_for_walls(samples, grown(grid.occupied, FOUND_M, grid.frame), grid)
    floor = floor_cells(tracked, grid.frame)
    fewest = min(int(np.count_nonzero(grid.free)), int(np.count_nonzero(floor)))
    floor_known = float(np.count_nonzero(grid.free & floor) / max(fewest, 1))
    in_sight_m = float(seen.sum()) * SAMPLE_M
    if in_sight_m == 0:
        return Plausibility(floor_known, 0.0, 0.0, 0.0, 0.0)
    new = faces_of_obstacles(grid) & ~known_cells(tracked, grid.frame)
    twice = 0.0
    if np.count_nonzero(new) * grid.frame.resolution >= params.plausible_twice * in_sight_m:
        twice = _copied(samples.where(seen), grid, new, floor)
    return Plausibility(
        floor_known=floor_known,
        in_sight_m=in_sight_m,
        walls_found=float(found.sum() / seen.sum()),
        walls_new=count_in_large_pieces(new & floor, grid.frame) * grid.frame.resolution / in_sight_m,
        walls_twice=twice,
    )


def _copied(samples: WallSamples, grid: OccupancyGrid, new: Mask, floor: Mask) -> float:
    """The largest share of the walls that new obstacles repeat under one rigid motion, near the walls themselves."""
    near = grown(new, COPY_M, grid.frame)
    ranked = sorted(_motions(samples.points, grid.frame, new), key=lambda entry: -entry[0])
    return max(_repeated(samples, pose, grid, near, floor) for _, pose in ranked[:CANDIDATES])


def _repeated(samples: WallSamples, pose: Pose, grid: OccupancyGrid, near: Mask, floor: Mask) -> float:
    """The share of wall samples that a motion brings onto `near`, with the floor on their own side.

    A wall that goes on straight is no copy of itself, and one wall that has a parallel now is a new corridor: several walls make a copy. A
    copy of a room lies across the room; what lies around the known `floor` are the walls of rooms that are new.
    """
    moved = samples.moved(pose)
    shift = moved.points - samples.points
    hit = np.linalg.norm(shift, axis=1) <= COPY_FAR_M
    hit &= np.abs((shift * samples.normals).sum(1)) > FOUND_M
    hit &= look_up(near, grid.frame.to_cells(moved.points), False)
    beside = grid.frame.to_cells(moved.points - ROOM_SIDE_M * moved.normals)
    hit &= look_up(grid.free, beside, False)
    across = look_up(floor, grid.frame.to_cells(moved.points), False)[hit]
    is_copy = _walls_in(samples.where(hit)) >= FEWEST_WALLS and across.mean() >= COPY_ACROSS
    return float(hit.mean()) if is_copy else 0.0


def _walls_in(samples: WallSamples) -> int:
    """On how many walls samples lie: lines of one side and place, with a metre of samples on them or about that."""
    sides = np.round(np.degrees(np.arctan2(samples.normals[:, 1], samples.normals[:, 0])) / WALL_TURN_DEG)
    places = np.round((samples.points * samples.normals).sum(1) / WALL_APART_M)
    _, counts = np.unique(np.stack([sides, places], 1), axis=0, return_counts=True)
    return int((counts * SAMPLE_M >= WALL_M).sum())


def _motions(points: Points, frame: GridFrame, new: Mask) -> Iterator[tuple[float, Pose]]:
    """For each turn the shift that brings most of the wall points (n, 2) onto new obstacles, and how many: by correlation."""
    rows, columns = np.nonzero(new)
    obstacles = frame.to_map(as_points(np.stack([columns, rows], 1)) + 0.5)
    middle = points.mean(0)
    reach = round(COPY_SHIFT_M / CELL_M)
    radius = float(np.linalg.norm(points - middle, axis=1).max())
    obstacles = obstacles[(np.abs(obstacles - middle) < radius + COPY_SHIFT_M).all(1)]
    size = cv2.getOptimalDFTSize(2 * int(np.ceil((radius + COPY_SHIFT_M) / CELL_M)) + 2)

    def picture(places: Points) -> npt.NDArray[np.float32]:
        cells = np.floor((places - middle) / CELL_M).astype(np.int64) + size // 2
        counts = np.bincount(cells[:, 1] * size + cells[:, 0], minlength=size**2)
        return counts.reshape(size, size).astype(np.float32)

    target = cv2.dft(cv2.dilate(np.minimum(picture(obstacles), 1.0), np.ones((3, 3), np.uint8)))
    for degrees in COPY_TURNS_DEG.tolist():
        about = Pose(*middle.tolist()).after(Pose(yaw=np.radians(degrees))).after(Pose(*(-middle).tolist()))
        together = cv2.mulSpectrums(target, cv2.dft(picture(about.apply(points))), 0, conjB=True)
        match = cv2.idft(together, flags=cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT)
        match = np.roll(match, (reach, reach), (0, 1))[: 2 * reach + 1, : 2 * reach + 1]
        row, column = np.unravel_index(match.argmax(), match.shape)
        shift = Pose(float(column - reach) * CELL_M, float(row - reach) * CELL_M)
        yield float(match[row, column]), shift.after(about)
