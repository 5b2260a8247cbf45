"""What changes in homes and goes wrong in robots, how much of each, and the random streams they draw from.

Every effect draws from a stream of its own for each mission, so that one that is switched off, or what a service answers,
changes nothing else.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy.random import Generator, SeedSequence

Stream = Literal[
    "home",
    "furniture",
    "doors",
    "visits",
    "late",
    "route",
    "scans",
    "gaps",
    "specks",
    "jitter",
    "drift",
    "tracking",
    "outliers",
    "silence",
    "style",
    "doorways",
    "battery",
    "passages",
    "windows",
    "slam",
    "floors",
    "uploads",
    "model",
    "resets",
    "touch",
]
_STREAMS: tuple[Stream, ...] = Stream.__args__  # type: ignore[attr-defined]


@dataclass(frozen=True)
class Effects:
    """How much of each effect; 0 is none of it. `NONE` is a home that never changes, seen by a robot without errors."""

    turned: bool = False
    """The building stands at any angle to its map."""
    thin_walls: float = 0.0
    """Share of the homes whose inner walls are as thin as a cell."""
    diagonal_walls: float = 0.0
    """Share of the homes in which walls cut corners off."""
    open_plan: float = 0.0
    """Share of the homes where rooms lie beside each other without a wall, and their owner divides them."""
    windows: float = 0.0
    """Share of the longer outer walls that have a window down to the floor, which rays pass at times."""

    furniture_moves: float = 0.0
    """Share of the movable pieces that stand elsewhere after each mission."""
    doors_shut: float = 0.0
    """Share of the doors that are shut during a mission (never those that the robot starts behind)."""
    doorways_blocked: float = 0.0
    """Share of the doorways in which something stands, or the door's leaf stands ajar; the robot gets past."""
    rooms_skipped: float = 0.0
    """Probability that a room is not visited in a mission after the first."""
    battery_ends: float = 0.0
    """Probability that a mission after the first ends before all was explored."""
    rooms_late: int = 0
    """Rooms whose doors are shut until mission `late_until`."""
    late_until: int = 4
    passages: float = 0.0
    """Share of the homes in which a way through a wall is opened for good between two missions."""

    bumpers: float = 0.0
    """Share of the robots that sense nothing but what they touch."""
    turned_grids: float = 0.0
    """Share of the robots whose grids lie at an angle in their frame."""
    range_noise_m: float = 0.0
    """Standard deviation of each range."""
    scan_noise_m: float = 0.0
    """Standard deviation of where a single scan is put,"""
    scan_noise_deg: float = 0.0
    """and of how it is turned."""
    gaps_per_10m: float = 0.0
    """Stretches of wall that were not sensed, for 10 m of wall."""
    gap_m: tuple[float, float] = (0.10, 0.35)
    """Their length; the shorter the likelier."""
    specks: float = 0.0
    """False obstacles of a cell or a few, for 10 m2 of floor."""
    slam_failures: float = 0.0
    """Probability that a mission after the first comes with a wrecked grid: part of its scans lie far off, walls are doubled."""

    jitter_m: float = 0.0
    """Standard deviation of the sub-maps' wandering about their places,"""
    jitter_deg: float = 0.0
    """and of their turns."""
    drift_m: float = 0.0
    """Standard deviation of a mission's step of the whole frame,"""
    drift_deg: float = 0.0
    """and of its turn."""
    resets: float = 0.0
    """Probability that the robot has lost its map before a mission: its frame is a new one, and nothing is tracked from before."""

    tracking_noise_m: float = 0.0
    """Standard deviation of each tracked vertex."""
    tracking_outliers: float = 0.0
    """Share of the vertices that were tracked grossly wrong."""
    tracking_missing: float = 0.0
    """Probability that a mission has no tracking at all."""
    submap_tracking: float = 0.0
    """Share of the robots that track sub-maps instead of vertices,"""
    transform_tracking: float = 0.0
    """and of those that track nothing but their frame as a whole."""

    other_floors: float = 0.0
    """Probability that a mission after the first is of another floor, where the robot was carried to without knowing."""
    late_uploads: float = 0.0
    """Probability that a mission arrives after the next one."""
    stale_bases: float = 0.0
    """Probability that the robot set out before the mission before was processed, or its owner's edits were made."""

    spread: float = 1.0
    """Robots differ: each has so many times more or less of each error of its sensors and its tracking, at the most."""
    resolutions: tuple[float, ...] = (0.05,)
    """Metres a cell; each robot has one of them."""

    NONE: ClassVar["Effects"]
    DEMO: ClassVar["Effects"]

    def only(self, names: Collection[str]) -> "Effects":
        """These of the effects, in the same measure, and no others. Raises KeyError for a name that is not in EFFECTS."""
        kept = {field: getattr(self, field) for name in names for field in EFFECTS[name]}
        return replace(Effects.NONE, **kept)

    def of_robot(self, rng: Generator) -> "Effects":
        """What one of the robots has of them."""
        factors = self.spread ** rng.uniform(-1, 1, len(_ERRORS))
        own = {
            field: getattr(self, field) * float(factor)
            for error, factor in zip(_ERRORS, factors, strict=True)
            for field in EFFECTS[error]
            if isinstance(getattr(self, field), float)
        }
        resolution = self.resolutions[int(rng.integers(len(self.resolutions)))]
        return replace(self, **own, spread=1.0, resolutions=(resolution,))


EFFECTS: dict[str, tuple[str, ...]] = {
    "turned": ("turned",),
    "thin_walls": ("thin_walls",),
    "diagonal_walls": ("diagonal_walls",),
    "open_plan": ("open_plan",),
    "windows": ("windows",),
    "furniture": ("furniture_moves",),
    "doors": ("doors_shut",),
    "blocked_doorways": ("doorways_blocked",),
    "skipped_rooms": ("rooms_skipped",),
    "battery": ("battery_ends",),
    "late_rooms": ("rooms_late", "late_until"),
    "passages": ("passages",),
    "bumpers": ("bumpers",),
    "turned_grids": ("turned_grids",),
    "range_noise": ("range_noise_m",),
    "registration_noise": ("scan_noise_m", "scan_noise_deg"),
    "gaps": ("gaps_per_10m", "gap_m"),
    "specks": ("specks",),
    "slam_failures": ("slam_failures",),
    "jitter": ("jitter_m", "jitter_deg"),
    "drift": ("drift_m", "drift_deg"),
    "resets": ("resets",),
    "tracking_noise": ("tracking_noise_m",),
    "tracking_outliers": ("tracking_outliers",),
    "tracking_missing": ("tracking_missing",),
    "tracking_forms": ("submap_tracking", "transform_tracking"),
    "other_floors": ("other_floors",),
    "late_uploads": ("late_uploads",),
    "stale_bases": ("stale_bases",),
    "spread": ("spread",),
    "resolutions": ("resolutions",),
}
"""The effects by name, with the fields that say how much of them there is."""
_ERRORS = (
    "range_noise",
    "registration_noise",
    "gaps",
    "specks",
    "jitter",
    "drift",
    "tracking_noise",
    "tracking_outliers",
)
"""Those that robots have more or less of; new ones come last, so that the others are drawn as before."""

Effects.NONE = Effects()
Effects.DEMO = replace(
    Effects.NONE,
    furniture_moves=0.06,
    rooms_skipped=0.03,
    range_noise_m=0.010,
    scan_noise_m=0.008,
    scan_noise_deg=0.15,
    gaps_per_10m=0.4,
    specks=0.6,
    jitter_m=0.03,
    jitter_deg=0.25,
    tracking_noise_m=0.02,
)


@dataclass(frozen=True)
class Streams:
    """The random streams of one robot: independent for each purpose and mission, and the same whenever they are asked for."""

    seed: int
    robot: int = 0

    def of(self, purpose: Stream, mission: int = 0) -> Generator:
        key = (self.robot, _STREAMS.index(purpose), mission)
        return np.random.default_rng(SeedSequence(self.seed, spawn_key=key))
