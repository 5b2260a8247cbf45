"""Straight edges for the borders of a mask: the corners that matter, a line fitted to the border between each two, and where these lines meet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Points, as_points, polygons_in
from stillroom.pipeline.params import Params
from stillroom.pipeline.tracing import Corners, enclosed

Numbers = npt.NDArray[np.float64]

STEP_M, STEP = 0.04, 0.8
"""Parallel edges must lie apart by so many metres, and so many cells, to be told from one edge."""
SHORTEST_FIT_M = 0.3
"""A shorter edge is no line to fit: it goes from corner to corner."""
BULGE = 0.01
"""Cells; small beside any distance between corners."""
MARGIN = 0.1
"""Share of an edge at both of its ends that is not fitted: corners are ragged."""


def straightened(borders: Sequence[Corners], cell: float, params: Params) -> list[list[Polygon]]:
    """Each border of the floor as valid polygons in continuous cell coordinates, mostly one. `cell`: metres."""
    tolerance = max(params.outline_tolerance_m / cell, 1.1)
    rings = _bulged(borders)
    found: dict[int, list[Polygon]] = {}
    for finer in (tolerance, tolerance / 2, 1.0):
        left = [k for k in range(len(borders)) if not found.get(k)]
        if not left:
            break
        kept = shapely.simplify(rings[left], finer + 2 * BULGE, preserve_topology=False)
        corners, ring = shapely.get_coordinates(kept, include_z=True, return_index=True)
        at = np.split(corners[:, 2].astype(np.int64), np.cumsum(np.bincount(ring, minlength=len(left)))[:-1])
        fit = [k for k in range(len(left)) if len(at[k]) >= 4]
        fitted = _fitted([borders[left[k]] for k in fit], [at[k] for k in fit], finer, cell)
        found.update((left[k], parts) for k, parts in zip(fit, fitted, strict=True))
    for k, border in enumerate(borders):
        if not found.get(k):
            found[k] = polygons_in(shapely.make_valid(Polygon(border)))
    return [found[k] for k in range(len(borders))]


def _fitted(
    borders: Sequence[Corners], at: Sequence[npt.NDArray[np.int64]], tolerance: float, cell: float
) -> list[list[Polygon]]:
    """Fits a line to each border between the corners `at` that matter and intersects neighbours; nothing where that fails.

    Straight edges on both sides of a thin wall may cross. What both claim is left to the wall, so that it still holds.
    """
    if not borders:
        return []
    edges = Edges.of(borders, at)
    points, ring = _meet(edges, *_fit_edges(edges, SHORTEST_FIT_M / cell), tolerance, max(STEP, STEP_M / cell))
    polygons = shapely.polygons(shapely.linearrings(points, indices=ring))
    valid, slack = shapely.is_valid(polygons), 0.25 * tolerance * shapely.length(polygons)
    found = []
    for k, border in enumerate(borders):
        parts = [polygons[k]] if valid[k] else polygons_in(shapely.make_valid(polygons[k]))
        area = abs(enclosed(border))
        missing = abs(sum(part.area for part in parts) - area)
        found.append(parts if missing <= slack[k] + 0.2 * area else [])
    return found


def _closed(borders: Sequence[Corners]) -> tuple[Corners, npt.NDArray[np.int64]]:
    """The corners of all borders, one after the other, the first of each again at its end; and how many each has so."""
    return (
        np.concatenate([corners for border in borders for corners in (border, border[:1])]),
        np.array([len(border) + 1 for border in borders]),
    )


def _bulged(borders: Sequence[Corners]) -> npt.NDArray[np.object_]:
    """The borders as closed lines, a little blown up, by more the farther from their middles; z is a corner's number.

    On a grid many corners are equally far from the chord between two others, and which of them is kept would depend on the way round.
    """
    if not borders:
        return np.zeros(0, dtype=object)
    closed, size = _closed(borders)
    begin, ring = np.cumsum(size) - size, np.repeat(np.arange(len(size)), size)
    from_middle = closed - (np.add.reduceat(closed, begin) / size[:, None]).take(ring, 0)
    far = np.hypot(*from_middle.T)
    extent = np.array([max(most, 1.0) ** 3 for most in np.maximum.reduceat(far, begin).tolist()])
    blown_up = closed + BULGE * from_middle * far[:, None] ** 2 / extent[ring][:, None]
    number = np.arange(len(closed)) - begin[ring]
    return np.asarray(shapely.linestrings(np.column_stack([blown_up, number]), indices=ring))


@dataclass(frozen=True, eq=False)
class Edges:
    """Straight edges that borders are to have, ring after ring, each from a corner of the border to another.

    `closed`: (n, 2), all borders' corners, the first of each again at its end; `size`: how many each has so; `ring`: (m,), the border of each
    edge; `begin`, `end`: (m,), its corners; `before`: (m,), the edge that it follows.
    """

    closed: Corners
    size: npt.NDArray[np.int64]
    ring: npt.NDArray[np.int64]
    begin: npt.NDArray[np.int64]
    end: npt.NDArray[np.int64]
    before: npt.NDArray[np.int64]

    @staticmethod
    def of(borders: Sequence[Corners], at: Sequence[npt.NDArray[np.int64]]) -> "Edges":
        """Between the corners `at` of each border."""
        closed, size = _closed(borders)
        count = np.array([len(corners) - 1 for corners in at])
        last = np.cumsum(count) - 1
        ring = np.repeat(np.arange(len(borders)), count)
        first_corner = (np.cumsum(size) - size)[ring]
        before = np.arange(len(ring)) - 1
        before[last - count + 1] = last
        return Edges(
            closed,
            size,
            ring,
            np.concatenate([corners[:-1] for corners in at]) + first_corner,
            np.concatenate([corners[1:] for corners in at]) + first_corner,
            before,
        )


def _fit_edges(edges: Edges, shortest: float) -> tuple[Points, Points]:
    """Least-squares line, by a point and a direction, of the border along each edge, its corners' surroundings left out; edges shorter than
    `shortest` cells keep the line through their corners."""
    closed, size = edges.closed, edges.size
    stop = np.cumsum(size)
    begin = stop - size
    # moments are taken about each border's own middle, and added up border by border: large borders don't blur small ones
    middle = np.add.reduceat(closed, begin) / size[:, None]
    corner: Numbers = (closed.astype(np.float64) - np.repeat(middle, size, axis=0)).T
    length = np.abs(np.diff(closed, axis=0)).sum(1)
    walked = np.concatenate([[0.0], np.cumsum(length)])
    moments = _moments(corner[:, :-1], corner[:, 1:], length)
    total = np.zeros((6, len(closed)))
    for a, b in zip(begin.tolist(), stop.tolist(), strict=True):
        np.cumsum(moments[:, a : b - 1], axis=1, out=total[:, a + 1 : b])

    def until(distance: Numbers) -> Numbers:
        """Moments of the border from its first corner to where it has been walked so far."""
        edge = np.searchsorted(walked, distance, side="right") - 1
        p, beyond = corner.take(edge, 1), distance - walked[edge]
        stop_at = p + beyond / length[edge] * (corner.take(edge + 1, 1) - p)
        return np.asarray(total.take(edge, 1) + _moments(p, stop_at, beyond))

    starts, ends = closed.take(edges.begin, 0), closed.take(edges.end, 0)
    centres, directions = (starts + ends) / 2, (ends - starts).astype(np.float64)
    fit = np.flatnonzero(walked[edges.end] - walked[edges.begin] >= shortest)
    first, last = walked[edges.begin[fit]], walked[edges.end[fit]]
    margin = MARGIN * (last - first)
    found = until(last - margin) - until(first + margin)
    x, y, xx, xy, yy = found[1:] / found[0]
    angle = 0.5 * np.arctan2(2 * (xy - x * y), (xx - x * x) - (yy - y * y))
    axis = np.stack([np.cos(angle), np.sin(angle)], 1)
    axis *= np.where((axis * directions[fit]).sum(1, keepdims=True) >= 0, 1.0, -1.0)
    centres[fit], directions[fit] = np.stack([x, y], 1) + middle[edges.ring[fit]], axis
    return centres, directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-9)


def _moments(p: Numbers, q: Numbers, length: Numbers) -> Numbers:
    """Integrals of 1, x, y, xx, xy and yy along the segments from p to q, each (2, n): (6, n)."""
    (x, y), (u, v) = p, q
    integrals = np.empty((6, len(length)))
    integrals[0] = 1.0
    integrals[1], integrals[2] = (x + u) / 2, (y + v) / 2
    integrals[3], integrals[5] = (x * x + x * u + u * u) / 3, (y * y + y * v + v * v) / 3
    integrals[4] = (2 * x * y + x * v + u * y + 2 * u * v) / 6
    return np.asarray(length * integrals)


def _meet(
    edges: Edges, centres: Points, directions: Points, tolerance: float, step: float
) -> tuple[Points, npt.NDArray[np.int64]]:
    """Corners of the rings that the edges' lines make, (n, 2), and the ring of each, (n,).

    Nearly parallel neighbours that lie apart (the two faces of a wall that ends, or a step) keep the short edge between them.
    """
    corners, before = edges.closed.take(edges.begin, 0).astype(np.float64), edges.before
    normals = np.stack([directions[:, 1], -directions[:, 0]], 1)
    u, v, behind = directions.take(before, 0), directions, centres.take(before, 0)
    gap, sideways = centres - behind, normals.take(before, 0)
    sine = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    along = (gap[:, 0] * v[:, 1] - gap[:, 1] * v[:, 0]) / np.where(np.abs(sine) > 1e-6, sine, 1.0)
    crossing = behind + along[:, None] * u
    a = corners - ((corners - behind) * sideways).sum(1, keepdims=True) * sideways
    b = corners - ((corners - centres) * normals).sum(1, keepdims=True) * normals
    meets = (np.abs(sine) > 0.35) & (np.linalg.norm(crossing - corners, axis=1) < 2.5 * tolerance)
    apart = ~meets & (np.linalg.norm(a - b, axis=1) > step)
    first = np.where(meets[:, None], crossing, np.where(apart[:, None], a, (a + b) / 2))
    kept = np.stack([np.ones_like(apart), apart], 1)
    return as_points(np.stack([first, b], 1)[kept]), np.repeat(edges.ring, kept.sum(1))
