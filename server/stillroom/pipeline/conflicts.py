"""Conflict detection (paper, section IV): what about an update a person may want to know or decide, and why it is so."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Literal

from stillroom.maps.constraints import violations
from stillroom.maps.semantics import Divider, SemanticMap
from stillroom.pipeline.anchor import Drift, find_drift
from stillroom.pipeline.params import Params
from stillroom.pipeline.resolution import Attempt
from stillroom.pipeline.rooms import overlaps
from stillroom.pipeline.scores import RoomScore as RoomScore

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


def detect_conflicts(
    previous: SemanticMap, first: Attempt, best: Attempt, mission_id: str, taken: bool, params: Params
) -> tuple[Conflict, ...]:
    """Everything about a mission that a person may want to decide. `first` is the transfer alone, `best` what was judged."""
    candidate = best.transfer.candidate
    named = Naming(previous, mission_id)
    found = _lost_rooms(previous, first, best, taken, params, named)
    if not taken and not best.failed:
        found.append(_broken(previous, first, best, params, named))
    if taken:
        found += _lost_dividers(best, named)
        found += _shapes(best, params, named)
        found += _drifts(find_drift(candidate.rooms, params), found, candidate, named)
        found += _unplaced(previous, candidate, named)
        found += _contradicted(first, best, params, named)
    return tuple(found)


@dataclass(frozen=True)
class Naming:
    """What conflicts of one mission are called: ids that the same mission gets again, and rooms by their names."""

    previous: SemanticMap
    mission_id: str

    def id_of(self, kind: ConflictKind, subjects: Sequence[str]) -> str:
        text = "/".join((self.mission_id, kind, *sorted(subjects)))
        return f"c{self.previous.ids.prefix}{sha256(text.encode()).hexdigest()[:12]}"

    def rooms(self, ids: Sequence[str], otherwise: SemanticMap | None = None) -> str:
        """ "Kitchen", "Kitchen and Hall", "Kitchen, Hall and Bath"."""
        known = {room.id: room.name for m in (otherwise, self.previous) if m is not None for room in m.rooms}
        names = [known.get(room, room) for room in ids]
        return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def _lost_rooms(
    previous: SemanticMap, first: Attempt, best: Attempt, taken: bool, params: Params, named: Naming
) -> list[Conflict]:
    """One conflict for the failed rooms that ran into each other, with the maps that there could be instead."""
    proposals = _proposals(previous, first, best, taken, params) if first.failed else ()
    conflicts = []
    for group in _together(first):
        worst = min(group, key=lambda score: (score.recall, score.precision))
        kind: ConflictKind = "room_precision"
        if worst.recall <= params.room_overlap:
            kind = "room_lost" if worst.recall == 0 else "room_recall"
        ids = [score.id for score in group]
        resolved = taken and not best.failed & set(ids)
        cause = _cause(ids, best)
        dividers = tuple(d.id for d in previous.dividers if set(d.rooms) & set(ids))
        summary = f"{loss(worst)}." if not resolved else f"{named.rooms(ids)} {kept(ids, cause)}."
        conflicts.append(
            Conflict(named.id_of(kind, ids), kind, cause, tuple(group), dividers, (), summary, resolved, proposals)
        )
    return conflicts


def _broken(previous: SemanticMap, first: Attempt, best: Attempt, params: Params, named: Naming) -> Conflict:
    """All rooms are there, but the map would break a rule."""
    summary = "The rooms were found again, but the new map does not hold together. The previous one was kept."
    proposals = _proposals(previous, first, best, False, params)
    return Conflict(named.id_of("shape", []), "shape", "unknown", (), (), (), summary, False, proposals)


def loss(room: RoomScore) -> str:
    """What happened to a room that failed, in words."""
    if room.recall == 0:
        return f"{room.name} was not found again"
    if room.recall <= room.precision:
        return f"{1 - room.recall:.0%} of {room.name} is gone"
    return f"{room.name} ran into its surroundings, only {room.precision:.0%} of it was {room.name} before"


def kept(ids: Sequence[str], cause: Cause, would: bool = False) -> str:
    """What the meta layer did for rooms, or would do."""
    verb = "would be" if would else "was" if len(ids) == 1 else "were"
    because = {
        "wall_gap": "a wall had a gap",
        "new_passage": "there is a new way through",
        "opening_closed": "something stood in the way",
        "door_closed": "a door looked closed",
    }.get(cause, "the map had changed")
    return f"{verb} kept as before although {because}"


def _together(first: Attempt) -> list[list[RoomScore]]:
    """Failed rooms by the room of the candidate that has their space now."""
    common = overlaps([r.polygon for r in first.failed_rooms()], [r.polygon for r in first.transfer.candidate.rooms])
    groups: dict[int, list[RoomScore]] = {}
    for i, score in enumerate(score for score in first.scores if not score.passed):
        groups.setdefault(int(common[i].argmax()) if common[i].any() else -1 - i, []).append(score)
    return list(groups.values())


def _cause(rooms: Sequence[str], best: Attempt) -> Cause:
    """Told from what it took to get the rooms back."""
    candidate = best.transfer.candidate
    by_id = {d.id: d for d in candidate.dividers}
    if any(set(by_id[d].rooms) & set(rooms) for d in best.transfer.shut_dividers if d in by_id):
        return "door_closed"
    if any(o.cell == "free" for o in candidate.meta.occupancy):
        return "opening_closed"
    counts = [o.contradicted for o in candidate.meta.occupancy] + [d.contradicted for d in candidate.meta.dividers]
    if any(counts) or best.transfer.new_rooms:
        return "new_passage"
    return "wall_gap" if candidate.meta.corrects else "unknown"


def _proposals(
    previous: SemanticMap, first: Attempt, best: Attempt, taken: bool, params: Params
) -> tuple[Proposal, ...]:
    """The maps that there could be, the one that the service would choose first."""
    candidate = best.transfer.candidate
    as_it_is: tuple[Action, SemanticMap | None] = ("keep_previous", None if taken else previous)
    if taken and candidate.meta.corrects:
        as_it_is = ("meta_dividers" if candidate.meta.dividers else "meta_occupancy", candidate)
    return _choices(as_it_is, ("take_new", first.transfer.candidate if _holds(first, params) else None))


def _lost_dividers(best: Attempt, named: Naming) -> list[Conflict]:
    """Dividers that ended on nothing and are not on the map any more."""
    lost = [d for d in best.transfer.tracked.dividers if d.id in best.transfer.lost_dividers]
    conflicts = []
    for divider in lost:
        between = f" between {named.rooms(divider.rooms)}" if divider.rooms else ""
        summary = f"The divider{between} found no wall to end on and is not on the map any more."
        id_ = named.id_of("divider_lost", [divider.id])
        rooms = _scores(divider.rooms, best)
        conflicts.append(Conflict(id_, "divider_lost", "unknown", rooms, (divider.id,), (), summary, False))
    return conflicts


def _scores(rooms: Sequence[str], best: Attempt) -> tuple[RoomScore, ...]:
    return tuple(score for score in best.scores if score.id in rooms)


def _shapes(best: Attempt, params: Params, named: Naming) -> list[Conflict]:
    conflicts = []
    for score in best.scores:
        if score.visited and score.passed and min(score.precision, score.recall) < params.shape_overlap:
            less = f"{1 - score.recall:.0%} of {score.name} is gone"
            more = f"{score.name} grew: {1 - score.precision:.0%} of it is new"
            summary = f"{less if score.recall < score.precision else more}."
            id_ = named.id_of("shape", [score.id])
            conflicts.append(Conflict(id_, "shape", "unknown", (score,), (), (), summary, False))
    return conflicts


def _unplaced(previous: SemanticMap, candidate: SemanticMap, named: Naming) -> list[Conflict]:
    placed = {restriction.id for restriction in previous.restrictions if restriction.placed}
    return [
        Conflict(
            named.id_of("restriction_unplaced", [r.id]),
            "restriction_unplaced",
            "unknown",
            (),
            (),
            (r.id,),
            f"A {r.kind.replace('_', '-')} could not be placed on the new map. It is kept as it was; please draw it again.",
            False,
        )
        for r in candidate.restrictions
        if r.id in placed and not r.placed
    ]


def _contradicted(first: Attempt, best: Attempt, params: Params, named: Naming) -> list[Conflict]:
    """Corrections that mission after mission contradicts: a way that is really there. One question for all between the same rooms.

    They can be accepted as they are, or the map as it was sensed.
    """
    candidate, grid = best.transfer.candidate, best.transfer.grid
    often = [d for d in candidate.meta.dividers if d.contradicted >= params.contradicted_missions]
    sections = [o for o in candidate.meta.occupancy if o.contradicted >= params.contradicted_missions]
    if not often and not sections:
        return []
    as_sensed = first.transfer.candidate if _holds(first, params) else None
    conflicts = []
    for rooms in sorted({d.rooms for d in often}):
        between = tuple(d for d in candidate.meta.dividers if d.rooms == rooms)
        accepted = replace(
            candidate,
            dividers=(*candidate.dividers, *(Divider(d.id, d.line, made_by="user", rooms=rooms) for d in between)),
            meta=replace(candidate.meta, dividers=tuple(d for d in candidate.meta.dividers if d not in between)),
        )
        valid = not violations(accepted, grid, params.wall_reach_m)
        proposals = _choices(("meta_dividers", accepted if valid else None), ("take_new", as_sensed))
        conflicts.append(_question([d.id for d in between], rooms, between[0].since, proposals, best, named))
    for section in sections:
        beside = [r.id for r in candidate.rooms if r.polygon.distance(section.polygon) < 2 * grid.frame.resolution]
        proposals = _choices(("meta_occupancy", candidate), ("take_new", as_sensed))
        conflicts.append(_question([section.id], beside, section.since, proposals, best, named))
    return conflicts


def _holds(attempt: Attempt, params: Params) -> bool:
    return not violations(attempt.transfer.candidate, attempt.transfer.grid, params.wall_reach_m)


def _choices(*choices: tuple[Action, SemanticMap | None]) -> tuple[Proposal, ...]:
    """Proposals of the maps that there are, the first one recommended."""
    there = [(action, m) for action, m in choices if m is not None]
    return tuple(Proposal(f"p{k}", action, k == 1, m) for k, (action, m) in enumerate(there, 1))


def _question(
    corrections: Sequence[str],
    rooms: Sequence[str],
    since: str,
    proposals: tuple[Proposal, ...],
    best: Attempt,
    named: Naming,
) -> Conflict:
    between = named.rooms(rooms, best.transfer.candidate)
    summary = f"Since mission {since} the robot finds an open way where the map keeps {between} apart."
    id_ = named.id_of("connectivity", corrections)
    return Conflict(id_, "connectivity", "new_passage", _scores(rooms, best), (), (), summary, False, proposals)


def _drifts(
    drifts: Sequence[Drift], found: Sequence[Conflict], candidate: SemanticMap, named: Naming
) -> list[Conflict]:
    """Rooms against what somebody last confirmed; what this mission did to a shape is asked once."""
    asked = {score.id for conflict in found if conflict.kind == "shape" for score in conflict.rooms}
    rooms = {room.id: room.name for room in candidate.rooms}
    conflicts = []
    for drift in drifts:
        name = rooms[drift.room]
        kind: ConflictKind = "drift" if drift.slid_m else "shape"
        what = f"{1 - drift.recall:.0%} of {name} is gone, bit by bit,"
        if drift.slid_m:
            what = f"{name} has slid {100 * drift.slid_m:.0f} cm against the other rooms"
        elif drift.room in asked:
            continue
        score = RoomScore(drift.room, name, drift.precision, drift.recall, passed=True)
        summary = f"{what} since somebody last confirmed it."
        conflicts.append(Conflict(named.id_of(kind, [drift.room]), kind, "drift", (score,), (), (), summary, False))
    return conflicts


def wrong_map(previous: SemanticMap, mission_id: str, reason: str) -> Conflict:
    """A mission that does not show this floor, or not as it is."""
    id_ = Naming(previous, mission_id).id_of("wrong_map", [])
    return Conflict(id_, "wrong_map", "unknown", (), (), (), reason, False)
