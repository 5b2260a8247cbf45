"""The floor parted by likely cuts, many too many: its pieces, and what is known about both sides of each cut."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon

from stillroom.maps.geometry import Points
from stillroom.maps.grid import GridFrame, Mask
from stillroom.pipeline.cuts import (
    Cuts,
    Indices,
    Numbers,
    Outline,
    between_cells,
    cells_at,
    likely_cuts,
    outline_of,
    possible_cuts,
)
from stillroom.pipeline.faces import SUBPIXEL, Ends, Labels, faces
from stillroom.pipeline.params import Params

LOOKS_M = 0.063 + 0.1 * np.arange(20)
"""Walls beyond a cut's end are followed along the outline in such steps, which don't fall on whole cells."""
THICKEST_WALL_M = 0.46
_ACROSS = (np.arange(22) - 10.5) / 11
DISC = np.array([(forth, aside) for forth in _ACROSS[11:] for aside in _ACROSS if np.hypot(forth, aside) <= 1])
"""Places (n, 2) in the unit half disc before a cut, along its normal and along itself; close enough to find how wide the floor is there."""
OPENCV_MOST = 2**15 - 1
"""Rows or columns of an image that it looks up values in."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """The floor parted by likely cuts. Pieces are numbered from 1; every cut has two different ones on its `sides`: (n, 2), left and right.
    `area` of each piece in square metres; `labels` (height, width), the piece of each cell; `remoteness`: see `Cuts`.

    `disc_pieces`, `disc_clearance`: (n, 2, places), piece and clearance (metres) at places of the half discs on both sides of each cut.
    `wall_pieces`, `wall_reach`: (n, 2 ends, 2 sides, steps), the outline followed from each end along the border of each side: the piece there
    and how far beyond the end it is, along the cut's own line (metres); 0 from where it leaves that line on.
    """

    cuts: Cuts
    area: Numbers
    labels: Labels
    sides: Indices
    remoteness: Numbers
    disc_pieces: Indices
    disc_clearance: npt.NDArray[np.float32]
    wall_pieces: Indices
    wall_reach: Numbers

    def features(self, groups: Indices, which: Indices, params: Params) -> Numbers:
        """What speaks for joining across the cuts `which`, in the order of `segmentation.WEIGHTS`: (n, 6). `groups`: of each piece."""
        here = groups[self.sides[which]]
        known = groups[self.wall_pieces[which]] == here[:, None, :, None]
        reach = (self.wall_reach[which] * np.logical_and.accumulate(known, axis=3)).max(3)
        wall_between = np.minimum(np.minimum(reach.min(2), params.wall_support_m).sum(1), 2.0)
        mine = groups[self.disc_pieces[which]] == here[..., None]
        width = 2 * (self.disc_clearance[which] * mine).max(2)
        narrowing = np.sort(np.log(self.cuts.length[which, None] / np.maximum(width, 0.1)), axis=1)
        support = np.minimum(self.cuts.support[which].sum(1), 2.0)
        corners = self.cuts.two_corners[which]
        return np.stack([np.ones(len(which)), support, wall_between, corners, narrowing[:, 1], narrowing[:, 0]], 1)


def over_segment(floor: MultiPolygon, mask: Mask, frame: GridFrame, params: Params) -> Pieces:
    """`floor` has exterior rings counter-clockwise and holes clockwise; `mask` is the same floor as cells."""
    clearance = clearance_of(mask, frame)
    outline = outline_of(floor, frame, params)
    return part_floor(outline, possible_cuts(outline, clearance, frame, params), clearance, frame)


def part_floor(outline: Outline, possible: Cuts, clearance: npt.NDArray[np.float32], frame: GridFrame) -> Pieces:
    """The floor parted by the likely ones of all possible cuts. `clearance`: see `clearance_of`."""
    cuts = likely_cuts(possible, outline)
    ends = Ends.of(outline, cuts)
    face, area, labels = faces(outline, ends, frame)
    sides = face.reshape(-1, 2)
    near = _cells_near(cuts, frame)
    parting = sides[:, 0] != sides[:, 1]
    walls = _follow_walls(outline, cuts, ends, face)
    all_cuts, cuts = cuts, cuts.take(parting)
    discs = []
    for sign in (1.0, -1.0):
        places = _half_disc(cuts, sign * cuts.left)
        found = _on_side(all_cuts, sides, places, cells_at(near, places, frame), cells_at(labels, places, frame))
        discs.append((found, _sampled(clearance, places, frame)))
    return Pieces(
        cuts,
        area,
        labels,
        sides[parting],
        cuts.remoteness(outline.middle),
        np.stack([pieces for pieces, _ in discs], 1),
        np.stack([clear for _, clear in discs], 1),
        walls[0][parting],
        walls[1][parting],
    )


def clearance_of(mask: Mask, frame: GridFrame) -> npt.NDArray[np.float32]:
    """Metres from each cell's centre to the border of the nearest cell off the floor; beyond the grid is none either."""
    padded = cv2.copyMakeBorder(mask.view(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    distance = np.ascontiguousarray(np.asarray(cv2.distanceTransform(padded, cv2.DIST_L2, 5), np.float32)[1:-1, 1:-1])
    distance -= np.float32(0.5)
    distance *= np.float32(frame.resolution)
    return np.maximum(distance, np.float32(0), out=distance)


def _half_disc(cuts: Cuts, towards: Points) -> Numbers:
    """The places of each cut's half disc, (n, places, 2)."""
    radius = 1.25 * cuts.length + 0.8
    offsets = DISC[:, :1] * towards[:, None] + DISC[:, 1:] * cuts.along[:, None]
    return np.asarray(((cuts.a + cuts.b) / 2)[:, None] + radius[:, None, None] * offsets)


def _sampled(values: npt.NDArray[np.float32], places: Numbers, frame: GridFrame) -> npt.NDArray[np.float32]:
    """`between_cells`, to a thirtieth of a cell, and faster where OpenCV can do it."""
    if not places.size or max(*values.shape, len(places)) >= OPENCV_MOST:
        return between_cells(values, places, frame).astype(np.float32)
    cells = (places / frame.resolution - 0.5).astype(np.float32)
    sampled = cv2.remap(values, cells[..., 0], cells[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, np.float32)


def _cells_near(cuts: Cuts, frame: GridFrame) -> Labels:
    """For each cell (height, width) k + 1 where cut k crosses it, or one beside it; else 0."""
    near = np.zeros((frame.height, frame.width), np.int32)
    ends = np.round((np.stack([cuts.a, cuts.b], 1) / frame.resolution - 0.5) * (1 << SUBPIXEL)).astype(int)
    for k, (start, end) in enumerate(ends.tolist(), 1):
        cv2.line(near, start, end, k, 3, shift=SUBPIXEL)
    return near


def _on_side(cuts: Cuts, sides: Indices, places: Numbers, near: Labels, labels: Labels) -> Indices:
    """The piece at each place: that of its cell, or where a cut is `near`, the one on this side of it."""
    crossed = np.maximum(near - 1, 0)
    to = places - cuts.a[crossed]
    along = cuts.along[crossed]
    left = along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0] > 0
    return np.where(near > 0, np.where(left, sides[crossed, 0], sides[crossed, 1]), labels)


def _follow_walls(outline: Outline, cuts: Cuts, ends: Ends, face: Indices) -> tuple[Indices, Numbers]:
    """`wall_pieces` and `wall_reach` of `Pieces`."""
    begin = outline.ring_start
    passed = (begin[ends.ring] + ends.at)[ends.order]
    first_of = np.searchsorted(ends.ring[ends.order], np.arange(len(outline.perimeter)))
    pieces, reaches = [], []
    for end, outwards in ((0, -cuts.along), (1, cuts.along)):
        ring = cuts.ring[:, end, None]
        # floor lies on the left of rings: forwards from a leads along the right side's border, from b along the left side's
        for way in (-1, 1) if end == 0 else (1, -1):
            at = (cuts.at[:, end, None] + way * LOOKS_M) % outline.perimeter[ring]
            ring_ = np.broadcast_to(ring, at.shape)
            points, _ = outline.places(ring_, at)
            k = np.searchsorted(passed, begin[ring_] + at)
            gone = k >= np.searchsorted(ends.ring[ends.order], ring_, side="right")
            k = np.where(gone, first_of[ring_], k)
            gap = points - (cuts.a, cuts.b)[end][:, None]
            ahead = (gap * outwards[:, None]).sum(2)
            aside = np.abs(gap[..., 0] * outwards[:, None, 1] - gap[..., 1] * outwards[:, None, 0])
            pieces.append(face[ends.order[k]] if len(face) else k)
            reaches.append(np.maximum(ahead, 0) * np.logical_and.accumulate(aside <= THICKEST_WALL_M, axis=1))
    shape = (len(cuts.a), 2, 2, len(LOOKS_M))
    return np.stack(pieces, 1).reshape(shape), np.stack(reaches, 1).reshape(shape)
