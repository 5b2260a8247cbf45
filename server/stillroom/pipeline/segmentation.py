"""Automatic dividers: of all likely cuts across the floor those that part rooms.

The likely cuts part the floor into pieces, many too many. Pieces are joined across a cut where little speaks for a border: where no wall
parts them beyond the cut's ends, and where they are no wider than the cut is long. What remains between joined pieces are the dividers.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon

from stillroom.maps.geometry import Line, Points, as_line
from stillroom.maps.grid import GridFrame, Mask
from stillroom.pipeline.cuts import Cuts, Indices, Numbers, Outline, cells_at, likely_cuts, outline_of, possible_cuts
from stillroom.pipeline.dividers import centre_all
from stillroom.pipeline.params import Params

WEIGHTS = {
    "constant": 4.6,
    "support": -1.1,
    "wall_between": -3.2,
    "two_corners": -1.75,
    "narrow_side": 2.6,
    "wide_side": 1.6,
}
"""How much each property of a cut speaks for joining both sides (log odds)."""
FORCED = 100.0
"""Speaks for joining a piece that is too small to be a room."""
STEP_M, STEPS = 0.1, 20
"""Walls beyond a cut's end are followed along the outline in such steps."""
THICKEST_WALL_M = 0.45
FEWEST_LOOKS = 2
"""Looks at labels so near to a cut's end don't tell on which side they are."""
DISC = np.array(
    [(r * np.cos(t), r * np.sin(t)) for r in (np.arange(8) + 0.5) / 8 for t in np.radians(np.linspace(-80, 80, 9))]
)
"""Places (n, 2) in the unit half disc before a cut, along its normal and along itself."""
SUBPIXEL = 4
"""Binary digits that OpenCV keeps of a coordinate when it draws."""
BESIDE = np.linspace(0.2, 0.8, 7)

Labels = npt.NDArray[np.int32]


def propose_dividers(floor: MultiPolygon, mask: Mask, frame: GridFrame, params: Params) -> tuple[Line, ...]:
    """Dividers, in metres, that cut `floor` into rooms. `mask` is the same floor as cells."""
    if floor.is_empty:
        return ()
    floor = shapely.orient_polygons(floor)
    pieces = over_segment(floor, mask, frame, params)
    groups = join_pieces(pieces, params)
    parting = groups[pieces.sides[:, 0]] != groups[pieces.sides[:, 1]]
    ends = np.stack([pieces.cuts.a, pieces.cuts.b], 1)[parting].reshape(-1, 2) / frame.resolution
    lines = [as_line(line) for line in np.round(frame.to_map(ends), 3).reshape(-1, 2, 2)]
    return tuple({frozenset(line): line for line in centre_all(lines, floor)}.values())


@dataclass(frozen=True, eq=False)
class Pieces:
    """The floor parted by likely cuts. `labels`: (height, width), the piece of each cell, 0 for none; every cut has two different ones on its
    `sides`: (n, 2), left and right. `area` of each piece in square metres.

    `disc_pieces`, `disc_clearance`: (n, 2, places), piece and clearance (metres) at places of the half discs on both sides of each cut.
    `wall_pieces`, `wall_reach`: (n, 2 ends, 2 sides, steps), the outline followed from each end along the border of each side: the piece there
    and how far beyond the end it is, along the cut's own line (metres); 0 from where it leaves that line on.
    """

    cuts: Cuts
    labels: Labels
    area: Numbers
    sides: Indices
    disc_pieces: Labels
    disc_clearance: Numbers
    wall_pieces: Labels
    wall_reach: Numbers

    def features(self, groups: Indices, which: Indices, params: Params) -> Numbers:
        """What speaks for joining across the cuts `which`, in the order of `WEIGHTS`: (n, 6). `groups`: the group of each piece."""
        here = groups[self.sides[which]]
        walls = self.wall_pieces[which]
        known = groups[walls] == here[:, None, :, None]
        known |= walls == 0
        known[..., :FEWEST_LOOKS] = True
        reach = (self.wall_reach[which] * np.logical_and.accumulate(known, axis=3)).max(3)
        wall_between = np.minimum(np.minimum(reach.min(2), params.wall_support_m).sum(1), 2.0)
        mine = groups[self.disc_pieces[which]] == here[..., None]
        width = 2 * (self.disc_clearance[which] * mine).max(2)
        narrowing = np.sort(np.log(self.cuts.length[which, None] / np.maximum(width, 0.1)), axis=1)
        support = np.minimum(self.cuts.support[which].sum(1), 2.0)
        corners = self.cuts.two_corners[which]
        return np.stack([np.ones(len(which)), support, wall_between, corners, narrowing[:, 1], narrowing[:, 0]], 1)


def over_segment(floor: MultiPolygon, mask: Mask, frame: GridFrame, params: Params) -> Pieces:
    """`floor` has exterior rings counter-clockwise and holes clockwise."""
    # beyond the grid is no floor either
    padded = np.pad(mask, 1).view(np.uint8)
    clearance = np.asarray(cv2.distanceTransform(padded, cv2.DIST_L2, 5), np.float32)[1:-1, 1:-1]
    # to the border of the nearest cell that is none, not to its middle
    clearance = np.maximum(clearance - 0.5, 0) * np.float32(frame.resolution)
    outline = outline_of(floor, frame, params)
    cuts = likely_cuts(possible_cuts(outline, mask, clearance, frame, params))
    labels, cells = _label_pieces(outline, mask, cuts, frame, params)
    sides = np.stack([_beside(cuts, sign * cuts.left, labels, frame) for sign in (1.0, -1.0)], 1)
    real = (sides > 0).all(1) & (sides[:, 0] != sides[:, 1])
    cuts, sides = cuts.take(real), sides[real]
    discs = [_half_disc(cuts, sign * cuts.left, labels, clearance, frame) for sign in (1.0, -1.0)]
    wall_pieces, wall_reach = _follow_walls(outline, cuts, labels, frame)
    return Pieces(
        cuts,
        labels,
        np.asarray(cells * frame.resolution**2, np.float64),
        sides,
        np.stack([pieces for pieces, _ in discs], 1),
        np.stack([clear for _, clear in discs], 1),
        wall_pieces,
        wall_reach,
    )


def _label_pieces(outline: Outline, mask: Mask, cuts: Cuts, frame: GridFrame, params: Params) -> tuple[Labels, Indices]:
    """The piece of each cell, (height, width), and how many cells each has; none has number 0.

    The outline leaves out what is narrow in a ragged wall, where pieces would be connected behind a cut's end, and may run a little inside
    the cells' border: cuts are drawn on beyond their ends.
    """
    drawn = np.zeros(mask.shape, np.uint8)
    vertices = np.round((outline.points / frame.resolution - 0.5) * (1 << SUBPIXEL)).astype(np.int32)
    cv2.fillPoly(drawn, np.split(vertices, np.flatnonzero(np.diff(outline.ring)) + 1), 1, shift=SUBPIXEL)
    drawn &= mask.view(np.uint8)
    beyond = cuts.along * (params.outline_tolerance_m + frame.resolution)
    ends = np.stack([cuts.a - beyond, cuts.b + beyond], 1) / frame.resolution - 0.5
    for start, end in np.round(ends).astype(int).tolist():
        cv2.line(drawn, start, end, 0, 1, cv2.LINE_8)
    count, labels = cv2.connectedComponents(drawn, connectivity=4)
    cells = np.bincount(labels.ravel(), minlength=count)
    cells[0] = 0
    return np.asarray(labels, np.int32), cells


def _beside(cuts: Cuts, towards: Points, labels: Labels, frame: GridFrame) -> Indices:
    """The piece that most of a cut borders on in direction `towards` (n, 2)."""
    on = cuts.a[:, None] + BESIDE[:, None] * (cuts.b - cuts.a)[:, None]
    off = (max(0.1, 1.5 * frame.resolution), max(0.175, 3 * frame.resolution))
    places = np.concatenate([on + distance * towards[:, None] for distance in off], 1)
    found = cells_at(labels, places, frame).astype(np.int64)
    votes = ((found[:, :, None] == found[:, None]) & (found > 0)[:, :, None]).sum(2)
    return np.asarray(np.take_along_axis(found, votes.argmax(1)[:, None], 1)[:, 0])


def _half_disc(
    cuts: Cuts, towards: Points, labels: Labels, clearance: npt.NDArray[np.float32], frame: GridFrame
) -> tuple[Labels, Numbers]:
    """Pieces and clearance at the places of each cut's half disc, both (n, places)."""
    radius = 1.25 * cuts.length + 0.8
    offsets = DISC[:, :1] * towards[:, None] + DISC[:, 1:] * cuts.along[:, None]
    places = ((cuts.a + cuts.b) / 2)[:, None] + radius[:, None, None] * offsets
    return cells_at(labels, places, frame), cells_at(clearance, places, frame).astype(np.float64)


def _follow_walls(outline: Outline, cuts: Cuts, labels: Labels, frame: GridFrame) -> tuple[Labels, Numbers]:
    """`wall_pieces` and `wall_reach` of `Pieces`."""
    count = np.maximum(np.round(outline.perimeter / STEP_M).astype(np.int64), 4)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    points, pieces = _stations(outline, count, labels, frame)
    found_pieces, found_reach = [], []
    for end, outwards in ((0, -cuts.along), (1, cuts.along)):
        ring = cuts.ring[:, end]
        start = cuts.at[:, end] / outline.perimeter[ring] * count[ring] - 0.5
        # floor lies on the left of rings: forwards from a leads along the right side's border, from b along the left side's
        ways = (-1, 1) if end == 0 else (1, -1)
        for way in ways:
            begin = np.floor(start + 1e-6) + 1 if way > 0 else np.ceil(start - 1e-6) - 1
            index = (begin.astype(np.int64)[:, None] + way * np.arange(STEPS)) % count[ring][:, None] + first[ring][
                :, None
            ]
            gap = points[index] - (cuts.a, cuts.b)[end][:, None]
            ahead = (gap * outwards[:, None]).sum(2)
            aside = np.abs(gap[..., 0] * outwards[:, None, 1] - gap[..., 1] * outwards[:, None, 0])
            found_pieces.append(pieces[index])
            found_reach.append(np.maximum(ahead, 0) * np.logical_and.accumulate(aside <= THICKEST_WALL_M, axis=1))
    shape = (len(cuts.a), 2, 2, STEPS)
    return np.stack(found_pieces, 1).reshape(shape), np.stack(found_reach, 1).reshape(shape)


def _stations(outline: Outline, count: Indices, labels: Labels, frame: GridFrame) -> tuple[Points, Labels]:
    """`count` points on each ring at even distances, and the piece beside each (0: a cut runs there)."""
    ring = np.repeat(np.arange(len(count)), count)
    base = np.concatenate([[0.0], np.cumsum(outline.perimeter)])
    number = np.arange(len(ring)) - np.repeat(np.concatenate([[0], np.cumsum(count)[:-1]]), count)
    at = base[ring] + (number + 0.5) / count[ring] * outline.perimeter[ring]
    starts = base[outline.ring] + outline.at
    edge = np.searchsorted(starts, at, side="right") - 1
    along = outline.points[outline.after[edge]] - outline.points[edge]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    points = outline.points[edge] + (at - starts[edge])[:, None] * along
    inwards = np.stack([-along[:, 1], along[:, 0]], 1)
    pieces = np.zeros(len(points), np.int32)
    for distance in (max(0.075, frame.resolution), max(0.15, 2 * frame.resolution)):
        pieces = np.where(pieces == 0, cells_at(labels, points + distance * inwards, frame), pieces)
    return points, pieces


# -- joining -------------------------------------------------------------------------------------------------------


def join_pieces(pieces: Pieces, params: Params) -> Indices:
    """The group of each piece after joining pieces until nothing speaks for joining any more.

    In rounds: each group chooses the one that it is best joined with, and pairs that choose each other are joined.
    """
    weights = np.array(list(WEIGHTS.values()))
    groups = np.arange(len(pieces.area))
    while len(pieces.sides):
        pair = groups[pieces.sides]
        apart = np.flatnonzero(pair[:, 0] != pair[:, 1])
        if not len(apart):
            break
        evidence = pieces.features(groups, apart, params) @ weights - params.divider_sensitivity
        joined = _join_best(groups, pair[apart], evidence, pieces, params)
        if joined is None:
            break
        groups = joined
    return groups


def _join_best(groups: Indices, pair: Indices, evidence: Numbers, pieces: Pieces, params: Params) -> Indices | None:
    """One round; None where nothing is to be joined. Of several cuts between two groups the one that speaks most for joining counts."""
    area = np.bincount(groups, weights=pieces.area, minlength=len(groups))
    small = area < params.divided_room_m2
    evidence = np.round(evidence, 6) + FORCED * small[pair].any(1)
    order = np.lexsort((pair.max(1), pair.min(1), -evidence))
    best = pair[order[evidence[order] > 0]]
    if not len(best):
        return None
    wishes = np.stack([best, best[:, ::-1]], 1).reshape(-1, 2)
    chooser, first = np.unique(wishes[:, 0], return_index=True)
    choice = np.full(len(groups), -1)
    choice[chooser] = wishes[first, 1]
    agreed = chooser[(choice[choice[chooser]] == chooser) & (chooser < choice[chooser])]
    joined = np.arange(len(groups))
    joined[choice[agreed]] = agreed
    return np.asarray(joined[groups])
