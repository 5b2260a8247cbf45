"""Automatic dividers: straight cuts from wall corners across doorways and narrowings, kept where joining both sides would be no room.

Corners that stick into the floor are the doorposts; a cut is good where it is short, where walls go on straight beyond its ends, and where
the floor widens on both sides. The score is linear; its weights were fitted by logistic regression on the floor plans of Bormann et al.
(ICRA 2016) and say in what order pieces of floor are joined until only rooms are left.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line, Points, as_line
from stillroom.maps.grid import GridFrame, Mask, look_up
from stillroom.pipeline.dividers import centre
from stillroom.pipeline.params import Params
from stillroom.pipeline.rooms import partition, rooms_beside

Numbers = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

WEIGHTS = {
    "constant": -0.953,
    "length": 1.257,
    "support": -1.662,
    "weaker_support": -0.530,
    "narrow_side": 1.621,
    "wide_side": 1.680,
    "two_corners": -0.772,
}
"""How much each property of a cut speaks for joining both sides."""
SIZE_WEIGHT, SIZE_UNIT_M2 = 0.3, 6.0
"""Large pieces need more evidence to be joined."""
HOLLOW_WEIGHT = 0.5
"""And so does a union that is not convex."""
SIGHT_SAMPLES = 20
DIRECTIONS_APART = 0.85
"""Cosine of the smallest angle between two cuts from one corner (32 degrees)."""
SAME_END_M = 0.2
SUPPORT_CREDIT = 0.25
"""Metres by which a metre of wall support outweighs length when cuts are chosen."""
WALK = 6
"""Outline edges followed beyond a cut's end."""


@dataclass(frozen=True, eq=False)
class _Outline:
    """All rings' vertices in metres (n, 2): `after` and `before` index the neighbours on the ring, `corner` marks those that stick into the floor."""

    points: Points
    after: Indices
    before: Indices
    corner: Flags


@dataclass(frozen=True, eq=False)
class _Cuts:
    """Candidate dividers from `a` to `b` (n, 2), metres; `support` (n, 2) is the length of straight wall beyond each end."""

    a: Points
    b: Points
    support: Numbers
    two_corners: Flags

    @property
    def length(self) -> Numbers:
        return np.asarray(np.linalg.norm(self.b - self.a, axis=1))

    def take(self, index: Indices | Flags) -> "_Cuts":
        return _Cuts(self.a[index], self.b[index], self.support[index], self.two_corners[index])


def propose_dividers(floor: MultiPolygon, mask: Mask, frame: GridFrame, params: Params) -> tuple[Line, ...]:
    """Dividers, in metres, that cut `floor` into rooms. `mask` is the same floor as cells."""
    clearance = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, 5) * np.float32(frame.resolution)
    if floor.is_empty:
        return ()
    chosen = _choose(_candidates(_vertices(floor, params), mask, clearance, frame, params))
    lines = [as_line(np.round(np.stack([a, b]), 3)) for a, b in zip(chosen.a, chosen.b, strict=True)]
    pieces = partition(floor, lines)
    sides = rooms_beside(lines, pieces)
    real = [k for k, side in enumerate(sides) if len(side) >= 2]
    scores = _join_scores(chosen.take(np.array(real, dtype=np.int64)), mask, clearance, frame, params)
    group = _join(
        pieces, {k: (sides[k][0], sides[k][1]) for k in real}, dict(zip(real, scores.tolist(), strict=True)), params
    )
    kept = [lines[k] for k in real if len({group[side] for side in sides[k]}) > 1]
    return tuple({frozenset(line): line for line in (centre(line, floor) for line in kept)}.values())


def _vertices(floor: MultiPolygon, params: Params) -> _Outline:
    rings = [ring for polygon in floor.geoms for ring in (polygon.exterior, *polygon.interiors)]
    loops = [shapely.get_coordinates(ring)[:-1] for ring in rings]
    offsets = np.cumsum([0, *map(len, loops)])
    points = np.concatenate(loops)
    after, before = np.arange(1, len(points) + 1), np.arange(-1, len(points) - 1)
    after[offsets[1:] - 1], before[offsets[:-1]] = offsets[:-1], offsets[1:] - 1
    into, out = points - points[before], points[after] - points
    turn = np.degrees(np.arctan2(into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0], (into * out).sum(1)))
    return _Outline(points, after, before, turn < -params.corner_turn_deg)


def _candidates(
    outline: _Outline, mask: Mask, clearance: npt.NDArray[np.float32], frame: GridFrame, params: Params
) -> _Cuts:
    """From each corner to the nearest point of each outline edge, in sight, clear of walls at the middle."""
    shortest, longest = params.divider_length_m
    p, q = outline.points, outline.points[outline.after]
    corners = np.flatnonzero(outline.corner)
    edge = q - p
    edges = shapely.linestrings(np.stack([p, q], 1))
    i, j = shapely.STRtree(edges).query(shapely.points(p[corners]), predicate="dwithin", distance=longest)
    share = ((p[corners[i]] - p[j]) * edge[j]).sum(1) / np.maximum((edge[j] ** 2).sum(1), 1e-9)
    share = np.clip(share, 0, 1)
    a, b = p[corners[i]], p[j] + share[:, None] * edge[j]
    length = np.linalg.norm(b - a, axis=1)
    fits = (length > shortest) & (length < longest)
    i, j, a, b, length, share = i[fits], j[fits], a[fits], b[fits], length[fits], share[fits]
    corner = corners[i]
    middle = look_up(clearance, frame.to_cells((a + b) / 2), 0) >= params.divider_clearance * length
    i = np.flatnonzero(middle)
    margin = np.minimum(2.5 * frame.resolution / length[i], 0.45)[:, None]
    stations = margin + np.linspace(0, 1, SIGHT_SAMPLES)[None] * (1 - 2 * margin)
    sight = a[i, None] + stations[..., None] * (b[i] - a[i])[:, None]
    seen = look_up(mask, frame.to_cells(sight.reshape(-1, 2)), False).reshape(len(i), SIGHT_SAMPLES).all(1)
    i = _spread(i[seen], corner, (b - a) / length[:, None], length, params.divider_directions)
    a, b, share, corner, j = a[i], b[i], share[i], corner[i], j[i]
    end = np.where(share == 0, j, np.where(share == 1, outline.after[j], -1))
    along = (b - a) / length[i, None]
    support = np.stack(
        [
            _support(outline, a, -along, outline.after[corner], outline.before[corner], params),
            _support(
                outline,
                b,
                along,
                np.where(end >= 0, outline.after[end], outline.after[j]),
                np.where(end >= 0, outline.before[end], j),
                params,
            ),
        ],
        1,
    )
    return _Cuts(a, b, support, (end >= 0) & outline.corner[end])


def _spread(order: Indices, corner: Indices, along: Points, length: Numbers, most: int) -> Indices:
    """Of the cuts from each corner the shortest few that go different ways."""
    kept: dict[int, list[int]] = {}
    for k in order[np.argsort(length[order], kind="stable")].tolist():
        rivals = kept.setdefault(int(corner[k]), [])
        if len(rivals) < most and all(float(along[k] @ along[r]) <= DIRECTIONS_APART for r in rivals):
            rivals.append(k)
    return np.array([k for rivals in kept.values() for k in rivals], dtype=np.int64)


def _support(
    outline: _Outline, start: Points, along: Points, forward: Indices, backward: Indices, params: Params
) -> Numbers:
    """Metres over which the outline runs on from `start` in direction `along`, walked either way round; at most `wall_support_m`."""
    slack, most = params.wall_support_slack_m, params.wall_support_m
    best = np.zeros(len(start))
    for step, first in ((outline.after, forward), (outline.before, backward)):
        vertex, far, last = first.copy(), np.zeros(len(start)), np.zeros((len(start), 2))
        live = np.ones(len(start), bool)
        for _ in range(WALK):
            gap = outline.points[vertex] - start
            ahead = (gap * along).sum(1)
            aside = np.abs(gap[:, 0] * along[:, 1] - gap[:, 1] * along[:, 0])
            astray = aside > slack + 0.12 * np.maximum(ahead, 0)
            share = np.clip((slack - last[:, 1]) / np.maximum(aside - last[:, 1], 1e-9), 0, 1)
            reached = np.where(astray, last[:, 0] + share * (ahead - last[:, 0]), ahead)
            far = np.where(live, np.maximum(far, reached), far)
            live &= ~astray & (ahead >= far - SAME_END_M / 4)
            last = np.where(live[:, None], np.stack([ahead, aside], 1), last)
            live &= far < most
            vertex = np.where(live, step[vertex], vertex)
        best = np.maximum(best, far)
    return np.minimum(best, most)


def _choose(cuts: _Cuts) -> _Cuts:
    """Short and well supported cuts first; one that crosses or repeats a better one is dropped."""
    order = np.argsort(cuts.length - SUPPORT_CREDIT * np.minimum(cuts.support.sum(1), 2.0), kind="stable")
    chosen: list[int] = []
    for k in order.tolist():
        if not chosen or not _clash(cuts.a[k], cuts.b[k], cuts.a[chosen], cuts.b[chosen]):
            chosen.append(k)
    return cuts.take(np.array(chosen, dtype=np.int64))


def _clash(a: Points, b: Points, c: Points, d: Points) -> bool:
    """Whether the cut from a to b crosses, or has both ends with, one of the cuts from c to d (n, 2)."""

    def side(p: Points, q: Points, r: Points) -> Numbers:
        return np.asarray(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    crosses = (side(c, d, a) * side(c, d, b) < -1e-9) & (side(a, b, c) * side(a, b, d) < -1e-9)

    def near(p: Points, q: Points) -> Flags:
        return np.asarray(np.linalg.norm(p - q, axis=1) < SAME_END_M)

    same = (near(c, a) & near(d, b)) | (near(c, b) & near(d, a))
    return bool((crosses | same).any())


# -- joining -------------------------------------------------------------------------------------------------------


def _join_scores(
    cuts: _Cuts, mask: Mask, clearance: npt.NDArray[np.float32], frame: GridFrame, params: Params
) -> Numbers:
    """How much speaks for joining both sides of each cut; before size and shape of the pieces are looked at."""
    length = cuts.length
    sides = np.array(
        [_side_clearance(a, b, mask, clearance, frame) for a, b in zip(cuts.a, cuts.b, strict=True)]
    ).reshape(-1, 2)
    narrowing = np.sort(np.minimum(length[:, None] / np.maximum(sides, 0.1), 2.0), axis=1)
    w = WEIGHTS
    return np.asarray(
        w["constant"]
        - params.divider_sensitivity
        + w["length"] * length
        + w["support"] * np.minimum(cuts.support.sum(1), 2.0)
        + w["weaker_support"] * cuts.support.min(1, initial=np.inf)
        + w["narrow_side"] * narrowing[:, 1]
        + w["wide_side"] * narrowing[:, 0]
        + w["two_corners"] * cuts.two_corners
    )


def _side_clearance(
    a: Points, b: Points, mask: Mask, clearance: npt.NDArray[np.float32], frame: GridFrame
) -> tuple[float, float]:
    """Width of the floor (twice the largest clearance, metres) in the connected half discs on both sides of a cut."""
    p, q = frame.to_cells(np.stack([a, b]))
    length = float(np.hypot(*(b - a)))
    radius = (1.25 * length + 0.4) / frame.resolution
    middle, along = (p + q) / 2, (q - p) / max(float(np.hypot(*(q - p))), 1e-9)
    x0, y0 = np.maximum(np.floor(middle - radius), 0).astype(int).tolist()
    x1, y1 = np.minimum(np.ceil(middle + radius) + 1, mask.shape[::-1]).astype(int).tolist()
    step = 1 + int(radius > 26) + int(radius > 60)
    x = np.arange(x0, x1, step, dtype=np.float32)[None] + 0.5 - np.float32(middle[0])
    y = np.arange(y0, y1, step, dtype=np.float32)[:, None] + 0.5 - np.float32(middle[1])
    beyond = y * along[0] - x * along[1]
    disc = mask[y0:y1:step, x0:x1:step] & (x * x + y * y <= radius * radius)
    width = clearance[y0:y1:step, x0:x1:step]
    found = []
    for sign in (1.0, -1.0):
        _, labels = cv2.connectedComponents(
            (disc & (beyond * sign >= 0.7)).view(np.uint8), connectivity=4, ltype=cv2.CV_16U
        )
        starts = np.array(
            [
                [t * (q - p) + sign * o * step * np.array([-along[1], along[0]]) for o in (1.6, 2.6)]
                for t in (0, -0.25, 0.25)
            ]
        )
        cells = np.floor((starts.reshape(-1, 2) + middle - (x0, y0)) / step)
        hit = look_up(labels, cells + 0.5, 0)
        label = hit[np.flatnonzero(hit)[0]] if hit.any() else 0
        found.append(2 * float(width[labels == label].max()) if label else 0.1)
    return found[0], found[1]


def _join(
    pieces: tuple[Polygon, ...], between: dict[int, tuple[int, int]], scores: dict[int, float], params: Params
) -> list[int]:
    """Joins pieces, best score first, until nothing speaks for joining any more; the group of each piece."""
    group = list(range(len(pieces)))
    area = [piece.area for piece in pieces]
    hull = [piece.convex_hull for piece in pieces]
    joins: dict[tuple[int, int], float] = {}
    for k, (i, j) in between.items():
        pair = (min(i, j), max(i, j))
        joins[pair] = max(joins.get(pair, -np.inf), scores[k])

    def evidence(pair: tuple[int, int]) -> float:
        i, j = pair
        smaller = float(min(area[i], area[j]))
        if smaller < params.room_area_m2:
            return 100.0 - smaller + joins[pair] * 1e-3
        value = joins[pair] - SIZE_WEIGHT * float(np.log(smaller / SIZE_UNIT_M2))
        hollow = float(shapely.union(hull[i], hull[j]).convex_hull.area - hull[i].area - hull[j].area)
        return value - HOLLOW_WEIGHT * min(max(hollow, 0.0) / smaller, 2.0)

    ranked = {pair: evidence(pair) for pair in joins}
    while ranked:
        best = max(ranked, key=lambda pair: (ranked[pair], pair))
        if ranked[best] <= 0:
            break
        i, j = best
        group = [i if g == j else g for g in group]
        area[i] += area[j]
        hull[i] = shapely.union(hull[i], hull[j]).convex_hull
        for pair in [pair for pair in joins if j in pair]:
            score = joins.pop(pair)
            ranked.pop(pair, None)
            other = pair[0] if pair[1] == j else pair[1]
            if other != i:
                renamed = (min(i, other), max(i, other))
                joins[renamed] = max(joins.get(renamed, -np.inf), score)
        ranked.update({pair: evidence(pair) for pair in joins if i in pair})
    return group
