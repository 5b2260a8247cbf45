"""Robots without a range sensor: floor is where they have been, walls are what they have touched."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from stillroom.maps.geometry import Points
from stillroom.maps.grid import Cell, GridFrame, Mask, OccupancyGrid
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects
from stillroom.simulator.faults import SlamFailure
from stillroom.simulator.sensing import ROBOT_RADIUS_M, TRUTH_RESOLUTION_M, Floor

_CONTACT = 0.6
"""Probability that a robot that goes along a wall touches it in a cell of the floor's raster."""
_LEAST_NOISE_M = 0.01
_MISSED_PER_M2 = 0.04
"""Spots that it has not been to,"""
_MISSED_M = (0.10, 0.30)
"""and their radius."""


@dataclass(frozen=True, eq=False)
class Touched:
    """`swept`: cells of the floor that the robot's body passed over; `contacts` (n, 2): where it touched something, in the home."""

    swept: Mask
    contacts: Points


def go_over(floor: Floor, reached: Mask, rng: Generator) -> Touched:
    """`reached` are the cells that the robot's middle gets to."""
    radius = round(ROBOT_RADIUS_M / TRUTH_RESOLUTION_M)
    body = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    swept = (cv2.dilate(_without_spots(reached, rng), body) > 0) & ~floor.solid
    touching = cv2.dilate(swept.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    faces = np.argwhere(floor.solid & touching)
    return Touched(swept, floor.centres(faces[rng.random(len(faces)) < _CONTACT]))


def _without_spots(reached: Mask, rng: Generator) -> npt.NDArray[np.uint8]:
    left = reached.astype(np.uint8)
    cells = np.argwhere(reached)
    count = rng.poisson(_MISSED_PER_M2 * len(cells) * TRUTH_RESOLUTION_M**2)
    for row, column in cells[rng.integers(len(cells), size=count)].tolist():
        radius = ROBOT_RADIUS_M + float(rng.uniform(*_MISSED_M))
        cv2.circle(left, (column, row), round(radius / TRUTH_RESOLUTION_M), 0, -1)
    return left


def bodies(floor: Floor, touched: Touched) -> Points:
    """The middles (n, 2) of the cells that were swept."""
    return floor.centres(np.argwhere(touched.swept))


def touch_grid(frame: GridFrame, swept: Points, contacts: Points) -> OccupancyGrid:
    """Places on the map that were swept (n, 2) and touched (m, 2): what was touched is occupied, the rest that was swept is free."""
    cells = np.full((frame.height, frame.width), np.uint8(Cell.UNEXPLORED))
    for points, cell in ((swept, Cell.FREE), (contacts, Cell.OCCUPIED)):
        column, row = np.floor(frame.to_cells(points)).astype(np.int64).T
        cells[row, column] = cell
    return OccupancyGrid(frame, cells)


def on_map(points: Points, places: Points, distortion: Distortion, failure: SlamFailure | None) -> Points:
    """Where SLAM puts points (n, 2) of the home. One that failed puts those around some of the `places` (v, 2) off, or twice."""
    put = distortion.apply(points)
    if failure is None:
        return put
    nearest = _nearest(points, places)
    lost, twice = failure.scans[~failure.again], failure.scans[failure.again]
    off, again = np.isin(nearest, lost), np.isin(nearest, twice)
    return np.concatenate([put[~off], failure.off.apply(put[off | again])])


def _nearest(points: Points, places: Points) -> npt.NDArray[np.int64]:
    squared = (places**2).sum(1) - 2 * points @ places.T
    return np.asarray(squared.argmin(1))


def noisy(contacts: Points, effects: Effects, rng: Generator) -> Points:
    """Contacts (n, 2) where the robot believes them to be."""
    return contacts + max(effects.range_noise_m, _LEAST_NOISE_M) * rng.normal(size=contacts.shape)
