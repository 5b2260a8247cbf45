"""Conflicts made by hand, for tests of what is done about them: the core is asked as always, and its answer changed."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.conflicts import Conflict, ConflictKind, Proposal, RoomScore
from stillroom.pipeline.update import MapUpdate, update_map

Answer = Callable[[SemanticMap, Mission, MapUpdate], MapUpdate]
"""(the map in force, the mission, what the core made of it) -> what it is taken to have answered."""


@dataclass
class Core:
    """Stands for `update_map`: gives the answer that was planned for a mission, else the real one."""

    planned: dict[str, Answer] = field(default_factory=dict)
    asked: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, previous: SemanticMap, mission: Mission, **rest: Any) -> MapUpdate:
        self.asked.append({"previous": previous, "mission": mission} | rest)
        update = update_map(previous, mission, **rest)
        answer = self.planned.get(mission.id)
        return update if answer is None else answer(previous, mission, update)


def score(room: str, recall: float = 0.41, visited: bool = True) -> RoomScore:
    return RoomScore(room, f"Room {room}", 0.97, recall, recall > 0.5, visited)


def conflict(
    key: str,
    *proposals: Proposal,
    kind: ConflictKind = "room_recall",
    rooms: tuple[str, ...] = ("r1",),
    dividers: tuple[str, ...] = (),
    restrictions: tuple[str, ...] = (),
    resolved: bool = False,
) -> Conflict:
    scores = tuple(score(room) for room in rooms)
    return Conflict(
        key, kind, "wall_gap", scores, dividers, restrictions, "59 % of Room r1 is gone.", resolved, proposals
    )


def rejected(
    *keys: str,
    scores: tuple[RoomScore, ...] = (),
    kind: ConflictKind = "room_recall",
    rooms: tuple[str, ...] = ("r1",),
    dividers: tuple[str, ...] = (),
) -> Answer:
    """The mission is not taken: each conflict proposes its map, and to keep the one in force."""

    def answer(previous: SemanticMap, _mission: Mission, update: MapUpdate) -> MapUpdate:
        proposals = Proposal("p1", "take_new", True, update.map), Proposal("p2", "keep_previous", False, previous)
        met = tuple(conflict(key, *proposals, kind=kind, rooms=rooms, dividers=dividers) for key in keys)
        failed = scores or tuple(score(room) for room in rooms)
        others = tuple(s for s in update.rooms if s.id not in {f.id for f in failed})
        return replace(
            update,
            outcome="needs_review",
            map=previous,
            taken=False,
            conflicts=met,
            rooms=(*failed, *others),
            succeeded_at=None,
            discovered=(),
        )

    return answer


def settled(key: str, change: Callable[[SemanticMap], SemanticMap], rooms: tuple[str, ...] = ("r1", "r2")) -> Answer:
    """The mission is taken with a meta layer that `change` adds, which settles a conflict."""

    def answer(_previous: SemanticMap, _mission: Mission, update: MapUpdate) -> MapUpdate:
        resolved = change(update.map)
        met = conflict(key, Proposal("p1", "meta_dividers", True, resolved), rooms=rooms, resolved=True)
        return replace(update, outcome="resolved", map=resolved, conflicts=(met,), succeeded_at="meta_dividers")

    return answer
