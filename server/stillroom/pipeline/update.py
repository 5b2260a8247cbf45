"""Semantic map update (paper, Figure 1): from the previous map and a mission to a new map, or back to the previous one."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from typing import Literal

import shapely

from stillroom.maps.constraints import Violation, violations
from stillroom.maps.geometry import Line, Points, as_points
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.meta import MapMeta
from stillroom.maps.mission import Mission
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Divider, Ids, SemanticMap
from stillroom.pipeline.adoption import RobotSemantics, adopt_map
from stillroom.pipeline.alignment import align
from stillroom.pipeline.conflicts import Conflict, Proposal, detect_conflicts, loss, wrong_map
from stillroom.pipeline.corrections import name_corrections, restore_dividers
from stillroom.pipeline.declined import carry_declined, permitted
from stillroom.pipeline.discovery import Discovery, discover
from stillroom.pipeline.doors import remember_doors
from stillroom.pipeline.ending import ended, withered, without
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.plausibility import Plausibility, plausibility
from stillroom.pipeline.registration import Registration, register
from stillroom.pipeline.resolution import Attempt, resolve_conflicts, settle
from stillroom.pipeline.resolution import ResolverName as ResolverName
from stillroom.pipeline.restrictions import carry_restrictions
from stillroom.pipeline.scores import RoomScore, score_rooms
from stillroom.pipeline.transfer import Transfer, track, transfer_semantics

Outcome = Literal["created", "updated", "resolved", "needs_review", "reverted", "parked"]
Row = Literal["transfer", "meta_occupancy", "meta_dividers"]
Carried = Callable[[MapMeta, Sequence[Divider]], Attempt]
"""A transfer with that meta layer and those new dividers."""
ROWS: tuple[Row, ...] = ("transfer", "meta_occupancy", "meta_dividers")
RESOLVERS: tuple[ResolverName, ...] = ("meta_occupancy", "meta_dividers")
"""In their order; a shorter tuple is one of the paper's ablation rows."""
Stage = Callable[[str], AbstractContextManager[None]]
"""Opened around each stage by its name, so that a caller with a clock can time it."""


def untimed(_name: str) -> AbstractContextManager[None]:
    return nullcontext()


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
    reason: str
    """A sentence for a person."""
    succeeded_at: Row | None = None
    ablation: Ablation | None = None
    rooms: tuple[RoomScore, ...] = ()
    conflicts: tuple[Conflict, ...] = ()
    discovered: tuple[str, ...] = ()
    retired: Mapping[str, str | None] = field(default_factory=dict)
    """Ids of rooms that ended -> the room that has their space now, if any."""
    motion: Motion | None = None
    """From the previous map's frame to the mission's, as used (None where none could be found)."""
    candidate: SemanticMap | None = None
    """The map that was judged, taken or not."""
    warnings: tuple[str, ...] = ()


def create_semantic_map(
    grid: OccupancyGrid,
    mission_id: str,
    ids: Ids,
    params: Params = PARAMS,
    stage: Stage = untimed,
    semantics: RobotSemantics | None = None,
) -> MapUpdate:
    """The first mission of a map: its semantics from `semantics`, what the robot's own app has, else by algorithm."""
    with stage("create"):
        created = adopt_map(grid, semantics, mission_id, ids, params)
    count = len(created.rooms)
    adopted = semantics is not None and semantics.has_rooms
    reason = f"The first map: {count} room{'s' * (count != 1)} {'as the robot has them' if adopted else 'found'}."
    return MapUpdate("created", created, taken=True, reason=reason, candidate=created)


def update_map(
    previous: SemanticMap,
    mission: Mission,
    params: Params = PARAMS,
    stage: Stage = untimed,
    trust_registration: bool = False,
    resolvers: Sequence[ResolverName] = RESOLVERS,
    annotations: Sequence[Line] = (),
) -> MapUpdate:
    """Carries the semantics of `previous` over to the mission's grid and decides whether the result is taken.

    `trust_registration`: somebody knows that it is this floor, so the likeliest pose counts even where registration is not sure.
    `annotations`: dividers that the owner drew for this mission, in its frame.
    """
    with stage("align"):
        if mission.motion is None:
            registered = register(previous, mission.grid, params)
            if not (trust_registration or registered.found(params)):
                return _parked(previous, mission, registered)
            motion = registered.motion
        else:
            motion = align(previous, mission.motion, mission.grid, params.alignment_reach_m, params).motion
    with stage("track"):
        tracked = track(previous, motion, mission.grid.frame)
        # what this mission did not see may lie beyond its grid
        grid = mission.grid.covering(_corners(tracked))
        shown = plausibility(tracked, grid, params)
        if shown.other_floor(params) or shown.wrecked(params):
            return _implausible(previous, mission, shown, trust_registration, params)

    declined = carry_declined(previous.meta.declined, motion)

    owners = tuple(Divider("", line, made_by="user") for line in annotations)

    def carried(meta: MapMeta, discovered: Sequence[Divider] = ()) -> Attempt:
        drawn_in = (*owners, *discovered)
        transfer = transfer_semantics(tracked, grid, mission.id, params, permitted(meta, declined), drawn_in)
        scores = score_rooms(tracked, transfer.candidate, transfer.visited, params, transfer.common)
        return Attempt(transfer, scores, grid)

    def whole(attempt: Attempt) -> Attempt:
        """With the restrictions, and the places where a person wants no correction."""
        made = attempt.transfer.candidate
        restrictions = carry_restrictions(previous.restrictions, motion, previous.rooms, made.rooms, mission.grid.frame)
        return _with_candidate(
            attempt, replace(made, restrictions=restrictions, meta=replace(made.meta, declined=declined))
        )

    with stage("transfer"):
        first = carried(MapMeta.EMPTY)
    with stage("resolve"):
        attempts = resolve_conflicts(first, carried, resolvers, params)
        best = settle(next(reversed(attempts.values()), first), carried, resolvers, params)
    with stage("discover"):
        if found := discover(first, declined, params):
            best = _opened(found, best, carried, resolvers, params)
    with stage("verify"):
        best = replace(best, transfer=remember_doors(restore_dividers(best.transfer), params))
        best = whole(_with_candidate(best, name_corrections(best.transfer.candidate, tracked.meta, mission)))
        broken = violations(best.transfer.candidate, best.transfer.grid, params.wall_reach_m)
    with stage("conflicts"):
        conflicts = detect_conflicts(previous, whole(first), best, mission.id, is_valid(best, broken), params)
    update = decide(previous, motion, best, _ablation(first, attempts), broken, conflicts)
    gone = withered(previous, best.failed, params)
    if not gone or len(gone) == len(previous.rooms):
        return update
    smaller = without(previous, gone)
    again = update_map(smaller, mission, params, stage, trust_registration, resolvers, annotations)
    return _with_ended(previous, again) if again.taken else update


def _with_ended(previous: SemanticMap, update: MapUpdate) -> MapUpdate:
    """The update of a map without rooms that withered, which says so."""
    assert update.motion is not None  # it was taken
    gone = ended(previous, update.map, update.motion)
    names = {room.id: room.name for room in (*previous.rooms, *update.map.rooms)}
    lines = [
        f"{names[room]} had become less than a room and was not found again."
        + (f" Its floor belongs to {names[survivor]}." if survivor else "")
        for room, survivor in gone.items()
        if room not in update.retired
    ]
    return replace(update, retired=gone | dict(update.retired), warnings=(*lines, *update.warnings))


def _with_candidate(attempt: Attempt, candidate: SemanticMap) -> Attempt:
    return replace(attempt, transfer=replace(attempt.transfer, candidate=candidate))


def _opened(
    found: Discovery, resolved: Attempt, carried: Carried, resolvers: Sequence[ResolverName], params: Params
) -> Attempt:
    """The mission with what was discovered, resolved anew; where that is worse, without."""

    def retry(meta: MapMeta) -> Attempt:
        return carried(meta, found.dividers)

    corrections = found.corrections if "meta_occupancy" in resolvers else ()
    opened = retry(MapMeta(corrections))
    attempts = resolve_conflicts(opened, retry, resolvers, params)
    best = settle(next(reversed(attempts.values()), opened), retry, resolvers, params, corrections)
    return best if best.failed <= resolved.failed else resolved


def _ablation(first: Attempt, attempts: Mapping[ResolverName, Attempt]) -> Ablation:
    """By the rooms that the mission visited; the others do not count."""

    def carried(attempt: Attempt | None) -> bool:
        return attempt is not None and all(score.passed for score in attempt.scores if score.visited)

    transfer = carried(first)
    occupancy = transfer or carried(attempts.get("meta_occupancy"))
    return Ablation(transfer, occupancy, occupancy or carried(attempts.get("meta_dividers")))


def _corners(tracked: SemanticMap) -> Points:
    """Every corner of a room, shape (n, 2)."""
    return as_points(shapely.get_coordinates([room.polygon for room in tracked.rooms]))


def _parked(previous: SemanticMap, mission: Mission, registered: Registration) -> MapUpdate:
    sure = f"{registered.share:.0%} of its walls fit at best"
    if registered.rival > PARAMS.registration_margin * registered.share:
        sure += ", in more than one place"
    reason = f"The robot did not say how its map moved, and this does not look like this floor ({sure})."
    conflict = wrong_map(previous, mission.id, reason)
    return MapUpdate("parked", previous, taken=False, reason=reason, conflicts=(conflict,))


def _implausible(
    previous: SemanticMap, mission: Mission, shown: Plausibility, placed: bool, params: Params
) -> MapUpdate:
    """Another floor waits for a person to say which, unless a person has said so already; a wrecked grid is no map."""
    other = shown.other_floor(params)
    if other:
        reason = f"This does not look like this floor: {shown.walls_found:.0%} of its walls were found again."
    else:
        reason = f"The previous map was kept: {shown.walls_twice:.0%} of the walls are on the new map twice."
    conflict = wrong_map(previous, mission.id, reason)
    outcome: Outcome = "parked" if other and not placed else "reverted"
    return MapUpdate(outcome, previous, taken=False, reason=reason, conflicts=(conflict,))


def decide(
    previous: SemanticMap,
    motion: Motion,
    best: Attempt,
    ablation: Ablation,
    broken: Sequence[Violation],
    conflicts: Sequence[Conflict],
) -> MapUpdate:
    """Update or revert: the candidate is taken where every previous room was carried over and every constraint holds."""
    transfer, rooms = best.transfer, best.scores
    taken = is_valid(best, broken)
    choices = [proposal for conflict in conflicts for proposal in conflict.proposals]
    return MapUpdate(
        outcome=_outcome(taken, ablation.transfer, transfer.candidate.meta, choices),
        map=transfer.candidate if taken else previous,
        taken=taken,
        reason=_reason(rooms, broken, transfer),
        succeeded_at=next((row for row in ROWS if getattr(ablation, row)), None) if taken else None,
        ablation=ablation,
        rooms=rooms,
        conflicts=tuple(conflicts),
        discovered=transfer.new_rooms if taken else (),
        motion=motion,
        candidate=transfer.candidate,
        warnings=_warnings(previous, transfer, broken),
    )


def is_valid(best: Attempt, broken: Sequence[Violation]) -> bool:
    return not best.failed and not broken


def _outcome(taken: bool, by_transfer: bool, meta: MapMeta, choices: Sequence[Proposal]) -> Outcome:
    if taken:
        return "resolved" if meta.corrects and not by_transfer else "updated"
    return "needs_review" if any(choice.action != "keep_previous" for choice in choices) else "reverted"


def _reason(rooms: Sequence[RoomScore], broken: Sequence[Violation], transfer: Transfer) -> str:
    lost = [room for room in rooms if not room.passed]
    if lost:
        said = ", ".join(loss(room) for room in lost)
        return f"The previous map was kept: {said}."
    if broken:
        return f"The previous map was kept: the new one would break a rule ({broken[0].constraint})."
    new = len(transfer.new_rooms)
    found = f" {new} new room{'s' * (new != 1)} found." if new else ""
    return "All rooms were carried over." + found


def _warnings(previous: SemanticMap, transfer: Transfer, broken: Sequence[Violation]) -> tuple[str, ...]:
    named = {room.id: room.name for room in previous.rooms}

    def between(divider_id: str) -> str:
        divider = previous.divider(divider_id)
        rooms = [named[room] for room in divider.rooms if room in named] if divider else []
        return f"The divider {divider_id}" + (f" between {' and '.join(rooms)}" if rooms else "")

    lines = [f"{between(d)} found no wall to end on." for d in transfer.lost_dividers]
    lines += [f"{between(d)} looks shut; the rooms on both sides were kept." for d in transfer.shut_dividers]
    lines += [
        f"The {r.kind.replace('_', '-')} {r.id} could not be placed on the new map; it is kept as it was."
        for r in transfer.candidate.restrictions
        if not r.placed
    ]
    lines += [f"{v.feature}: {v.constraint}, but {v.detail}." for v in broken]
    return tuple(lines)
