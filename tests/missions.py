"""A robot's missions through a home that stays as it is, sensed a little differently each time."""

import cv2
import numpy as np
import shapely

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import Cell, OccupancyGrid, look_up
from stillroom.maps.mission import Mission, Tracking, tracked_motion
from stillroom.maps.semantics import SemanticMap


def sense(home: OccupancyGrid, pose: Pose, rng: np.random.Generator, ragged: float = 0.15) -> OccupancyGrid:
    """`home` moved by `pose` within its frame; a share of the cells along each wall's face comes out on the wrong side of it."""
    frame = home.frame
    columns, rows = np.meshgrid(np.arange(frame.width), np.arange(frame.height))
    centres = frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1)) + 0.5)
    cells = look_up(home.cells, frame.to_cells(pose.inverse().apply(centres)), Cell.UNEXPLORED)
    cells = cells.reshape(frame.height, frame.width)
    free, occupied = cells == Cell.FREE, cells == Cell.OCCUPIED
    wrong = rng.random(cells.shape) < ragged
    cells = np.where(wrong & free & _beside(occupied), Cell.OCCUPIED, cells)
    cells = np.where(wrong & occupied & _beside(free), Cell.FREE, cells)
    return OccupancyGrid(frame, cells.astype(np.uint8))


def _beside(mask: np.ndarray) -> np.ndarray:
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    return np.asarray(cv2.dilate(mask.astype(np.uint8), cross) > 0)


def track_all(base: SemanticMap, pose: Pose, rng: np.random.Generator, noise_m: float) -> Tracking:
    """Every vertex of the base's rooms and dividers as a robot's SLAM tracks it: moved by `pose`, each with its own error."""

    def tracked(points: Points) -> Points:
        return pose.apply(points) + rng.normal(0, noise_m, points.shape)

    return Tracking(
        rooms={r.id: tracked(shapely.get_coordinates(r.polygon.exterior)[:-1]) for r in base.rooms},
        dividers={d.id: tracked(as_points(d.line)) for d in base.dividers},
    )


def mission(mission_id: str, base: SemanticMap, tracking: Tracking, grid: OccupancyGrid) -> Mission:
    """A mission whose tracking fits its base entirely."""
    motion, warnings = tracked_motion(base, tracking)
    assert warnings == ()
    return Mission(mission_id, grid, motion)


def random_pose(rng: np.random.Generator, shift_m: float, turn: float) -> Pose:
    """A few centimetres and a fraction of a degree: what a frame moves between missions."""
    x, y = rng.normal(0, shift_m, 2)
    return Pose(float(x), float(y), float(rng.normal(0, turn)))
