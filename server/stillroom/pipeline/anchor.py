"""Drift: how far rooms have moved against each other, or shrunk, since a person last confirmed them, too slowly for any one mission to show.

A frame that slides or turns as a whole is no drift: the anchor shapes move with it, as one rigid body.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose, as_points, fit_pose
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Room
from stillroom.pipeline.params import Params

Polygons = npt.NDArray[np.object_]

STEP_M = 0.40
ROUNDS = 8
BETTER = 0.03
SCALE_M = 0.20
TIGHT_M = 0.02
"""Places that are farther off count less and less, so that rooms that stayed hold the frame: from the first scale to the second."""


@dataclass(frozen=True)
class Drift:
    """A room against its anchor: precision C/(B+C), recall C/(A+C), and how far it slid (metres; 0.0: it only shrank)."""

    room: str
    precision: float
    recall: float
    slid_m: float


def carry_anchors(rooms: Sequence[Room], motion: Motion) -> list[Polygon | None]:
    """Each room's anchor moved by the one rigid motion that most of the rooms make."""
    if not rooms:
        return []
    here, _ = _boundaries(np.array([room.polygon for room in rooms], dtype=object))
    there = motion.apply(here)
    pose = fit_pose(here, there)
    for scale_m in np.geomspace(SCALE_M, TIGHT_M, ROUNDS).tolist():
        pose = fit_pose(here, there, _weights(there - pose.apply(here), scale_m))
    return list(_all_moved(np.array([room.anchor for room in rooms], dtype=object), pose))


def find_drift(rooms: Sequence[Room], params: Params) -> tuple[Drift, ...]:
    """The rooms that have slid or shrunk, after one rigid alignment of all anchors with all rooms."""
    anchored = [room for room in rooms if room.anchor is not None]
    anchors = np.array([room.anchor for room in anchored], dtype=object)
    polygons = np.array([room.polygon for room in anchored], dtype=object)
    if (_recalls(anchors, polygons) >= params.drift_recall).all():
        return ()  # as they were carried: nothing to align
    pose = _together(anchors, polygons)
    aligned = _all_moved(anchors, pose)
    recalls = _recalls(aligned, polygons).tolist()
    found = [
        _drift(room, anchor, recall, params)
        for room, anchor, recall in zip(anchored, aligned, recalls, strict=True)
        if recall < params.drift_recall
    ]
    return tuple(drift for drift in found if drift.slid_m > 0 or drift.recall < params.shape_overlap)


def _recalls(anchors: Polygons, polygons: Polygons) -> npt.NDArray[np.float64]:
    """How much of each anchor is still in its polygon."""
    return np.asarray(shapely.area(shapely.intersection(anchors, polygons)) / shapely.area(anchors))


def moved(polygon: Polygon, pose: Pose) -> Polygon:
    return shapely.transform(polygon, lambda points: pose.apply(as_points(points)))


def _all_moved(polygons: Polygons, pose: Pose) -> Polygons:
    return np.asarray(shapely.transform(polygons, lambda points: pose.apply(as_points(points))))


def _boundaries(polygons: Polygons) -> tuple[Points, npt.NDArray[np.int64]]:
    """Places along the polygons' exteriors, (n, 2), and on which each lies, (n,)."""
    places, which = shapely.get_coordinates(
        shapely.segmentize(shapely.get_exterior_ring(polygons), STEP_M), return_index=True
    )
    return as_points(places), which


def _weights(offsets: Points, scale_m: float) -> npt.NDArray[np.float64]:
    """What is farther off than the scale hardly counts (Geman and McClure)."""
    x, y = offsets.T
    return np.asarray(1.0 / (1.0 + (x * x + y * y) / scale_m**2) ** 2)


def _together(anchors: Polygons, polygons: Polygons) -> Pose:
    """The rigid motion that brings all anchors' boundaries onto the rooms' (iteratively reweighted least squares)."""
    pose = Pose()
    places, which = _boundaries(anchors)
    rings = shapely.get_exterior_ring(polygons)[which]
    for scale_m in np.geomspace(SCALE_M, TIGHT_M, ROUNDS).tolist():
        here = pose.apply(places)
        nearest = shapely.get_coordinates(shapely.shortest_line(shapely.points(here), rings))
        there = np.ascontiguousarray(nearest[1::2])
        pose = fit_pose(here, there, _weights(there - here, scale_m)).after(pose)
    return pose


def _drift(room: Room, anchor: Polygon, recall: float, params: Params) -> Drift:
    """A room slid where it covers its anchor better once that is moved onto its middle; where a part is gone it does not."""
    x, y = (as_points(room.polygon.centroid.coords) - as_points(anchor.centroid.coords))[0].tolist()
    metres = float(np.hypot(x, y))
    onto = shapely.intersection(moved(anchor, Pose(x, y)), room.polygon).area / anchor.area
    slid = metres > params.drift_m and onto > recall + BETTER
    return Drift(room.id, recall * anchor.area / room.polygon.area, recall, metres if slid else 0.0)
