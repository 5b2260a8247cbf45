"""A served map against the home as it is. Judged only where the robot has ever been, and in rooms, not in doorways:
what lies under furniture counts neither for nor against."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.grid import GridFrame, Mask
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Home, carried
from stillroom.simulator.sensing import fill

PASS = 0.5
"""A room is where it should be when precision and recall are both higher than this (paper, section V)."""
_EXPLORED_M2 = 0.5
"""A room of which less was seen is not judged."""
_STEP_M = 0.5
"""Straight edges of a bent map are straightened piece by piece of this length."""


@dataclass(frozen=True)
class Overlap:
    """A served room and a true one: precision C/(B+C), recall C/(A+C), IoU C/(A+B+C); `id` is the served room's."""

    id: str
    precision: float
    recall: float
    iou: float

    @property
    def passed(self) -> bool:
        return self.precision > PASS and self.recall > PASS


@dataclass(frozen=True)
class RoomFit:
    """How a true room is served: by the room that covers it `best`, and by the one that has its name (None: none has)."""

    name: str
    best: Overlap
    named: Overlap | None


@dataclass(frozen=True)
class MapFit:
    rooms: tuple[RoomFit, ...]

    @property
    def mean_iou(self) -> float:
        return float(np.mean([room.best.iou for room in self.rooms])) if self.rooms else 0.0

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the true rooms whose best room does not pass."""
        return tuple(room.name for room in self.rooms if not room.best.passed)

    @property
    def misnamed(self) -> tuple[str, ...]:
        """Names that a served room has which does not lie where the true one does."""
        return tuple(room.name for room in self.rooms if room.named is not None and not room.named.passed)


def fit(home: Home, frame: GridFrame, explored: Mask, document: Mapping[str, Any], distortion: Distortion) -> MapFit:
    """A map document, whose frame is bent by `distortion`, against the home;
    `explored`, on `frame`, is where its robot has been."""
    served = {f["id"]: f for f in document["features"] if f["properties"]["semantic"] == "room"}
    masks = {key: draw(frame, straightened(f["geometry"]["coordinates"], distortion)) for key, f in served.items()}
    truth = {room.name: draw(frame, room.polygon) & explored for room in home.rooms}
    judged = np.any(list(truth.values()), axis=0)
    masks = {key: mask & judged for key, mask in masks.items()}
    names = {f["properties"]["name"]: key for key, f in served.items()}
    fits = []
    for name, true in truth.items():
        if true.sum() * frame.resolution**2 < _EXPLORED_M2:
            continue
        overlaps = {key: overlap(key, true, mask) for key, mask in masks.items()}
        best = max(overlaps.values(), key=lambda o: o.iou, default=Overlap("", 0.0, 0.0, 0.0))
        fits.append(RoomFit(name, best, overlaps.get(names.get(name, ""))))
    return MapFit(tuple(fits))


def overlap(key: str, true: Mask, served: Mask) -> Overlap:
    both, both_or_one = int((true & served).sum()), int((true | served).sum())
    only = max(int(served.sum()), 1), max(int(true.sum()), 1)
    return Overlap(key, both / only[0], both / only[1], both / max(both_or_one, 1))


def straightened(rings: list[list[list[float]]], distortion: Distortion) -> Polygon:
    """A polygon of a bent map where it lies in the home."""
    bent = shapely.segmentize(Polygon(rings[0], rings[1:]), _STEP_M)
    return carried(bent, distortion.undo)


def draw(frame: GridFrame, polygon: Polygon) -> Mask:
    """The cells of a polygon, without its holes."""
    image = np.zeros((frame.height, frame.width), np.uint8)
    fill(image, frame, polygon, 1)
    for hole in polygon.interiors:
        fill(image, frame, Polygon(hole), 0)
    return np.asarray(image > 0)
