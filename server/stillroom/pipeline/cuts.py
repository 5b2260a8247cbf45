"""Where dividers can be: straight cuts across the floor, from the corners that stick into it to the edges opposite.

Such corners are doorposts and the ends of walls. A cut is a doorway's where walls go on straight beyond its ends.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon

from stillroom.maps.geometry import Points
from stillroom.maps.grid import GridFrame, Mask
from stillroom.pipeline.params import Params

Numbers = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
Value = TypeVar("Value", bound=np.generic)

SIGHT_SAMPLES = 20
SAME_END_M = 0.5
"""Cuts whose ends lie as near to each other as the two faces of a wall close the same opening."""
WALK = 6
"""Outline edges followed beyond a cut's end."""
WEIGHTS = {"constant": -1.2, "length": -1.3, "support": 2.0, "weaker_support": -0.7, "two_corners": 0.8}
"""How much each property of a cut speaks for a border between rooms; fitted as those of `segmentation` are."""
HOPELESS = -2.5
"""Cuts for which less speaks are not looked at: hardly any turned out to be a border."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The floor's rings, floor on their left, in metres along the grid's own axes. All vertices (n, 2): `after` and `before` index the
    neighbours on the ring, `corner` marks those that stick into the floor; vertex k lies on ring `ring[k]`, `at[k]` metres from its first."""

    points: Points
    after: Indices
    before: Indices
    corner: Flags
    ring: Indices
    at: Numbers
    perimeter: Numbers
    """Of each ring, in metres."""


@dataclass(frozen=True, eq=False)
class Cuts:
    """Candidate dividers from `a` to `b` (n, 2), metres along the grid's own axes.

    `support` (n, 2) is the length of straight wall beyond each end, `two_corners` tells whether both ends are corners; the ends lie on the
    rings `ring` (n, 2), `at` (n, 2) metres from their first vertices.
    """

    a: Points
    b: Points
    support: Numbers
    two_corners: Flags
    ring: Indices
    at: Numbers

    @property
    def length(self) -> Numbers:
        return np.asarray(np.linalg.norm(self.b - self.a, axis=1))

    @property
    def along(self) -> Points:
        """Unit vectors from a to b."""
        return (self.b - self.a) / self.length[:, None]

    @property
    def left(self) -> Points:
        """Unit vectors to the left of the way from a to b."""
        along = self.along
        return np.stack([-along[:, 1], along[:, 0]], 1)

    def take(self, index: Indices | Flags) -> "Cuts":
        return Cuts(
            self.a[index], self.b[index], self.support[index], self.two_corners[index], self.ring[index], self.at[index]
        )


def outline_of(floor: MultiPolygon, frame: GridFrame, params: Params) -> Outline:
    """`floor`, in the map frame, must not be empty."""
    coordinates, ring_of = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(floor)), return_index=True)
    # rings are closed: the last vertex is the first again
    counts = np.bincount(ring_of) - 1
    ring = np.repeat(np.arange(len(counts)), counts)
    points = frame.to_cells(coordinates[np.arange(len(ring)) + ring]) * frame.resolution
    offsets = np.concatenate([[0], np.cumsum(counts)])
    after, before = np.arange(1, len(points) + 1), np.arange(-1, len(points) - 1)
    after[offsets[1:] - 1], before[offsets[:-1]] = offsets[:-1], offsets[1:] - 1
    into, out = points - points[before], points[after] - points
    turn = np.degrees(np.arctan2(into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0], (into * out).sum(1)))
    walked = np.concatenate([[0.0], np.cumsum(np.linalg.norm(out, axis=1))])
    return Outline(
        points,
        after,
        before,
        corner=turn < -params.corner_turn_deg,
        ring=ring,
        at=walked[:-1] - walked[offsets[:-1]][ring],
        perimeter=np.diff(walked[offsets]),
    )


def possible_cuts(
    outline: Outline, mask: Mask, clearance: npt.NDArray[np.float32], frame: GridFrame, params: Params
) -> Cuts:
    """From each corner to the nearest point of each outline edge, in sight, clear of walls at the middle.

    `clearance`: (height, width), metres from each cell of `mask` to the nearest that is none.
    """
    shortest, longest = params.divider_length_m
    p, q = outline.points, outline.points[outline.after]
    edge = q - p
    corners = np.flatnonzero(outline.corner)
    tree = shapely.STRtree(shapely.linestrings(np.stack([p, q], 1)))
    i, j = tree.query(shapely.points(p[corners]), predicate="dwithin", distance=longest)
    corner = corners[i]
    share = ((p[corner] - p[j]) * edge[j]).sum(1) / np.maximum((edge[j] ** 2).sum(1), 1e-9)
    share = np.clip(share, 0, 1)
    a, b = p[corner], p[j] + share[:, None] * edge[j]
    length = np.linalg.norm(b - a, axis=1)
    kept = np.flatnonzero((length > shortest) & (length < longest))
    middle = cells_at(clearance, (a[kept] + b[kept]) / 2, frame)
    kept = kept[middle >= params.divider_clearance * length[kept]]
    kept = kept[_in_sight(a[kept], b[kept], mask, frame)]
    vertex = np.where(share == 0, j, np.where(share == 1, outline.after[j], -1))
    # a vertex is the nearest point of both of its edges
    key = np.where(vertex >= 0, corner * len(p) + vertex, -1 - np.arange(len(corner)))
    kept = kept[np.unique(key[kept], return_index=True)[1]]
    corner, j, vertex, a, b, share = corner[kept], j[kept], vertex[kept], a[kept], b[kept], share[kept]
    at_vertex = vertex >= 0
    two_corners = at_vertex & outline.corner[vertex]
    along = (b - a) / length[kept, None]
    support = np.stack(
        [
            _support(outline, a, -along, outline.after[corner], outline.before[corner], params),
            _support(
                outline,
                b,
                along,
                np.where(at_vertex, outline.after[vertex], outline.after[j]),
                np.where(at_vertex, outline.before[vertex], j),
                params,
            ),
        ],
        1,
    )
    at = np.where(at_vertex, outline.at[vertex], outline.at[j] + share * np.linalg.norm(edge[j], axis=1))
    rings = np.stack([outline.ring[corner], outline.ring[j]], 1)
    cuts = Cuts(a, b, support, two_corners, rings, np.stack([outline.at[corner], at], 1))
    # a cut between two corners is found from either
    return cuts.take(~two_corners | (corner < vertex))


def cells_at(values: npt.NDArray[Value], places: Numbers, frame: GridFrame) -> npt.NDArray[Value]:
    """`values` (height, width) at places (..., 2) in metres along the grid's axes; those off the grid have the value at its edge."""
    column, row = ((places[..., k] / frame.resolution).astype(np.int64) for k in (0, 1))
    np.clip(column, 0, frame.width - 1, out=column)
    np.clip(row, 0, frame.height - 1, out=row)
    return np.asarray(values[row, column])


def _in_sight(a: Points, b: Points, mask: Mask, frame: GridFrame) -> Flags:
    """Whether the way from a to b (n, 2) leads over the floor; the ends themselves may be ragged."""
    length = np.linalg.norm(b - a, axis=1)
    margin = np.minimum(max(0.125, 2 * frame.resolution) / length, 0.45)[:, None]
    stations = margin + np.linspace(0, 1, SIGHT_SAMPLES)[None] * (1 - 2 * margin)
    sight = a[:, None] + stations[..., None] * (b - a)[:, None]
    return np.asarray(cells_at(mask, sight, frame).all(1))


def _support(
    outline: Outline, start: Points, along: Points, forward: Indices, backward: Indices, params: Params
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
            live &= ~astray & (ahead >= far - 0.05) & (far < most)
            if not live.any():
                break
            last = np.where(live[:, None], np.stack([ahead, aside], 1), last)
            vertex = np.where(live, step[vertex], vertex)
        best = np.maximum(best, far)
    return np.minimum(best, most)


def likely_cuts(cuts: Cuts) -> Cuts:
    """The cuts that may well be borders, most likely first, without those that cross or repeat a likelier one."""
    w = WEIGHTS
    speaks_for = (
        w["constant"]
        + w["length"] * cuts.length
        + w["support"] * np.minimum(cuts.support.sum(1), 2.0)
        + w["weaker_support"] * cuts.support.min(1, initial=np.inf)
        + w["two_corners"] * cuts.two_corners
    )
    order = np.argsort(-np.round(speaks_for, 6), kind="stable")
    cuts = cuts.take(order[speaks_for[order] > HOPELESS])
    rivals: list[list[int]] = [[] for _ in cuts.a]
    for better, worse in _rivals(cuts):
        rivals[worse].append(better)
    chosen: list[bool] = []
    for others in rivals:
        chosen.append(not any(chosen[k] for k in others))
    return cuts.take(np.array(chosen, np.bool_))


def _rivals(cuts: Cuts) -> list[tuple[int, int]]:
    """Pairs of cuts, the smaller index first, that cross or have both ends in common."""
    a, b = cuts.a, cuts.b
    boxes = shapely.box(*np.minimum(a, b).T, *np.maximum(a, b).T)
    i, j = shapely.STRtree(boxes).query(boxes)
    i, j = i[i < j], j[i < j]
    crosses = (_side(a[j], b[j], a[i]) * _side(a[j], b[j], b[i]) < -1e-9) & (
        _side(a[i], b[i], a[j]) * _side(a[i], b[i], b[j]) < -1e-9
    )
    middles = shapely.points((a + b) / 2)
    p, q = shapely.STRtree(middles).query(middles, predicate="dwithin", distance=SAME_END_M)
    p, q = p[p < q], q[p < q]
    repeats = (_near(a[p], a[q]) & _near(b[p], b[q])) | (_near(a[p], b[q]) & _near(b[p], a[q]))
    first, second = np.concatenate([i[crosses], p[repeats]]), np.concatenate([j[crosses], q[repeats]])
    return list(zip(first.tolist(), second.tolist(), strict=True))


def _side(p: Points, q: Points, r: Points) -> Numbers:
    """Positive where r lies to the left of the way from p to q."""
    return np.asarray((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0]))


def _near(p: Points, q: Points) -> Flags:
    return np.asarray(np.linalg.norm(p - q, axis=1) < SAME_END_M)
