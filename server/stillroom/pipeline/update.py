"""Semantic map update (paper, Figure 1): from the previous map and a mission to a new map, or back to the previous one."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Literal

from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.params import PARAMS, Params

Outcome = Literal["created", "updated", "resolved", "needs_review", "reverted", "parked"]
Row = Literal["transfer", "meta_occupancy", "meta_dividers"]
Stage = Callable[[str], AbstractContextManager[None]]
"""Opened around each stage by its name, so that a caller with a clock can time it."""


def untimed(_name: str) -> AbstractContextManager[None]:
    return nullcontext()


@dataclass(frozen=True)
class RoomScore:
    """How well one previous room was carried over: overlap C, only previous A, only candidate B; precision C/(B+C), recall C/(A+C)."""

    id: str
    name: str
    precision: float
    recall: float
    passed: bool
    visited: bool = True


@dataclass(frozen=True)
class Ablation:
    """Whether the update would have succeeded with that much of the system (cumulative; the paper's results table)."""

    transfer: bool
    meta_occupancy: bool
    meta_dividers: bool


@dataclass(frozen=True)
class MapUpdate:
    """What a mission came to. `map` is the map in force afterwards: the candidate where it was taken, else the previous one."""

    outcome: Outcome
    map: SemanticMap
    taken: bool
    succeeded_at: Row | None = None
    ablation: Ablation | None = None
    rooms: tuple[RoomScore, ...] = ()
    discovered: tuple[str, ...] = ()
    retired: Mapping[str, str] = field(default_factory=dict)
    """Ids of rooms that ended -> the room that has their space now."""
    motion: Motion | None = None
    """From the previous map's frame to the mission's, as used (None where none could be found)."""
    candidate: SemanticMap | None = None
    """The map that was judged, taken or not."""
    warnings: tuple[str, ...] = ()
    reason: str = ""
    """A sentence for a person."""


def create_semantic_map(grid: OccupancyGrid, mission_id: str, ids: Ids, params: Params = PARAMS, stage: Stage = untimed) -> MapUpdate:
    """The first mission of a map: its semantics by algorithm."""
    raise NotImplementedError


def update_map(previous: SemanticMap, mission: Mission, params: Params = PARAMS, stage: Stage = untimed) -> MapUpdate:
    """Carries the semantics of `previous` over to the mission's grid and decides whether the result is taken."""
    raise NotImplementedError
