"""One mission of a robot, as the pipeline sees it: the grid it ended with and how the map moved since the version in force."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from stillroom.maps.geometry import Points, Pose
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

    Precedence: rooms and dividers, then submaps, then transform; None where nothing (usable) was tracked.
    """
    raise NotImplementedError
