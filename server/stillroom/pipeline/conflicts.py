"""Conflict detection: how well each previous room was carried over (paper, section IV)."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.params import Params
from stillroom.pipeline.rooms import overlaps


@dataclass(frozen=True)
class RoomScore:
    """How well one previous room was carried over: overlap C, only previous A, only candidate B; precision C/(B+C), recall C/(A+C)."""

    id: str
    name: str
    precision: float
    recall: float
    passed: bool
    visited: bool = True


def score_rooms(
    tracked: SemanticMap, candidate: SemanticMap, visited: Collection[str], params: Params
) -> tuple[RoomScore, ...]:
    """One score for each previous room; `tracked` holds them where tracking and alignment put them in the candidate's frame.

    Exactly `params.room_overlap` fails. A room that this mission did not visit passes, if it is there.
    """
    there = {room.id: i for i, room in enumerate(candidate.rooms)}
    common = overlaps([room.polygon for room in tracked.rooms], [room.polygon for room in candidate.rooms])
    scores = []
    for i, room in enumerate(tracked.rooms):
        j = there.get(room.id)
        overlap = float(common[i, j]) if j is not None else 0.0
        precision = overlap / candidate.rooms[j].polygon.area if j is not None else 0.0
        recall = overlap / room.polygon.area
        seen = room.id in visited
        passed = (j is not None and not seen) or (precision > params.room_overlap and recall > params.room_overlap)
        scores.append(RoomScore(room.id, room.name, precision, recall, passed, seen))
    return tuple(scores)


ConflictKind = Literal[
    "room_lost",
    "room_recall",
    "room_precision",
    "divider_lost",
    "connectivity",
    "shape",
    "drift",
    "wrong_map",
    "restriction_unplaced",
]
Cause = Literal["door_closed", "wall_gap", "opening_closed", "new_passage", "moved_object", "drift", "unknown"]
Action = Literal["meta_dividers", "meta_occupancy", "take_new", "keep_previous"]


@dataclass(frozen=True)
class Proposal:
    """A map that could be in force instead. `map` is valid: it breaks no constraint."""

    id: str
    """"p1", "p2", ... within its conflict."""
    action: Action
    recommended: bool
    map: SemanticMap


@dataclass(frozen=True)
class Conflict:
    """Something about an update that a person may want to decide. The same mission gives the same ids again."""

    id: str
    kind: ConflictKind
    cause: Cause
    rooms: tuple[RoomScore, ...]
    dividers: tuple[str, ...]
    restrictions: tuple[str, ...]
    summary: str
    """A sentence for a person."""
    resolved: bool
    """Whether the map that is in force now needs no decision: the meta layer settled it."""
    proposals: tuple[Proposal, ...] = ()
