"""Where the walls went: aligns a map's walls with a new grid, first as a whole, then locally.

Tracking leaves errors that would add up from mission to mission. Each wall is looked for along its own normal near its tracked place, on
that side of an obstacle from which the room saw it, so that the two faces of a thin wall are never mixed up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose, as_points, as_tuples
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid, look_up
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.params import Params

Numbers = npt.NDArray[np.float64]

SAMPLE_M = 0.10
ROUNDS = 5
THINNED = 3
"""Every third sample settles the rigid motion."""
FINAL_REACH_M = 0.15
NEIGHBOURHOOD_M = 1.0
"""Walls at this distance have 60 % of the say of those close by."""
FAR_M = 6.0
"""Walls farther off say nothing about a place."""
BLOCK = 512
"""Places looked at together: buildings have tens of thousands of them, and of wall samples."""
STIFFNESS = 6.0
"""Evidence, in samples, that it takes to move a place half as far as its walls say."""
FRONTIER_WEIGHT = 0.3
"""What a border to unexplored space says about a wall, compared with an obstacle."""
KINDS = np.zeros(256, np.uint8)
KINDS[Cell.UNEXPLORED], KINDS[Cell.OCCUPIED] = 1, 2
FACE_WEIGHTS = np.array([0.0, FRONTIER_WEIGHT, 1.0])


@dataclass(frozen=True, eq=False)
class Alignment:
    """`motion` from the previous frame to the grid's; `seen`: share of the walls in sight; `share`: of those, that lie where it puts them."""

    motion: Motion
    share: float
    seen: float


@dataclass(frozen=True, eq=False)
class Faces:
    """What the floor's cells end at: `kinds` and `free` are (height + 2, width + 2), with a cell of nothing around.

    `kinds`: 2 an obstacle, 1 unexplored, 0 free; `free`: 1 where the floor is.
    """

    frame: GridFrame
    kinds: npt.NDArray[np.uint8]
    free: npt.NDArray[np.uint8]
    explored: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class WallSamples:
    """Points on walls and their normals, away from the floor, both (n, 2), metres."""

    points: Points
    normals: Points

    def moved(self, pose: Pose) -> "WallSamples":
        return WallSamples(pose.apply(self.points), self.normals @ pose.rotation.T)

    def where(self, chosen: npt.NDArray[np.bool_]) -> "WallSamples":
        return WallSamples(self.points.compress(chosen, 0), self.normals.compress(chosen, 0))


def align(previous: SemanticMap, motion: Motion, grid: OccupancyGrid, reach_m: float, params: Params) -> Alignment:
    """Improves `motion` (previous frame -> grid's frame) by up to `reach_m`, with what the walls in `grid` say."""
    vertices = previous.vertices()
    tracked = motion.consensus(vertices, NEIGHBOURHOOD_M, params.tracking_outlier_m) if len(motion.source) else vertices
    motion = Motion(vertices, tracked)
    samples = sample_walls(_moved([as_points(wall.line) for wall in previous.walls], motion))
    if not len(samples.points):
        return Alignment(Motion.through(vertices, tracked), 0.0, 0.0)
    faces = faces_of(grid)
    pose = settle(samples, faces, reach_m)
    moved = samples.moved(pose)
    offset, weight = _offsets(moved, faces, params.alignment_reach_m)
    places = pose.apply(tracked)
    ends = _divider_ends(previous, vertices)
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


def settle(samples: "WallSamples", faces: Faces, reach_m: float) -> Pose:
    """The rigid motion, of up to `reach_m`, that brings walls onto the faces of obstacles: some samples tell as much as all."""
    few = samples.where(np.arange(len(samples.points)) % THINNED == 0)
    pose = Pose()
    for reach in np.geomspace(reach_m, min(FINAL_REACH_M, reach_m), ROUNDS).tolist():
        moved = few.moved(pose)
        offset, weight = _offsets(moved, faces, reach)
        pose = _step(moved, offset, weight, reach / 3).after(pose)
    return pose


def _divider_ends(previous: SemanticMap, vertices: Points) -> list[list[int]]:
    """Where the ends of each divider are among the vertices (n, 2)."""
    index = {place: number for number, place in enumerate(as_tuples(vertices))}
    return [[index[place] for place in as_tuples(as_points(divider.line))] for divider in previous.dividers]


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
    normal = np.stack([unit[:, 1], -unit[:, 0]], 1)
    return WallSamples(begin.take(which, 0) + along[:, None] * edge.take(which, 0), normal.take(which, 0))


def faces_of(grid: OccupancyGrid) -> Faces:
    cells = cv2.copyMakeBorder(grid.cells, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=Cell.UNEXPLORED)
    free = (cells == Cell.FREE).view(np.uint8)
    return Faces(grid.frame, np.asarray(cv2.LUT(cells, KINDS), np.uint8), free, ~grid.unexplored)


def _offsets(samples: WallSamples, faces: Faces, reach_m: float) -> tuple[Numbers, Numbers]:
    """How far along its normal (metres) each wall sample finds a face of its own side, and how much that says (0 where it finds none).

    The nearest obstacle counts, and where there is none the nearest border to unexplored space.
    """
    frame = faces.frame
    x, y = frame.to_cells(samples.points).T
    nx, ny = (samples.normals @ frame.origin.rotation).T
    x, y = x - 0.5 * nx, y - 0.5 * ny
    columns = faces.kinds.shape[1]
    beyond = np.where(np.abs(nx) >= np.abs(ny), np.where(nx > 0, 1, -1), np.where(ny > 0, columns, -columns))
    most = max(1, round(reach_m / frame.resolution))
    steps = np.arange(-most, most + 1)
    steps = steps[np.argsort(np.abs(steps), kind="stable")]
    column = np.floor(x[:, None] + nx[:, None] * steps).clip(-1, frame.width).astype(np.int32)
    row = np.floor(y[:, None] + ny[:, None] * steps).clip(-1, frame.height).astype(np.int32)
    cell = (row + 1) * columns + column + 1
    found = faces.kinds.ravel().take(cell + beyond[:, None], mode="clip")
    found *= faces.free.ravel().take(cell, mode="clip")
    best = found.argmax(1)
    pick = np.arange(len(best))
    kind = found[pick, best]
    offset = (column[pick, best] + 0.5 - x) * nx + (row[pick, best] + 0.5 - y) * ny
    return np.where(kind > 0, offset * frame.resolution, 0.0), FACE_WEIGHTS[kind]


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
    shifts = [np.zeros((0, 2))]
    for block in np.split(places, range(BLOCK, len(places), BLOCK)):
        low, high = block.min(0) - FAR_M, block.max(0) + FAR_M
        around = ((samples.points >= low) & (samples.points <= high)).all(1)
        shifts.append(_shift(block, samples.where(around), offset[around], weight[around], scale_m))
    return np.concatenate(shifts)


def _shift(places: Points, samples: WallSamples, offset: Numbers, weight: Numbers, scale_m: float) -> Points:
    """The same with an array of all pairs of places and samples."""
    middle = places.mean(0)
    p, q = (places - middle).astype(np.float32), (samples.points - middle).astype(np.float32)
    near = p @ q.T
    near -= 0.5 * (p**2).sum(1)[:, None]
    near -= 0.5 * (q**2).sum(1)
    np.exp(np.divide(near, np.float32(NEIGHBOURHOOD_M**2), out=near), out=near)
    nx, ny = samples.normals.T
    w = weight / (1 + (offset / scale_m) ** 2)
    terms = w * np.stack([nx * nx, nx * ny, ny * ny, nx * offset, ny * offset])
    a, b, d, u, v = (near @ terms.T.astype(np.float32)).T.astype(np.float64)
    a, d = a + STIFFNESS, d + STIFFNESS
    determinant = a * d - b * b
    return np.stack([(d * u - b * v) / determinant, (a * v - b * u) / determinant], 1)
