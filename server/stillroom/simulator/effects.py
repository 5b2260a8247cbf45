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
]
_STREAMS: tuple[Stream, ...] = Stream.__args__  # type: ignore[attr-defined]


@dataclass(frozen=True)
class Effects:
    """How much of each effect; 0 is none of it. `NONE` is a home that never changes, seen by a robot without errors."""

    furniture_moves: float = 0.0
    """Share of the movable pieces that stand elsewhere after each mission."""
    doors_shut: float = 0.0
    """Share of the doors that are shut during a mission (never those that the robot starts behind)."""
    rooms_skipped: float = 0.0
    """Probability that a room is not visited in a mission after the first."""
    rooms_late: int = 0
    """Rooms whose doors are shut until mission `late_until`."""
    late_until: int = 4

    range_noise_m: float = 0.0
    """Standard deviation of each range."""
    scan_noise_m: float = 0.0
    """Standard deviation of where a single scan is put,"""
    scan_noise_deg: float = 0.0
    """and of how it is turned."""
    gaps_per_10m: float = 0.0
    """Stretches of wall that were not sensed, for 10 m of wall."""
    gap_m: tuple[float, float] = (0.10, 0.35)
    specks: float = 0.0
    """False obstacles of a cell or a few, for 10 m2 of floor."""

    jitter_m: float = 0.0
    """Standard deviation of the sub-maps' wandering about their places,"""
    jitter_deg: float = 0.0
    """and of their turns."""
    drift_m: float = 0.0
    """Standard deviation of a mission's step of the whole frame,"""
    drift_deg: float = 0.0
    """and of its turn."""

    tracking_noise_m: float = 0.0
    """Standard deviation of each tracked vertex."""
    tracking_outliers: float = 0.0
    """Share of the vertices that were tracked grossly wrong."""
    tracking_missing: float = 0.0
    """Probability that a mission has no tracking at all."""

    NONE: ClassVar["Effects"]
    DEMO: ClassVar["Effects"]
    MILD: ClassVar["Effects"]
    MIDDLE: ClassVar["Effects"]
    HARD: ClassVar["Effects"]

    def only(self, names: Collection[str]) -> "Effects":
        """These of the effects, in the same measure, and no others. Raises KeyError for a name that is not in EFFECTS."""
        kept = {field: getattr(self, field) for name in names for field in EFFECTS[name]}
        return replace(Effects.NONE, **kept)


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


Effects.MILD = replace(Effects.DEMO, doors_shut=0.03, rooms_late=1, drift_m=0.03, drift_deg=0.5)
Effects.MIDDLE = replace(
    Effects.MILD,
    furniture_moves=0.12,
    doors_shut=0.06,
    rooms_skipped=0.06,
    gaps_per_10m=0.8,
    gap_m=(0.10, 0.8),
    jitter_m=0.05,
    jitter_deg=0.5,
    tracking_noise_m=0.03,
    tracking_outliers=0.01,
    tracking_missing=0.02,
)
Effects.HARD = replace(
    Effects.MIDDLE, doors_shut=0.12, rooms_skipped=0.1, gaps_per_10m=1.5, gap_m=(0.10, 1.2), tracking_missing=0.05
)

EFFECTS: dict[str, tuple[str, ...]] = {
    "furniture": ("furniture_moves",),
    "doors": ("doors_shut",),
    "skipped": ("rooms_skipped",),
    "late_rooms": ("rooms_late", "late_until"),
    "range_noise": ("range_noise_m",),
    "registration_noise": ("scan_noise_m", "scan_noise_deg"),
    "gaps": ("gaps_per_10m", "gap_m"),
    "specks": ("specks",),
    "jitter": ("jitter_m", "jitter_deg"),
    "drift": ("drift_m", "drift_deg"),
    "tracking_noise": ("tracking_noise_m",),
    "tracking_outliers": ("tracking_outliers",),
    "tracking_missing": ("tracking_missing",),
}
"""The effects by name, with the fields that say how much of them there is."""


@dataclass(frozen=True)
class Streams:
    """The random streams of one robot: independent for each purpose and mission, and the same whenever they are asked for."""

    seed: int
    robot: int = 0

    def of(self, purpose: Stream, mission: int = 0) -> Generator:
        key = (self.robot, _STREAMS.index(purpose), mission)
        return np.random.default_rng(SeedSequence(self.seed, spawn_key=key))
