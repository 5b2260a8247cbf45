"""What a grid shows otherwise than an earlier one of the same floor, for people who want to see why they are asked. Nothing is decided by it."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Pose, as_points, polygons_in
from stillroom.maps.grid import Cell, Cells, GridFrame, Mask, OccupancyGrid, distance_to, look_up
from stillroom.pipeline.evidence import FOUND_M, grown
from stillroom.pipeline.tracing import trace

Change = Literal["blocked", "opened", "found", "unseen"]
"""What was floor is obstacle; what was obstacle is floor; floor where nothing was known; known floor that was not seen."""
LEAST_M2: dict[Change, float] = {"blocked": 0.02, "opened": 0.02, "found": 0.25, "unseen": 0.25}
"""Smaller ones are the sensor's own wobble, or say nothing to a person."""


@dataclass(frozen=True)
class Difference:
    """`polygon` lies in the later grid's frame."""

    change: Change
    polygon: Polygon


def differences(before: OccupancyGrid, moved: Pose, now: OccupancyGrid) -> tuple[Difference, ...]:
    """The places, the largest first. `moved` takes the earlier grid's frame to the later one's."""
    now = now.covering(moved.apply(_corners(before.frame)))
    was, is_ = _carried(before, moved, now.frame), now.cells
    masks: dict[Change, Mask] = {
        "blocked": (was == Cell.FREE) & (is_ == Cell.OCCUPIED) & ~_near(was, now.frame),
        "opened": (was == Cell.OCCUPIED) & (is_ == Cell.FREE) & ~_near(is_, now.frame),
        "found": _opened((was == Cell.UNEXPLORED) & (is_ == Cell.FREE), now.frame),
        "unseen": _opened((was == Cell.FREE) & (is_ == Cell.UNEXPLORED), now.frame),
    }
    found = [
        Difference(change, polygon)
        for change, mask in masks.items()
        for polygon in _polygons(mask, now.frame)
        if polygon.area >= LEAST_M2[change]
    ]
    return tuple(sorted(found, key=lambda difference: -difference.polygon.area))


def _corners(frame: GridFrame) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return frame.to_map(as_points([(0, 0), (frame.width, 0), (frame.width, frame.height), (0, frame.height)]))


def _carried(grid: OccupancyGrid, moved: Pose, frame: GridFrame) -> Cells:
    """The grid's cells at the centres of another frame's."""
    columns, rows = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    centres = frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1)))
    there = grid.frame.to_cells(moved.inverse().apply(centres))
    return look_up(grid.cells, there, Cell.UNEXPLORED).reshape(frame.height, frame.width)


def _near(cells: Cells, frame: GridFrame) -> Mask:
    """Within the distance at which an obstacle is taken for one that was there."""
    return np.asarray(distance_to(cells == Cell.OCCUPIED, frame.resolution) <= FOUND_M)


def _opened(mask: Mask, frame: GridFrame) -> Mask:
    """Without what is narrower than the walls' wobble."""
    across = 2 * max(1, round(FOUND_M / frame.resolution)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, across))
    wide = np.asarray(cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, disc) > 0)
    return mask & grown(wide, FOUND_M, frame)  # with its corners


def _polygons(mask: Mask, frame: GridFrame) -> list[Polygon]:
    rings = [shapely.LinearRing(frame.to_map(as_points(ring))) for ring in trace(mask)]
    if not rings:
        return []
    return polygons_in(shapely.simplify(shapely.build_area(shapely.GeometryCollection(rings)), frame.resolution))
