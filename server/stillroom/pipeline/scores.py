"""How well each previous room was carried over: precision and recall (paper, section IV)."""

from collections.abc import Collection
from dataclasses import dataclass

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
