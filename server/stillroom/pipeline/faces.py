"""Into what cuts part the floor: exact areas and neighbours, from the order in which rings and cuts meet.

Cuts neither cross each other nor the outline. So walking along rings and cuts with the floor on the left goes round one piece after the other,
however coarse the grid is.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from stillroom.maps.geometry import Points
from stillroom.maps.grid import GridFrame
from stillroom.pipeline.cuts import Cuts, Indices, Numbers, Outline

SUBPIXEL = 4
"""Binary digits that OpenCV keeps of a coordinate when it draws."""

Labels = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Ends:
    """The ends of cuts, two each (2k and 2k + 1 are cut k's a and b), in the order in which the rings pass them.

    `order` lists them, ring by ring; `following` and `preceding` are each end's neighbours on its ring. An end stands for the stretch of ring
    that leads up to it, and for the piece on the left of that stretch.
    """

    ring: Indices
    at: Numbers
    points: Points
    order: Indices
    following: Indices
    preceding: Indices

    @property
    def first(self) -> Indices:
        """The first end on each ring that has any: its stretch leads over the ring's beginning."""
        return self.order[np.unique(self.ring[self.order], return_index=True)[1]]

    @staticmethod
    def of(outline: Outline, cuts: Cuts) -> "Ends":
        ring, at = cuts.ring.ravel(), cuts.at.ravel()
        points = np.stack([cuts.a, cuts.b], 1).reshape(-1, 2)
        into = np.stack([cuts.along, -cuts.along], 1).reshape(-1, 2)
        ahead = outline.edges[outline.places(ring, at)[1]]
        # of several cuts at one corner a ring passes that first which leads back most
        turn = np.arctan2(ahead[:, 0] * into[:, 1] - ahead[:, 1] * into[:, 0], (ahead * into).sum(1)) % (2 * np.pi)
        order = np.lexsort((-turn, np.round(at, 6), ring))
        first, last = (np.searchsorted(ring[order], ring[order], side) for side in ("left", "right"))
        place = np.arange(len(order))
        following, preceding = np.empty_like(order), np.empty_like(order)
        following[order] = order[np.where(place + 1 < last, (place + 1) % max(len(order), 1), first)]
        preceding[following] = np.arange(len(order))
        return Ends(ring, at, points, order, following, preceding)


def faces(outline: Outline, ends: Ends, frame: GridFrame) -> tuple[Indices, Numbers, Labels]:
    """The piece on the left of each end's stretch of ring, the area of each piece, and the piece of each cell (height, width).

    Left of a stretch of ring that leads up to an end, the border goes on over the cut and along the ring from the cut's other end.
    """
    labels = np.zeros((frame.height, frame.width), np.int32)
    if not len(ends.order):
        return np.zeros(0, np.int64), np.zeros(1), labels
    cycle = _cycles(ends.following[np.arange(len(ends.order)) ^ 1])
    borders = _borders(outline, ends, cycle)
    area = _areas(outline, ends, cycle)
    part = np.zeros(len(area), np.int64)
    part[cycle] = outline.part[ends.ring]
    around = np.flatnonzero(area > 0)
    around = around[np.argsort(-area[around], kind="stable")]
    piece = np.zeros(len(area), np.int64)
    piece[around] = np.arange(1, len(around) + 1)
    sizes = np.concatenate([[0.0], area[around]])

    def holder(border: Points, its_part: int, its_area: float) -> int:
        """The piece that a hole is in, 0 for none."""
        for k in around[::-1].tolist():
            if part[k] == its_part and area[k] > its_area and _holds(borders[k], border[0]):
                return int(piece[k])
        return 0

    for k in np.flatnonzero(area <= 0).tolist():
        piece[k] = holder(borders[k], int(part[k]), -float(area[k]))
        sizes[piece[k]] += area[k]
    for ring in np.setdiff1d(np.arange(len(outline.perimeter)), ends.ring).tolist():
        border = outline.points[outline.ring == ring]
        if _area(border) < 0:
            sizes[holder(border, int(outline.part[ring]), -_area(border))] += _area(border)
    sizes[0] = 0.0
    for k in around.tolist():
        vertices = np.round((borders[k] / frame.resolution - 0.5) * (1 << SUBPIXEL)).astype(np.int32)
        cv2.fillPoly(labels, [vertices], int(piece[k]), shift=SUBPIXEL)
    return piece[cycle], sizes, labels


def _cycles(following: Indices) -> Indices:
    """The number of the cycle that each is in."""
    step, found = following.tolist(), [-1] * len(following)
    count = 0
    for start in range(len(step)):
        k = start
        if found[k] < 0:
            while found[k] < 0:
                found[k] = count
                k = step[k]
            count += 1
    return np.array(found, np.int64)


def _areas(outline: Outline, ends: Ends, cycle: Indices) -> Numbers:
    """Signed area of each cycle: positive around a piece, negative around a hole."""
    p, q = outline.points, outline.points[outline.after]
    swept = np.concatenate([[0.0], np.cumsum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])])
    first = np.searchsorted(outline.ring, np.arange(len(outline.perimeter) + 1))
    _, edge = outline.places(ends.ring, ends.at)
    until = swept[edge] + p[edge, 0] * ends.points[:, 1] - p[edge, 1] * ends.points[:, 0]
    wraps = np.zeros(len(cycle), bool)
    wraps[ends.first] = True
    whole = (swept[first[1:]] - swept[first[:-1]])[ends.ring]
    across = ends.points[np.arange(len(cycle)) ^ 1]
    over = ends.points[:, 0] * across[:, 1] - ends.points[:, 1] * across[:, 0]
    return np.bincount(cycle, until - until[ends.preceding] + whole * wraps + over) / 2


def _borders(outline: Outline, ends: Ends, cycle: Indices) -> list[Points]:
    """The vertices of each cycle."""
    _, edge = outline.places(ends.ring, ends.at)
    first = np.searchsorted(outline.ring, np.arange(len(outline.perimeter) + 1)).tolist()
    wraps = set(ends.first.tolist())
    rings, edges, before = ends.ring.tolist(), edge.tolist(), ends.preceding.tolist()
    parts: list[list[Points]] = [[] for _ in range(int(cycle.max()) + 1)]
    step, cycles = ends.following.tolist(), cycle.tolist()
    seen = [False] * len(cycles)
    for start in range(len(cycles)):
        k = start
        while not seen[k]:
            seen[k] = True
            a, b = edges[before[k]] + 1, edges[k] + 1
            stretch = parts[cycles[k]]
            if k in wraps:
                stretch += [outline.points[a : first[rings[k] + 1]], outline.points[first[rings[k]] : b]]
            else:
                stretch.append(outline.points[a:b])
            stretch += [ends.points[k : k + 1], ends.points[k ^ 1 : (k ^ 1) + 1]]
            k = step[k ^ 1]
    return [np.concatenate(stretch) for stretch in parts]


def _area(ring: Points) -> float:
    x, y = ring.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2


def _holds(border: Points, point: Points) -> bool:
    return bool(shapely.contains_xy(shapely.Polygon(border), *point))
