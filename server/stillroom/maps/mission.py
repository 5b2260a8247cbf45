"""One mission of a robot, as the pipeline sees it: the grid it ended with and how the map moved since the version in force."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import shapely

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap


@dataclass(frozen=True)
class Tracking:
    """What the robot's SLAM tracked from the base version to the end of the mission, in any of four forms; all may be missing.

    `rooms`: room id -> (n, 2), exterior vertices in the base version's order, closing vertex left out or not; `dividers`: divider id -> (2, 2);
    `submaps`: (from, to) poses; `transform`: base frame -> new frame.
    """

    rooms: Mapping[str, Points] = field(default_factory=dict)
    dividers: Mapping[str, Points] = field(default_factory=dict)
    submaps: tuple[tuple[Pose, Pose], ...] = ()
    transform: Pose | None = None


@dataclass(frozen=True)
class Mission:
    """`motion` takes points of the version in force to this mission's frame; None where the robot tracked nothing."""

    id: str
    grid: OccupancyGrid
    motion: Motion | None


def tracked_motion(base: SemanticMap, tracking: Tracking) -> tuple[Motion | None, tuple[str, ...]]:
    """The motion from the base version's frame to the mission's, and a warning for each entry that does not fit the base and is ignored.

    Precedence: rooms and dividers, then submaps, then transform; None where nothing usable was tracked.
    """
    source, target, warnings = _tracked_vertices(base, tracking)
    if len(source):
        return Motion.through(source, target), warnings
    if tracking.submaps:
        everything = base.vertices()
        frames = [(from_, to.after(from_.inverse())) for from_, to in tracking.submaps]
        centres = np.array([(from_.x, from_.y) for from_, _ in frames])
        nearest = np.linalg.norm(everything[:, None] - centres[None], axis=2).argmin(1)
        moved = np.empty_like(everything)
        for i, (_, pose) in enumerate(frames):
            moved[nearest == i] = pose.apply(everything[nearest == i])
        return Motion.through(everything, moved), warnings
    if tracking.transform is not None:
        return Motion.rigid(tracking.transform), warnings
    return None, warnings


def _tracked_vertices(base: SemanticMap, tracking: Tracking) -> tuple[Points, Points, tuple[str, ...]]:
    """Tracked vertices of rooms and dividers, before and after; entries that don't fit the base give a warning instead."""
    known = {("room", room.id): shapely.get_coordinates(room.polygon.exterior)[:-1] for room in base.rooms}
    known |= {("divider", divider.id): as_points(divider.line) for divider in base.dividers}
    tracked = [("room", key, points) for key, points in tracking.rooms.items()]
    tracked += [("divider", key, points) for key, points in tracking.dividers.items()]
    source, target, warnings = [np.zeros((0, 2))], [np.zeros((0, 2))], []
    for kind, key, points in tracked:
        before = known.get((kind, key))
        if before is None:
            warnings.append(f"tracking of {kind} {key} is ignored: the base version has no such {kind}")
        elif len(points) not in (len(before), len(before) + (kind == "room")):
            warnings.append(
                f"tracking of {kind} {key} is ignored: {len(points)} points, the base version has {len(before)}"
            )
        else:
            source.append(before)
            target.append(points[: len(before)])
    return np.concatenate(source), np.concatenate(target), tuple(warnings)
