"""Automatic dividers: of all likely cuts across the floor those that part rooms.

The likely cuts part the floor into pieces, many too many. Pieces are joined across a cut where little speaks for a border: where no wall
parts them beyond the cut's ends, and where they are no wider than the cut is long. What remains between joined pieces are the dividers.
"""

import numpy as np
import shapely
from shapely import MultiPolygon

from stillroom.maps.geometry import Line, as_line
from stillroom.maps.grid import GridFrame, Mask
from stillroom.pipeline.cuts import Indices, Numbers
from stillroom.pipeline.dividers import Outline, centre_all
from stillroom.pipeline.params import Params
from stillroom.pipeline.pieces import Pieces, over_segment

WEIGHTS = {
    "constant": 3.92,
    "support": -1.03,
    "wall_between": -2.29,
    "two_corners": -1.46,
    "narrow_side": 2.57,
    "wide_side": 1.52,
}
"""How much each property of a cut speaks for joining both sides (log odds); fitted by `tests/real/fit_cuts.py`."""
FORCED, SMALL = 100.0, 8.0
"""Speaks for joining a piece that is much too small to be a room, and one that is half as large as a room must be."""


def propose_dividers(floor: MultiPolygon, mask: Mask, frame: GridFrame, params: Params) -> tuple[Line, ...]:
    """Dividers, in metres, that cut `floor` into rooms. `mask` is the same floor as cells."""
    if floor.is_empty:
        return ()
    floor = shapely.orient_polygons(floor)
    pieces = over_segment(floor, mask, frame, params)
    if not len(pieces.sides):
        return ()
    groups = join_pieces(pieces, params)
    parting = groups[pieces.sides[:, 0]] != groups[pieces.sides[:, 1]]
    ends = np.stack([pieces.cuts.a, pieces.cuts.b], 1)[parting].reshape(-1, 2) / frame.resolution
    lines = [as_line(line) for line in np.round(frame.to_map(ends), 3).reshape(-1, 2, 2)]
    return tuple({frozenset(line): line for line in centre_all(lines, Outline(floor))}.values())


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
        joined = join_best(groups, apart, evidence, pieces, params)
        if joined is None:
            break
        groups = joined
    return groups


def join_best(groups: Indices, cuts: Indices, evidence: Numbers, pieces: Pieces, params: Params) -> Indices | None:
    """One round; None where nothing is to be joined. Of several cuts between two groups the one that speaks most for joining counts."""
    pair = groups[pieces.sides[cuts]]
    area = np.bincount(groups, weights=pieces.area, minlength=len(groups))
    rooms = area[pair].min(1) / params.divided_room_m2
    evidence = np.round(evidence + SMALL * np.clip(1.5 - rooms, 0, 1) + FORCED * (rooms < 0.5), 6)
    order = np.lexsort((np.round(pieces.remoteness[cuts], 6), -evidence))
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
