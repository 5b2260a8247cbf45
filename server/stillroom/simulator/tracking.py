"""What a robot's SLAM says of how its map moved: vertices, sub-maps or its frame as a whole, with its errors."""

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from stillroom.maps.geometry import Points, Pose, as_points, fit_pose
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects, Streams

OUTLIER_M = 1.0
"""Standard deviation of a vertex that was tracked grossly wrong."""
_ARM_M = 0.5
"""A sub-map's turn is told from the ends of two arms of this length."""
_TURN_NOISE_M = 2.0
"""An error of a sub-map's place turns it as well, as at this distance."""
Form = Literal["vertices", "submaps", "transform"]
Move = Callable[[Points], Points]


def form_of(effects: Effects, streams: Streams) -> Form:
    """What the robot's model tracks."""
    draw = streams.of("model", 1).random()
    if draw < effects.submap_tracking:
        return "submaps"
    return "transform" if draw < effects.submap_tracking + effects.transform_tracking else "vertices"


def track_map(
    base: Mapping[str, Any],
    before: Distortion,
    after: Distortion,
    form: Form,
    effects: Effects,
    noise: Generator,
    outliers: Generator,
) -> dict[str, Any]:
    """The `tracking` of a mission's meta: where the features of a map document, bent as `before`, lie on a map bent as `after`."""

    def move(points: Points) -> Points:
        return after.apply(before.undo(points))

    if form == "vertices":
        return _vertices(base, lambda points: _with_errors(move(points), effects, noise, outliers))
    if form == "submaps":
        return {"submaps": _submaps(before, after, effects, noise)}
    corners = as_points([point for ring in _rings(base).values() for point in ring])
    moved = fit_pose(corners, move(corners) + effects.tracking_noise_m * noise.normal(size=corners.shape))
    return {"transform": _as_list(moved)}


def _vertices(base: Mapping[str, Any], move: Move) -> dict[str, Any]:
    rooms = {key: _rounded(move(as_points(ring))) for key, ring in _rings(base).items()}
    dividers = {key: _rounded(move(as_points(line))) for key, line in _lines(base).items()}
    return {"rooms": rooms, "dividers": dividers}


def _rings(base: Mapping[str, Any]) -> dict[str, list[list[float]]]:
    """The rooms' exteriors, not closed."""
    return {f["id"]: f["geometry"]["coordinates"][0][:-1] for f in _of_kind(base, "room")}


def _lines(base: Mapping[str, Any]) -> dict[str, list[list[float]]]:
    return {f["id"]: f["geometry"]["coordinates"] for f in _of_kind(base, "divider")}


def _of_kind(base: Mapping[str, Any], semantic: str) -> list[Mapping[str, Any]]:
    return [feature for feature in base["features"] if feature["properties"]["semantic"] == semantic]


def _submaps(before: Distortion, after: Distortion, effects: Effects, noise: Generator) -> list[dict[str, Any]]:
    """Each sub-map's pose on both maps."""
    found = []
    for centre in before.centres:
        old, new = (_pose(distortion, centre) for distortion in (before, after))
        x, y, turn = (effects.tracking_noise_m * noise.normal(size=3)).tolist()
        new = Pose(new.x + x, new.y + y, new.yaw + turn / _TURN_NOISE_M)
        found.append({"from": _as_list(old), "to": _as_list(new)})
    return found


def _pose(distortion: Distortion, centre: Points) -> Pose:
    back, here, ahead = distortion.apply(centre + np.array([[-_ARM_M, 0.0], [0.0, 0.0], [_ARM_M, 0.0]]))
    x, y = ahead - back
    return Pose(float(here[0]), float(here[1]), float(np.arctan2(y, x)))


def _as_list(pose: Pose) -> list[float]:
    return [round(pose.x, 4), round(pose.y, 4), round(pose.yaw, 6)]


def _rounded(points: Points) -> list[list[float]]:
    rounded: list[list[float]] = np.round(points, 4).tolist()
    return rounded


def _with_errors(points: Points, effects: Effects, noise: Generator, outliers: Generator) -> Points:
    points = points + effects.tracking_noise_m * noise.normal(size=points.shape)
    gross: npt.NDArray[np.bool_] = outliers.random(len(points)) < effects.tracking_outliers
    return points + gross[:, None] * OUTLIER_M * outliers.normal(size=points.shape)
