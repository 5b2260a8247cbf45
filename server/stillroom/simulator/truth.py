"""A served map against the home as it is. Judged only where the robot has ever been, and in rooms, not in doorways:
what lies under furniture counts neither for nor against."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from stillroom.maps.grid import GridFrame, Mask
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Home, carried
from stillroom.simulator.sensing import fill

Labels = npt.NDArray[np.uint8]
"""Shape (height, width): numbers of polygons, 0 for none."""
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
    shapes = [straightened(f["geometry"]["coordinates"], distortion) for f in served.values()]
    common = _common(numbered(frame, [room.polygon for room in home.rooms]), numbered(frame, shapes), explored)
    common = np.pad(common, ((0, len(home.rooms) + 1 - len(common)), (0, len(shapes) + 1 - common.shape[1])))
    true_sizes, served_sizes = common[1:].sum(1), common[1:].sum(0)
    names = {f["properties"]["name"]: key for key, f in served.items()}
    fits = []
    for i, room in enumerate(home.rooms):
        if true_sizes[i] * frame.resolution**2 < _EXPLORED_M2:
            continue
        overlaps = {
            key: _overlap(key, int(common[i + 1, j]), int(true_sizes[i]), int(served_sizes[j]))
            for j, key in enumerate(served, 1)
        }
        best = max(overlaps.values(), key=lambda o: o.iou, default=Overlap("", 0.0, 0.0, 0.0))
        fits.append(RoomFit(room.name, best, overlaps.get(names.get(room.name, ""))))
    return MapFit(tuple(fits))


def _common(true: Labels, served: Labels, explored: Mask) -> npt.NDArray[np.int64]:
    """How many explored cells each pair of numbers shares, shape (highest of `true` + 1, highest of `served` + 1)."""
    width = int(served.max()) + 1
    pairs = np.bincount(true[explored].astype(np.int64) * width + served[explored], minlength=width)
    return np.pad(pairs, (0, -len(pairs) % width)).reshape(-1, width)


def _overlap(key: str, both: int, true: int, served: int) -> Overlap:
    return Overlap(key, both / max(served, 1), both / max(true, 1), both / max(true + served - both, 1))


def straightened(rings: list[list[list[float]]], distortion: Distortion) -> Polygon:
    """A polygon of a bent map where it lies in the home."""
    bent = shapely.segmentize(Polygon(rings[0], rings[1:]), _STEP_M)
    return carried(bent, distortion.undo)


def numbered(frame: GridFrame, polygons: Sequence[Polygon]) -> Labels:
    """The cells of each polygon, without its holes, have its number, from 1 on."""
    image = np.zeros((frame.height, frame.width), np.uint8)
    for number, polygon in enumerate(polygons, 1):
        fill(image, frame, polygon, number)
    return image
