"""Registration of a new grid where the robot tracked nothing: any angle, metres of shift, and an honest "not found".

Each likely pose is judged by what speaks for it and against: walls found again and walls that are gone, obstacles where floor was, floor
that both have. Buildings are nearly symmetric, and floors of one house alike: where two poses fit nearly as well, neither is taken.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import shapely

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import GridFrame, Mask, OccupancyGrid, look_up
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.alignment import (
    FRONTIER_WEIGHT,
    SAMPLE_M,
    Faces,
    WallSamples,
    align,
    faces_of,
    sample_walls,
    settle,
)
from stillroom.pipeline.correlation import likely_poses
from stillroom.pipeline.evidence import (
    FOUND_M,
    faces_of_obstacles,
    floor_cells,
    grown,
    known_cells,
    large_pieces,
    look_for_walls,
)
from stillroom.pipeline.params import Params
from stillroom.pipeline.walls import outline, separate_clutter

REFINED = 6
"""Likely poses that are looked at closely."""
SAME_POSE_M = 1.0
"""Poses nearer to each other than this are one, not quite settled, and no rivals."""
DRAWN_M = 0.05
"""The previous map is drawn with cells of this size,"""
DRAWN_MARGIN_M = 0.5
"""and so much around it."""
FLOOR_SAMPLES = 1500
OBSTACLE_SAMPLES = 6000


@dataclass(frozen=True, eq=False)
class Registration:
    """The best motion from the previous frame to the grid's and how sure it is.

    `share` of the previous walls in sight are found again; `fit` also counts what is new and the floor that is common (0 to 1, see `_Fit`);
    `rival` is the fit of the best pose that is a different one.
    """

    motion: Motion
    share: float
    fit: float
    rival: float

    def ambiguous(self, params: Params) -> bool:
        """Another pose fits nearly as well."""
        return self.rival > params.registration_margin * self.fit

    def found(self, params: Params) -> bool:
        return self.fit >= params.registration_fit and not self.ambiguous(params)


def register(previous: SemanticMap, grid: OccupancyGrid, params: Params) -> Registration:
    """The pose of `previous` in the grid's frame; it counts only where `found` says so."""
    known, sensed = _Known.of(previous), _Sensed.of(grid)
    at_rest = _fit(settle(known.outline, sensed.faces, params.search_reach_m), known, sensed, params)
    if at_rest.certain(params):
        return _registration(previous, grid, at_rest, 0.0, params)
    after = _outline(grid, params)
    tried = [at_rest]
    if len(known.outline.points) and len(after.points):
        for pose in likely_poses(known.outline, after)[:REFINED]:
            settled = settle(known.outline.moved(pose), sensed.faces, params.alignment_reach_m).after(pose)
            tried.append(_fit(settled, known, sensed, params))
    best = max(tried, key=lambda fit: fit.value)
    rivals = [fit.value for fit in tried if fit is not best and not _same(best.pose, fit.pose, known.outline.points)]
    return _registration(previous, grid, best, max(rivals, default=0.0), params)


def _registration(
    previous: SemanticMap, grid: OccupancyGrid, best: "_Fit", rival: float, params: Params
) -> Registration:
    motion = align(previous, Motion.rigid(best.pose), grid, params.alignment_reach_m, params).motion
    return Registration(motion, best.found, best.value, rival)


@dataclass(frozen=True)
class _Fit:
    """What speaks for a pose: shares of 0 to 1.

    `seen` of the previous walls are in sight (0 where too little is to say anything), `found` of those are found again; `new` is the length
    of new obstacles, relative to what is in sight. `floor` of the previous floor is free in the grid, `known` of the grid's is in rooms.
    """

    pose: Pose
    seen: float
    found: float
    new: float
    floor: float
    known: float

    @property
    def agreement(self) -> float:
        """Walls that both have, of all that either has."""
        return self.found / (1.0 + self.new)

    @property
    def value(self) -> float:
        """What one of two maps has explored and the other has not speaks against neither, but less floor in common is less evidence."""
        return self.agreement * sqrt(self.floor * self.known) if self.seen > 0 else 0.0

    def certain(self, params: Params) -> bool:
        """Good enough that no other pose is tried: most frames stay as they are."""
        return (
            self.seen >= params.registration_seen
            and self.agreement >= params.registration_certain
            and max(self.floor, self.known) >= params.registration_floor
        )


@dataclass(frozen=True, eq=False)
class _Known:
    """The previous map: all of its `outline`, its `walls`, and what of it only borders unexplored space (`open`), as samples; `floor` and
    what is no new obstacle (`familiar`) drawn on `frame`; `places` (n, 2) spread over the floor."""

    outline: WallSamples
    walls: WallSamples
    open: WallSamples
    frame: GridFrame
    floor: Mask
    familiar: Mask
    places: Points

    @staticmethod
    def of(previous: SemanticMap) -> "_Known":
        lines = [(wall.kind, as_points(wall.line)) for wall in previous.walls]
        corners = [shapely.get_coordinates(room.polygon) for room in previous.rooms] + [line for _, line in lines]
        frame = _around(np.concatenate([np.zeros((0, 2)), *corners]))
        floor = floor_cells(previous, frame)
        return _Known(
            outline=sample_walls([line for _, line in lines]),
            walls=sample_walls([line for kind, line in lines if kind != "open"]),
            open=sample_walls([line for kind, line in lines if kind == "open"]),
            frame=frame,
            floor=floor,
            familiar=known_cells(previous, frame),
            places=_spread(floor, frame, FLOOR_SAMPLES),
        )


@dataclass(frozen=True, eq=False)
class _Sensed:
    """The grid, and places (n, 2) on its floor and its `obstacles`, of which each stands for `obstacle_m` of length."""

    grid: OccupancyGrid
    faces: Faces
    near_obstacles: Mask
    near_ends: Mask
    places: Points
    obstacles: Points
    obstacle_m: float

    @staticmethod
    def of(grid: OccupancyGrid) -> "_Sensed":
        obstacles = large_pieces(grid.occupied, grid.frame) & faces_of_obstacles(grid)
        some = _spread(obstacles, grid.frame, OBSTACLE_SAMPLES)
        return _Sensed(
            grid=grid,
            faces=faces_of(grid),
            near_obstacles=grown(grid.occupied, FOUND_M, grid.frame),
            near_ends=grown(~grid.free, FOUND_M, grid.frame),
            places=_spread(grid.free, grid.frame, FLOOR_SAMPLES),
            obstacles=some,
            obstacle_m=float(obstacles.sum()) * grid.frame.resolution / max(len(some), 1),
        )


def _around(points: Points) -> GridFrame:
    """A frame around points (n, 2)."""
    if not len(points):
        return GridFrame(DRAWN_M, 1, 1)
    low, high = points.min(0) - DRAWN_MARGIN_M, points.max(0) + DRAWN_MARGIN_M
    width, height = np.ceil((high - low) / DRAWN_M).astype(int).tolist()
    x, y = low.tolist()
    return GridFrame(DRAWN_M, width, height, Pose(x, y))


def _spread(mask: Mask, frame: GridFrame, count: int) -> Points:
    """The middles (n, 2) of at least `count` cells of a mask, evenly taken, or of all there are."""
    rows, columns = np.nonzero(mask)
    every = max(1, len(rows) // count)
    return frame.to_map(as_points(np.stack([columns[::every], rows[::every]], 1)) + 0.5)


def _outline(grid: OccupancyGrid, params: Params) -> WallSamples:
    """The walls of a grid without history."""
    floor = outline(separate_clutter(grid, params).floor, grid.frame, params, smallest_m2=params.pocket_area_m2)
    return sample_walls([shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(floor))])


def _fit(pose: Pose, known: _Known, sensed: _Sensed, params: Params) -> _Fit:
    """Looks at a pose. Where robots sense no walls, the border to unexplored space says a little."""
    walls = look_for_walls(known.walls.moved(pose), sensed.near_obstacles, sensed.grid)
    ends = look_for_walls(known.open.moved(pose), sensed.near_ends, sensed.grid)
    found, seen = (float(wall.sum() + FRONTIER_WEIGHT * end.sum()) for wall, end in zip(walls, ends, strict=True))
    all_of_it = len(known.walls.points) + FRONTIER_WEIGHT * len(known.open.points)
    if seen * SAMPLE_M < params.plausible_length_m or not len(sensed.places):
        return _Fit(pose, 0.0, 0.0, 0.0, 0.0, 0.0)
    back = pose.inverse()
    obstacles = known.frame.to_cells(back.apply(sensed.obstacles))
    new = look_up(known.floor, obstacles, False) & ~look_up(known.familiar, obstacles, False)
    there = look_up(sensed.grid.free, sensed.grid.frame.to_cells(pose.apply(known.places)), False)
    return _Fit(
        pose=pose,
        seen=seen / all_of_it,
        found=found / seen,
        new=float(new.sum()) * sensed.obstacle_m / (seen * SAMPLE_M),
        floor=float(there.mean()),
        known=float(look_up(known.floor, known.frame.to_cells(back.apply(sensed.places)), False).mean()),
    )


def _same(first: Pose, second: Pose, points: Points) -> bool:
    """Whether two poses put points (n, 2) in the same place."""
    return float(np.median(np.linalg.norm(first.apply(points) - second.apply(points), axis=1))) < SAME_POSE_M
