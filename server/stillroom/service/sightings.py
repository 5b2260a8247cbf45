"""What a mission found in conflict with the map is kept: as new conflicts, or as those that it met again.

A conflict that a later mission meets again is the same one: nobody is asked twice. One that it does not meet although it saw
the rooms has become pointless.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from hashlib import sha256

from stillroom.documents.stored import encode_ids, encode_map, encode_motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.conflicts import Conflict, Proposal
from stillroom.pipeline.questions import is_discovery, is_door
from stillroom.pipeline.update import MapUpdate
from stillroom.service.quiet import is_quiet
from stillroom.store import conflicts, maps
from stillroom.store.conflicts import Ending, NewConflict, NewProposal, NewSighting
from stillroom.store.database import Transaction
from stillroom.store.events import Happened
from stillroom.store.rows import ConflictRow, Json, MapRow, MissionRow

ANSWER_WITHIN = timedelta(days=7)
"""After this the default answer takes effect; so long nobody is asked again about what was called temporary."""


@dataclass(frozen=True)
class Found:
    """A conflict, encoded before any lock is taken."""

    conflict: Conflict
    place: str
    proposals: Sequence[NewProposal]


@dataclass(frozen=True)
class Met:
    """A mission that was not late, and all that it met."""

    of: MapRow
    mission: MissionRow
    made_by: str
    previous: SemanticMap
    update: MapUpdate
    motion: Json | None
    found: Sequence[Found]


def meet(of: MapRow, mission: MissionRow, made_by: str, previous: SemanticMap, update: MapUpdate) -> Met:
    """`of`: with the version in force that `previous` is."""
    found = [
        Found(conflict, place_of(conflict), _proposals(conflict, previous, update)) for conflict in update.conflicts
    ]
    return Met(of, mission, made_by, previous, update, encode_motion(update.motion), found)


def place_of(conflict: Conflict) -> str:
    """Equal for conflicts about the same: kind, rooms, dividers and restrictions."""
    rooms = (room.id for room in conflict.rooms)
    about = [conflict.kind, *(sorted(ids) for ids in (rooms, conflict.dividers, conflict.restrictions))]
    return sha256(json.dumps(about).encode()).hexdigest()


def changes(proposed: SemanticMap, previous: SemanticMap) -> SemanticMap:
    """A map of nothing but what a proposal adds: its meta layer, and dividers that were not there or were of another kind."""
    before = {(divider.id, divider.kind) for divider in previous.dividers}
    dividers = tuple(divider for divider in proposed.dividers if (divider.id, divider.kind) not in before)
    return SemanticMap(proposed.frame, dividers=dividers, meta=proposed.meta)


def keep(tx: Transaction, met: Met, version: int | None, now: datetime) -> list[Happened]:
    """Opens, folds and supersedes; tells what was opened and what ended. The lane must be locked.

    `version`: the one in force after the mission.
    """
    standing = conflicts.standing(tx, met.of.id)
    put_off = conflicts.put_off(tx, met.of.id, now - ANSWER_WITHIN) if met.found else ()
    seen: set[int] = set()
    happened: list[Happened] = []
    for found in met.found:
        conflict_id = _met_before(found, standing, put_off)
        if conflict_id is None:
            told = conflicts.last_told(tx, met.of.id, found.place, found.conflict.resolved)
            quiet = is_quiet(found.conflict.rooms, told, now)
            conflict_id = _open(tx, met.of, found, quiet, now)
            if conflict_id is not None:
                state = "resolved_automatically" if found.conflict.resolved else "open"
                kind, data = _event(found.conflict.id, met, version, state)
                happened.append((kind, data | {"quiet": quiet}))
        if conflict_id is not None and conflict_id not in seen:
            seen.add(conflict_id)
            conflicts.add_sighting(tx, _sighting(conflict_id, found.conflict, met), found.proposals)
    maps.reserve_ids(tx, met.of.id, [proposal.used_ids for found in met.found for proposal in found.proposals])
    for conflict in standing:
        if conflict.id not in seen and _is_pointless(conflict, met):
            ending = Ending("superseded", met.made_by, version, mission_id=met.mission.id)
            conflicts.end(tx, conflict.id, ending, now)
            happened.append(_event(conflict.key, met, version, ending.state))
    return happened


def _met_before(found: Found, standing: Sequence[ConflictRow], put_off: Sequence[ConflictRow]) -> int | None:
    same = (row.id for row in standing if row.place == found.place and row.resolved == found.conflict.resolved)
    return next(same, next((row.id for row in put_off if row.place == found.place), None))


def _open(tx: Transaction, of: MapRow, found: Found, quiet: bool, now: datetime) -> int | None:
    conflict = found.conflict
    due_at = None if conflict.resolved else now + ANSWER_WITHIN
    return conflicts.add(
        tx, NewConflict(of.id, conflict.id, conflict.kind, found.place, conflict.resolved, now, due_at, quiet)
    )


def _sighting(conflict_id: int, conflict: Conflict, met: Met) -> NewSighting:
    assert met.of.head is not None
    return NewSighting(
        conflict_id=conflict_id,
        mission_id=met.mission.id,
        cause=conflict.cause,
        summary=conflict.summary,
        rooms=[vars(score) for score in conflict.rooms],
        dividers=conflict.dividers,
        restrictions=conflict.restrictions,
        base_version=met.of.head,
        motion=met.motion,
    )


def _proposals(conflict: Conflict, previous: SemanticMap, update: MapUpdate) -> list[NewProposal]:
    """What can be accepted. Where the core proposes nothing, that is how things are; which floor it is, nobody can guess."""
    as_it_is = Proposal("p1", "take_new" if update.taken else "keep_previous", True, update.map)
    proposals = conflict.proposals or (() if update.outcome == "parked" else (as_it_is,))
    return [
        NewProposal(
            name=proposal.id,
            action=proposal.action,
            recommended=proposal.recommended,
            changes=encode_map(changes(proposal.map, previous)),
            document=encode_map(proposal.map),
            used_ids=encode_ids(proposal.map.ids),
        )
        for proposal in proposals
    ]


def _is_pointless(conflict: ConflictRow, met: Met) -> bool:
    """Whether a mission that did not meet it again says that it is over."""
    update = met.update
    if update.outcome == "parked" or conflict.kind == "wrong_map":
        return False
    if is_discovery(conflict):
        found = (update.map.room(room["id"]) for room in conflict.rooms)
        return all(room is None or room.named_by == "user" for room in found)
    if is_door(conflict):
        kinds = {d.kind for d in update.map.dividers if d.id in conflict.dividers}
        return "open" not in kinds
    if conflict.resolved:
        return update.taken  # the corrections that settled it are gone
    match conflict.kind:
        # These are about the map in force: no later mission can show again what is not there any more.
        case "divider_lost":
            return update.taken and any(update.map.divider(divider) is not None for divider in conflict.dividers)
        case "restriction_unplaced":
            unplaced = {restriction.id for restriction in update.map.restrictions if not restriction.placed}
            return update.taken and not unplaced & set(conflict.restrictions)
        case "shape":
            return update.taken and all(update.map.room(room["id"]) is None for room in conflict.rooms)
    return _came_through(conflict, met)


def _came_through(conflict: ConflictRow, met: Met) -> bool:
    """Whether the mission saw all its rooms, and each was carried over or is asked about otherwise."""
    scores = {score.id: score for score in met.update.rooms}
    asked = {room.id for found in met.update.conflicts for room in found.rooms}
    rooms = _rooms_of(conflict, met.previous)
    if not rooms:
        return met.update.taken
    seen = (scores[room] for room in rooms if room in scores)
    return all(score.visited and (score.passed or score.id in asked) for score in seen)


def _rooms_of(conflict: ConflictRow, previous: SemanticMap) -> set[str]:
    beside = (divider.rooms for divider in previous.dividers if divider.id in conflict.dividers)
    return {room["id"] for room in conflict.rooms}.union(*beside)


def _event(key: str, met: Met, version: int | None, state: str) -> Happened:
    return "conflict", {"conflict": key, "state": state, "mission": met.mission.key, "version": version}
