"""How a robot's SLAM bends its map: sub-maps that wander about their true places, in a frame that may drift as a whole."""

from dataclasses import dataclass
from math import pi, radians, sqrt

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.maps.geometry import Points, Pose
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home

PITCH_M = 3.0
"""Distance of neighbouring sub-maps."""
BLEND_M = 1.5
"""Sub-maps give way to each other over about this distance."""
PERSISTENCE = 0.85
"""How much of a sub-map's offset is left after one mission."""

NEW_FRAME_M = 5.0
"""A frame after a reset lies up to this far from the home's, along x and y, at any angle."""
_EXACT_M = 1e-7
_MANY = 20_000
_LATTICE_M = 0.2
_ROW = 1024


@dataclass(frozen=True, eq=False)
class Distortion:
    """From where things are in a home to where a mission's map has them.

    Smooth and nearly rigid around each of the sub-maps' `centres` (n, 2): `shifts` (n, 2) metres, `turns` (n,) radians.
    """

    centres: Points
    shifts: Points
    turns: npt.NDArray[np.float64]
    frame: Pose = Pose()

    def apply(self, points: Points) -> Points:
        """Points (n, 2) of the home on the map."""
        return self.frame.apply(points + self._offset(points))

    def undo(self, points: Points) -> Points:
        """Points (n, 2) of the map in the home: `apply` backwards, to a micrometre."""
        bent = self.frame.inverse().apply(points)
        straight = bent
        for _ in range(12):
            before, straight = straight, bent - self._offset(straight)
            if not len(points) or np.abs(straight - before).max() < _EXACT_M:
                break
        return straight

    def _offset(self, points: Points) -> Points:
        return self._interpolated(points) if len(points) > _MANY else self._exact(points)

    def _interpolated(self, points: Points) -> Points:
        """Of very many points, to less than a millimetre: between the nodes of a lattice over them."""
        low = points.min(0)
        columns, rows = (np.ceil((points.max(0) - low) / _LATTICE_M).astype(int) + 2).tolist()
        nodes = low + np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2) * _LATTICE_M
        offsets = self._exact(nodes).reshape(rows, columns, 2).astype(np.float32)
        padded = np.pad((points - low) / _LATTICE_M, ((0, -len(points) % _ROW), (0, 0)))
        where_x, where_y = padded.T.astype(np.float32)
        found = cv2.remap(offsets, where_x.reshape(-1, _ROW), where_y.reshape(-1, _ROW), cv2.INTER_LINEAR)
        return np.asarray(found.reshape(-1, 2)[: len(points)], np.float64)

    def _exact(self, points: Points) -> Points:
        # each sub-map moves p by (R - 1)(p - centre) + shift, which is linear in p: what depends on the sub-map is summed first
        sine, cosine = np.sin(self.turns), np.cos(self.turns) - 1.0
        x, y = self.centres.T
        fixed = self.shifts - np.stack([cosine * x - sine * y, sine * x + cosine * y], 1)
        s, c, dx, dy = (self._weights(points) @ np.column_stack([sine, cosine, fixed])).T
        px, py = points.T
        return np.stack([c * px - s * py + dx, s * px + c * py + dy], 1)

    def _weights(self, points: Points) -> npt.NDArray[np.float64]:
        """Share (n, m) of each sub-map in each point."""
        squared = (points**2).sum(1)[:, None] + (self.centres**2).sum(1) - 2 * points @ self.centres.T
        weights = np.exp((squared.min(1, keepdims=True) - squared) / (2 * BLEND_M**2))
        return np.asarray(weights / weights.sum(1, keepdims=True))


def distortion_at(home: Home, mission: int, effects: Effects, streams: Streams) -> Distortion:
    """The distortion of a mission's map: a random walk over the missions that is drawn back to the truth."""
    centres = submaps(home)
    offsets = np.zeros((len(centres), 3))
    drift = Pose()
    for past in range(mission + 1):
        step = streams.of("jitter", past).normal(size=(len(centres), 3))
        offsets = step if past == 0 else PERSISTENCE * offsets + sqrt(1 - PERSISTENCE**2) * step
        x, y, turn = streams.of("drift", past).normal(size=3).tolist()
        if is_reset(past, effects, streams):
            x, y, turn = streams.of("resets", past).uniform(-1, 1, 4)[1:].tolist()
            drift = Pose(x * NEW_FRAME_M, y * NEW_FRAME_M, turn * pi)
        elif past:
            drift = Pose(x * effects.drift_m, y * effects.drift_m, turn * radians(effects.drift_deg)).after(drift)
    return Distortion(centres, offsets[:, :2] * effects.jitter_m, offsets[:, 2] * radians(effects.jitter_deg), drift)


def is_reset(mission: int, effects: Effects, streams: Streams) -> bool:
    """Whether the robot had lost its map before a mission."""
    return mission > 0 and (1 + float(streams.of("resets", mission).uniform(-1, 1, 4)[0])) / 2 < effects.resets


def submaps(home: Home) -> Points:
    """Centres (n, 2) of the sub-maps: a lattice over the home."""
    x0, y0, x1, y1 = home.walls.bounds
    xs, ys = np.arange(x0, x1 + PITCH_M, PITCH_M), np.arange(y0, y1 + PITCH_M, PITCH_M)
    return np.stack(np.meshgrid(xs, ys), -1).reshape(-1, 2)
