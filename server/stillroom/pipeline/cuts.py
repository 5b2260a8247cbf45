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
from stillroom.maps.grid import GridFrame
from stillroom.pipeline.params import Params

Numbers = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
Value = TypeVar("Value", bound=np.generic)

ROUNDING_M = 1e-6
"""On a grid many lengths are equal: rounding errors must not tell them apart."""
TOUCH_M = 0.002
SAME_END_M = 0.5
"""Cuts whose ends lie as near to each other as the two faces of a wall close the same opening."""
BACK_M = 0.06
"""The outline may lead back so far, a cell of most maps, and still go on."""
WALK = 6
"""Outline edges followed beyond a cut's end."""
WEIGHTS = {"constant": -1.87, "length": -1.12, "support": 2.08, "weaker_support": -0.4, "two_corners": 0.55}
"""How much each property of a cut speaks for a border between rooms; fitted by `tests/real/fit_cuts.py`."""
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
    part: Indices
    """Which part of the floor each ring bounds."""

    @property
    def edges(self) -> Points:
        """From each vertex to the next."""
        return np.asarray(self.points[self.after] - self.points)

    @property
    def middle(self) -> Points:
        return np.asarray(self.points.mean(0))

    @property
    def ring_start(self) -> Numbers:
        """Where each ring begins if all are laid out one after the other."""
        return np.concatenate([[0.0], np.cumsum(self.perimeter)[:-1]])

    def places(self, ring: Indices, at: Numbers) -> tuple[Points, Indices]:
        """The points so far along the rings, and the edges that they lie on, by their first vertices."""
        begin = self.ring_start
        along = begin[ring] + at
        edge = np.searchsorted(begin[self.ring] + self.at, along, side="right") - 1
        direction = self.edges[edge]
        direction /= np.maximum(np.linalg.norm(direction, axis=-1, keepdims=True), 1e-9)
        return self.points[edge] + (along - begin[self.ring[edge]] - self.at[edge])[..., None] * direction, edge


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

    def remoteness(self, middle: Points) -> Numbers:
        """A number that hardly two cuts have in common, the same however the map is turned or mirrored."""
        return np.asarray(np.linalg.norm(self.a - middle, axis=1) + np.linalg.norm(self.b - middle, axis=1))

    def take(self, index: Indices | Flags) -> "Cuts":
        return Cuts(
            self.a[index], self.b[index], self.support[index], self.two_corners[index], self.ring[index], self.at[index]
        )


def outline_of(floor: MultiPolygon, frame: GridFrame, params: Params) -> Outline:
    """`floor`, in the map frame, must not be empty."""
    rings, part = shapely.get_rings(shapely.get_parts(floor), return_index=True)
    coordinates, ring_of = shapely.get_coordinates(rings, return_index=True)
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
        part=np.asarray(part, np.int64),
    )


def possible_cuts(outline: Outline, clearance: npt.NDArray[np.float32], frame: GridFrame, params: Params) -> Cuts:
    """From each corner to the nearest point of each outline edge, in sight, clear of walls at the middle.

    `clearance`: (height, width), metres from each cell of the floor to the nearest that is none.
    """
    shortest, longest = params.divider_length_m
    p, edge = outline.points, outline.edges
    corners = np.flatnonzero(outline.corner)
    tree = shapely.STRtree(shapely.linestrings(np.stack([p, p + edge], 1)))
    i, j = tree.query(shapely.points(p[corners]), predicate="dwithin", distance=longest)
    corner = corners[i]
    extent = np.maximum((edge[j] ** 2).sum(1), 1e-9)
    share = np.clip(((p[corner] - p[j]) * edge[j]).sum(1) / extent, 0, 1)
    near = ROUNDING_M / np.sqrt(extent)
    share = np.where(share < near, 0.0, np.where(share > 1 - near, 1.0, share))
    a, b = p[corner], p[j] + share[:, None] * edge[j]
    length = np.linalg.norm(b - a, axis=1)
    kept = np.flatnonzero((length > shortest + ROUNDING_M) & (length < longest - ROUNDING_M))
    middle = between_cells(clearance, (a[kept] + b[kept]) / 2, frame)
    kept = kept[middle >= params.divider_clearance * length[kept] - ROUNDING_M]
    vertex = np.where(share == 0, j, np.where(share == 1, outline.after[j], -1))
    # a vertex is the nearest point of both of its edges, and a cut between two corners is found from either
    twice = (vertex >= 0) & outline.corner[vertex] & (vertex < corner)
    key = np.where(vertex >= 0, corner * len(p) + vertex, -1 - np.arange(len(corner)))
    kept = kept[~twice[kept]]
    kept = kept[np.unique(key[kept], return_index=True)[1]]
    way, on_edge = b[kept] - a[kept], vertex[kept] < 0
    leads_in = _leads_in(outline, corner[kept], way, np.zeros(len(kept), np.bool_))
    kept = kept[leads_in & _leads_in(outline, np.where(on_edge, j[kept], vertex[kept]), -way, on_edge)]
    kept = kept[_in_sight(tree, a[kept], b[kept])]
    corner, j, vertex, a, b, share = corner[kept], j[kept], vertex[kept], a[kept], b[kept], share[kept]
    at_vertex = vertex >= 0
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
    return Cuts(a, b, support, at_vertex & outline.corner[vertex], rings, np.stack([outline.at[corner], at], 1))


def cells_at(values: npt.NDArray[Value], places: Numbers, frame: GridFrame) -> npt.NDArray[Value]:
    """`values` (height, width) at places (..., 2) in metres along the grid's axes; those off the grid have the value at its edge."""
    column, row = ((places[..., k] / frame.resolution).astype(np.int64) for k in (0, 1))
    np.clip(column, 0, frame.width - 1, out=column)
    np.clip(row, 0, frame.height - 1, out=row)
    return np.asarray(values[row, column])


def between_cells(values: npt.NDArray[np.float32], places: Numbers, frame: GridFrame) -> Numbers:
    """`values` (height, width) of cells at places (..., 2) in metres along the grid's axes, linear between the cells' centres."""
    column, row = (places[..., k] / frame.resolution - 0.5 for k in (0, 1))
    left = np.clip(np.floor(column), 0, frame.width - 2).astype(np.int64)
    below = np.clip(np.floor(row), 0, frame.height - 2).astype(np.int64)
    right, up = np.clip(column - left, 0, 1), np.clip(row - below, 0, 1)
    first = below * frame.width + left
    flat = values.ravel()
    lower = flat[first] * (1 - right) + flat[first + 1] * right
    upper = flat[first + frame.width] * (1 - right) + flat[first + frame.width + 1] * right
    return np.asarray(lower * (1 - up) + upper * up, np.float64)


def _leads_in(outline: Outline, vertex: Indices, ways: Points, on_edge: Flags) -> Flags:
    """Whether `ways` (n, 2) lead into the floor from the vertices, or from places `on_edge`, on the edges that begin there."""
    out = outline.edges[vertex]
    back = np.where(on_edge[:, None], -out, -outline.edges[outline.before[vertex]])
    angle, room = (np.arctan2(_cross(out, to), (out * to).sum(1)) % (2 * np.pi) for to in (ways, back))
    return np.asarray((angle > ROUNDING_M) & (angle < room - ROUNDING_M))


def _cross(u: Points, v: Points) -> Numbers:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _in_sight(edges: shapely.STRtree, a: Points, b: Points) -> Flags:
    """Whether nothing of the outline lies between a and b (n, 2)."""
    off = TOUCH_M * (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    blocked, _ = edges.query(shapely.linestrings(np.stack([a + off, b - off], 1)), predicate="intersects")
    return np.asarray(np.bincount(blocked, minlength=len(a)) == 0)


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
            live &= ~astray & (ahead >= far - BACK_M) & (far < most)
            if not live.any():
                break
            last = np.where(live[:, None], np.stack([ahead, aside], 1), last)
            vertex = np.where(live, step[vertex], vertex)
        best = np.maximum(best, far)
    return np.minimum(best, most)


def likely_cuts(cuts: Cuts, outline: Outline) -> Cuts:
    """The cuts that may well be borders, most likely first, without those that cross or repeat a likelier one."""
    speaks_for = properties(cuts) @ np.array(list(WEIGHTS.values()))
    # what is equally likely is ordered by where it lies, and not by how the map lies
    order = np.lexsort((np.round(cuts.remoteness(outline.middle), 6), -np.round(speaks_for, 6)))
    cuts = cuts.take(order[speaks_for[order] > HOPELESS])
    rivals: list[list[int]] = [[] for _ in cuts.a]
    for better, worse in _rivals(cuts):
        rivals[worse].append(better)
    chosen: list[bool] = []
    for others in rivals:
        chosen.append(not any(chosen[k] for k in others))
    return cuts.take(np.array(chosen, np.bool_))


def properties(cuts: Cuts) -> Numbers:
    """What speaks for a border, in the order of `WEIGHTS`: (n, 5)."""
    return np.stack(
        [
            np.ones(len(cuts.a)),
            cuts.length,
            np.minimum(cuts.support.sum(1), 2.0),
            cuts.support.min(1, initial=np.inf),
            cuts.two_corners,
        ],
        1,
    )


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
    return np.asarray(np.linalg.norm(p - q, axis=1) < SAME_END_M - ROUNDING_M)
