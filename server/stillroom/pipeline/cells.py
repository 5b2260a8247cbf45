"""Which cells of a grid lie in polygons of the map frame, and which in short pieces of a mask."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Points, Pose, as_points, polygons_in
from stillroom.maps.grid import GridFrame, Mask

CANVAS_MARGIN = 4
BEYOND = 2
"""Cells; a shape that reaches farther than this beyond the grid is cut."""


def cells_in(polygons: Sequence[Polygon], frame: GridFrame) -> Mask:
    """The cells whose centre lies in one of the polygons; exactly so, because a wall may be one cell thick."""
    found = np.zeros((frame.height, frame.width), np.bool_)
    if not polygons:
        return found
    shape = polygons[0] if len(polygons) == 1 else shapely.union_all(list(polygons))
    # Drawn on a canvas that holds it all: OpenCV is not exact where shapes leave the canvas.
    corners = frame.to_cells(shapely.get_coordinates(shape))
    if (corners < -BEYOND).any() or (corners > np.array([frame.width, frame.height]) + BEYOND).any():
        shape = MultiPolygon(polygons_in(shapely.intersection(shape, _around(frame, BEYOND))))
    if shape.is_empty:
        return found
    points, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(shape)), return_index=True)
    cells = nearest_cells(points, frame)
    corner = cells.min(0) - CANVAS_MARGIN
    rings = np.split(cells - corner, np.flatnonzero(np.diff(ring)) + 1)
    canvas = np.zeros((cells.max(0) - corner + CANVAS_MARGIN + 1)[::-1], np.uint8)
    edge = cv2.polylines(canvas.copy(), rings, True, 1, thickness=3)
    cv2.fillPoly(canvas, rings, 1)
    rows, columns = np.nonzero(edge)
    shapely.prepare(shape)
    centres = frame.to_map(as_points(np.stack([columns, rows], 1) + corner) + 0.5)
    canvas[rows, columns] = shapely.contains_xy(shape, centres)
    left, bottom = corner.tolist()
    height, width = canvas.shape
    on_it = canvas[max(-bottom, 0) : max(frame.height - bottom, 0), max(-left, 0) : max(frame.width - left, 0)]
    found[max(bottom, 0) : max(bottom + height, 0), max(left, 0) : max(left + width, 0)] = on_it
    return found


def label_cells(polygons: Sequence[Polygon], frame: GridFrame) -> npt.NDArray[np.int32]:
    """Shape (height, width): k + 1 where the cell's centre lies in polygon k, 0 where it lies in none. Polygons must not overlap."""
    labels = np.zeros((frame.height, frame.width), np.int32)
    for number, polygon in enumerate(polygons, 1):
        corners = frame.to_cells(shapely.get_coordinates(polygon.exterior))
        low = np.clip(np.floor(corners.min(0)), 0, (frame.width, frame.height)).astype(int)
        high = np.clip(np.ceil(corners.max(0)), low, (frame.width, frame.height)).astype(int)
        (left, bottom), (width, height) = low.tolist(), (high - low).tolist()
        x, y = frame.to_map(as_points([(left, bottom)]))[0].tolist()
        part = GridFrame(frame.resolution, width, height, Pose(x, y, frame.origin.yaw))
        labels[bottom : bottom + height, left : left + width][cells_in([polygon], part)] = number
    return labels


def short_pieces(mask: Mask, cells: float) -> Mask:
    """The 8-connected components of `mask` that are shorter than so many cells, in both directions."""
    pieces = mask.view(np.uint8)
    borders, links = cv2.findContours(pieces, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    outer = np.flatnonzero(links[0, :, 3] < 0).tolist() if len(borders) else []
    short = [borders[k] for k in outer if max(cv2.boundingRect(borders[k])[2:]) < cells]
    # what one of them encloses is shorter still
    found = cv2.drawContours(np.zeros(mask.shape, np.uint8), short, -1, 1, cv2.FILLED)
    return np.asarray(found, np.uint8).view(np.bool_) & mask


def _around(frame: GridFrame, cells: float) -> Polygon:
    """The frame with so many cells more on every side."""
    low, right, top = -cells, frame.width + cells, frame.height + cells
    return Polygon(frame.to_map(as_points([(low, low), (right, low), (right, top), (low, top)])))


def nearest_cells(points: Points, frame: GridFrame) -> npt.NDArray[np.int32]:
    """The cells, (column, row), nearest to points of the map frame."""
    return np.round(frame.to_cells(points) - 0.5).astype(np.int32)
