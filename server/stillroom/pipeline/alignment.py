"""Where the walls went: aligns a map's walls with a new grid, first as a whole, then locally.

Tracking leaves errors that would add up from mission to mission. Each wall is looked for along its own normal near its tracked place, on
that side of an obstacle from which the room saw it, so that the two faces of a thin wall are never mixed up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import GridFrame, OccupancyGrid, look_up
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.params import Params

Numbers = npt.NDArray[np.float64]

SAMPLE_M = 0.10
ROUNDS = 5
FINAL_REACH_M = 0.15
NEIGHBOURHOOD_M = 1.0
"""Walls at this distance have 60 % of the say of those close by."""
STIFFNESS = 6.0
"""Evidence, in samples, that it takes to move a place half as far as its walls say."""
FRONTIER_WEIGHT = 0.3
"""What a border to unexplored space says about a wall, compared with an obstacle."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """`motion` from the previous frame to the grid's; `seen`: share of the walls in sight; `share`: of those, that lie where it puts them."""

    motion: Motion
    share: float
    seen: float


@dataclass(frozen=True, eq=False)
class _Faces:
    """The floor's border cells by the side on which it ends: (4, height, width) for +x, +y, -x, -y; 2 an obstacle, 1 unexplored, 0 none."""

    frame: GridFrame
    sides: npt.NDArray[np.uint8]
    explored: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class WallSamples:
    """Points on walls and their normals, away from the floor, both (n, 2), metres."""

    points: Points
    normals: Points

    def moved(self, pose: Pose) -> "WallSamples":
        return WallSamples(pose.apply(self.points), self.normals @ pose.rotation.T)

    def where(self, chosen: npt.NDArray[np.bool_]) -> "WallSamples":
        return WallSamples(self.points[chosen], self.normals[chosen])


def align(previous: SemanticMap, motion: Motion, grid: OccupancyGrid, reach_m: float, params: Params) -> Alignment:
    """Improves `motion` (previous frame -> grid's frame) by up to `reach_m`, with what the walls in `grid` say."""
    vertices = previous.vertices()
    tracked = motion.consensus(vertices, NEIGHBOURHOOD_M, params.tracking_outlier_m) if len(motion.source) else vertices
    motion = Motion(vertices, tracked)
    samples = sample_walls(_moved([as_points(wall.line) for wall in previous.walls], motion))
    faces = _faces(grid)
    if not len(samples.points):
        return Alignment(Motion.through(vertices, tracked), 0.0, 0.0)
    pose = Pose()
    for reach in np.geomspace(reach_m, min(FINAL_REACH_M, reach_m), ROUNDS):
        moved = samples.moved(pose)
        offset, weight = _offsets(moved, faces, float(reach))
        pose = _step(moved, offset, weight, float(reach) / 3).after(pose)
    moved = samples.moved(pose)
    offset, weight = _offsets(moved, faces, params.alignment_reach_m)
    places = pose.apply(tracked)
    ends = [np.flatnonzero((vertices[:, None] == as_points(d.line)[None]).all(2).any(1)) for d in previous.dividers]
    middles = as_points([places[end].mean(0) for end in ends])
    shift = _local_shift(np.concatenate([places, middles]), moved, offset, weight, params.alignment_inlier_m)
    shift, together = shift[: len(places)], shift[len(places) :]
    for end, middle in zip(ends, together, strict=True):
        shift[end] = middle
    seen = look_up(
        faces.explored, faces.frame.to_cells(moved.points - 2 * grid.frame.resolution * moved.normals), False
    )
    hit = (np.abs(offset) <= params.alignment_inlier_m + grid.frame.resolution / 2) & (weight > 0)
    share = float((hit & seen).sum() / max(int(seen.sum()), 1))
    return Alignment(Motion.through(vertices, places + shift), share, float(seen.mean()))


def _moved(lines: Sequence[Points], motion: Motion) -> list[Points]:
    moved = motion.apply(np.concatenate([np.zeros((0, 2)), *lines]))
    return np.split(moved, np.cumsum([len(line) for line in lines])[:-1]) if lines else []


def sample_walls(lines: Sequence[Points]) -> WallSamples:
    """Points every `SAMPLE_M` along polylines (n, 2) that have the floor on their left, so that normals point right."""
    if not lines:
        return WallSamples(np.zeros((0, 2)), np.zeros((0, 2)))
    line = np.concatenate(lines)
    last = np.cumsum([len(points) for points in lines]) - 1
    edge, begin = np.delete(np.diff(line, axis=0), last[:-1], axis=0), np.delete(line, last, axis=0)
    length = np.hypot(*edge.T)
    count = np.maximum(np.round(length / SAMPLE_M), 1).astype(int)
    which = np.repeat(np.arange(len(edge)), count)
    along = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[which]
    unit = edge / np.maximum(length, 1e-9)[:, None]
    return WallSamples(begin[which] + along[:, None] * edge[which], np.stack([unit[:, 1], -unit[:, 0]], 1)[which])


def _faces(grid: OccupancyGrid) -> _Faces:
    padded = np.pad(grid.cells, 1)
    neighbours = (padded[1:-1, 2:], padded[2:, 1:-1], padded[1:-1, :-2], padded[:-2, 1:-1])
    kind = np.array([1, 0, 2], np.uint8)
    free = grid.free
    return _Faces(grid.frame, np.stack([np.where(free, kind[n], 0) for n in neighbours]), ~grid.unexplored)


def _offsets(samples: WallSamples, faces: _Faces, reach_m: float) -> tuple[Numbers, Numbers]:
    """How far along its normal (metres) each wall sample finds a face of its own side, and how much that says (0 where it finds none)."""
    frame = faces.frame
    normals = samples.normals @ frame.origin.rotation
    start = frame.to_cells(samples.points) - 0.5 * normals
    side = np.where(
        np.abs(normals[:, 0]) >= np.abs(normals[:, 1]),
        np.where(normals[:, 0] > 0, 0, 2),
        np.where(normals[:, 1] > 0, 1, 3),
    )
    most = max(1, round(reach_m / frame.resolution))
    steps = np.arange(-most, most + 1)
    steps = steps[np.argsort(np.abs(steps), kind="stable")]
    at = start[:, None] + steps[None, :, None] * normals[:, None]
    height, width = faces.explored.shape
    cells = np.floor(at).astype(np.int64)
    inside = ((cells >= 0) & (cells < (width, height))).all(2)
    column, row = np.clip(cells[..., 0], 0, width - 1), np.clip(cells[..., 1], 0, height - 1)
    found = np.where(inside, faces.sides[side[:, None], row, column], 0)
    rank = np.where(found == 2, 2, found) * (2 * most + 2) - np.arange(len(steps))[None] * (found > 0)
    best = rank.argmax(1)
    pick = np.arange(len(best))
    kind = found[pick, best]
    centre = np.stack([column[pick, best], row[pick, best]], 1) + 0.5
    offset = ((centre - start) * normals).sum(1) * frame.resolution
    return np.where(kind > 0, offset, 0.0), np.where(kind == 2, 1.0, np.where(kind == 1, FRONTIER_WEIGHT, 0.0))


def _step(samples: WallSamples, offset: Numbers, weight: Numbers, scale_m: float) -> Pose:
    """The rigid motion that best closes the offsets (one Gauss-Newton step, Cauchy weights)."""
    if not (weight > 0).any():
        return Pose()
    w = weight / (1 + (offset / scale_m) ** 2)
    centre = (w[:, None] * samples.points).sum(0) / w.sum()
    arm = samples.points - centre
    design = np.column_stack([samples.normals, arm[:, 0] * samples.normals[:, 1] - arm[:, 1] * samples.normals[:, 0]])
    spread = float((w[:, None] * arm**2).sum()) / float(w.sum())
    prior = np.diag([1.0, 1.0, max(spread, 1.0)])
    x, y, yaw = np.linalg.solve(design.T @ (w[:, None] * design) + prior, design.T @ (w * offset))
    turn = Pose(yaw=float(yaw))
    rest = centre - turn.apply(centre[None])[0]
    return Pose(float(x + rest[0]), float(y + rest[1]), float(yaw))


def _local_shift(places: Points, samples: WallSamples, offset: Numbers, weight: Numbers, scale_m: float) -> Points:
    """The shift of each place (n, 2) that the walls around it ask for; none in a direction of which no wall speaks."""
    p, q = places.astype(np.float32), samples.points.astype(np.float32)
    near = np.exp(((p[:, :1] - q[:, 0]) ** 2 + (p[:, 1:] - q[:, 1]) ** 2) / np.float32(-2 * NEIGHBOURHOOD_M**2))
    nx, ny = samples.normals.T
    w = weight / (1 + (offset / scale_m) ** 2)
    terms = w * np.stack([nx * nx, nx * ny, ny * ny, nx * offset, ny * offset])
    a, b, d, u, v = (near @ terms.T.astype(np.float32)).T.astype(np.float64)
    a, d = a + STIFFNESS, d + STIFFNESS
    determinant = a * d - b * b
    return np.stack([(d * u - b * v) / determinant, (a * v - b * u) / determinant], 1)
