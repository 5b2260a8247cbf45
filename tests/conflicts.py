"""Conflicts made by hand, for tests of what is done about them: the core is asked as always, and its answer changed."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from httpx2 import Response

from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.conflicts import Cause, Conflict, ConflictKind, Proposal, RoomScore
from stillroom.pipeline.update import MapUpdate, update_map
from stillroom.service.access import OPERATOR
from stillroom.service.events import events_after
from tests.homes import Image, home

if TYPE_CHECKING:
    from tests.conftest import RobotCaller, Service

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
    cause: Cause = "drift" if kind == "drift" else "wall_gap"
    return Conflict(key, kind, cause, scores, dividers, restrictions, "59 % of Room r1 is gone.", resolved, proposals)


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


# -- what the service says about them ------------------------------------------------------------------------------


def send(robot: "RobotCaller", mission: str, image: Image | None = None, **meta: Any) -> dict[str, Any]:
    """The home as it was, a cell further to the right, or another image of it."""
    answer = robot.upload(mission, home(shift=(1, 0)) if image is None else image, **meta)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def listed(robot: "RobotCaller", state: str | None = None) -> dict[str, str]:
    """Ids -> states."""
    query = "" if state is None else f"?state={state}"
    answer = robot.get(f"{robot.path()}/conflicts{query}")
    assert answer.status_code == 200, answer.text
    return {found["id"]: found["state"] for found in answer.json()["items"]}


def shown(robot: "RobotCaller", key: str) -> dict[str, Any]:
    answer = robot.get(f"{robot.path()}/conflicts/{key}")
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def told(service: "Service") -> list[dict[str, Any]]:
    """All events, oldest first."""
    return [event.model_dump() for _, event in events_after(service.database, OPERATOR, 0, None, None)]


def expect(answer: Response, status: int = 200) -> dict[str, Any]:
    assert answer.status_code == status, answer.text
    body: dict[str, Any] = answer.json()
    return body
