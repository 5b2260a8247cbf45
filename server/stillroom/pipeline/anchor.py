"""Drift: how far rooms have moved against each other since a person last confirmed them, too slowly for any one mission to show.

A frame that slides or turns as a whole is no drift: the anchor shapes move with it, as one rigid body.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose, as_points, fit_pose
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Room
from stillroom.pipeline.params import Params

STEP_M = 0.20
ROUNDS = 8
SCALE_M = 0.10
"""Places that are farther off than this count less and less, so that rooms that stayed hold the frame."""


@dataclass(frozen=True)
class Drift:
    """A room against its anchor: precision C/(B+C), recall C/(A+C), and how far it slid (metres)."""

    room: str
    precision: float
    recall: float
    slid_m: float


def carry_anchors(rooms: Sequence[Room], motion: Motion) -> list[Polygon | None]:
    """Each room's anchor moved by the one rigid motion that is nearest to `motion` over all rooms."""
    corners = as_points(shapely.get_coordinates([room.polygon for room in rooms]))
    pose = fit_pose(corners, motion.apply(corners)) if len(corners) else Pose()
    return [None if room.anchor is None else moved(room.anchor, pose) for room in rooms]


def find_drift(rooms: Sequence[Room], params: Params) -> tuple[Drift, ...]:
    """The rooms that have drifted, after one rigid alignment of all anchors with all rooms."""
    anchored = [(room, room.anchor) for room in rooms if room.anchor is not None]
    if all(_recall(anchor, room) >= params.drift_recall for room, anchor in anchored):
        return ()  # as they were carried: nothing to align
    samples = [shapely.get_coordinates(shapely.segmentize(anchor.exterior, STEP_M)) for _, anchor in anchored]
    pose = _together(samples, [room.polygon for room, _ in anchored])
    aligned = [(room, moved(anchor, pose), pose.apply(p)) for (room, anchor), p in zip(anchored, samples, strict=True)]
    found = [_drift(*one) for one in aligned if _recall(one[1], one[0]) < params.drift_recall]
    return tuple(drift for drift in found if drift.slid_m > params.drift_m)


def _recall(anchor: Polygon, room: Room) -> float:
    return float(shapely.intersection(anchor, room.polygon).area / anchor.area)


def moved(polygon: Polygon, pose: Pose) -> Polygon:
    return shapely.transform(polygon, lambda points: pose.apply(as_points(points)))


def _together(samples: Sequence[Points], polygons: Sequence[Polygon]) -> Pose:
    """The rigid motion that brings all anchors' boundaries onto the rooms' (iteratively reweighted least squares, Cauchy)."""
    pose = Pose()
    points = np.concatenate(samples)
    for _ in range(ROUNDS):
        here = pose.apply(points)
        there = np.concatenate([_nearest(pose.apply(p), room) for p, room in zip(samples, polygons, strict=True)])
        weights = 1.0 / (1.0 + ((there - here) ** 2).sum(1) / SCALE_M**2)
        pose = fit_pose(here, there, weights).after(pose)
    return pose


def _drift(room: Room, anchor: Polygon, points: Points) -> Drift:
    common = shapely.intersection(anchor, room.polygon).area
    shift = np.zeros(2)
    for _ in range(ROUNDS):
        offset = _nearest(points + shift, room.polygon) - points - shift
        weights = 1.0 / (1.0 + (offset**2).sum(1) / SCALE_M**2)
        shift = shift + (weights[:, None] * offset).sum(0) / weights.sum()
    return Drift(room.id, common / room.polygon.area, common / anchor.area, float(np.hypot(*shift)))


def _nearest(points: Points, polygon: Polygon) -> Points:
    """The nearest place on a polygon's exterior to each point, both (n, 2)."""
    lines = shapely.shortest_line(shapely.points(points), polygon.exterior)
    return as_points(shapely.get_coordinates(lines)[1::2])
