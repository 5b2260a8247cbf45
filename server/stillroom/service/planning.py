"""What a decision about a conflict comes to, before anything is changed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property

from stillroom.documents.conflicts import DecisionRequest
from stillroom.documents.grids import read_grid
from stillroom.documents.missions import stored_meta
from stillroom.documents.stored import decode_map, decode_motion, encode_motion
from stillroom.errors import Fault, InvalidInput, ProposalOutdated
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.decisions import annotated, confirm, corrections_of, joined, make_doors, own, refuse
from stillroom.pipeline.ending import ended
from stillroom.pipeline.questions import is_discovery, is_door, neighbour_of
from stillroom.pipeline.update import MapUpdate, ResolverName
from stillroom.service import sightings
from stillroom.service.conflicts import find_conflict
from stillroom.service.fleet.variants import variant_for
from stillroom.service.gathering import Gathered, Timings, carry_over, current_map, gather
from stillroom.service.maps import find_in_force, reading_of
from stillroom.service.versions import ids_of
from stillroom.store import clock, conflicts, maps, missions
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import ConflictRow, Json, MapRow, MissionRow, ProposalRow, VersionRow


@dataclass(frozen=True)
class Means:
    """What it takes to work a decision out."""

    database: Database
    grids: GridStore
    resolvers: Sequence[ResolverName]

    def carry_over(self, gathered: Gathered, previous: SemanticMap | None, timings: Timings) -> MapUpdate:
        """As the missions of that home are processed now."""
        with self.database.read() as tx:
            variant = variant_for(tx, gathered.of.robot_id, self.resolvers)
        return carry_over(gathered, previous, self.grids, timings, variant.resolvers, variant.params)[0]


@dataclass(frozen=True)
class Asked:
    """A conflict, as it is asked about now."""

    of: MapRow
    head: VersionRow
    conflict: ConflictRow
    mission: MissionRow
    """The newest that met it."""
    proposals: Sequence[ProposalRow]
    now: datetime

    @property
    def rooms(self) -> list[str]:
        return [room["id"] for room in self.conflict.rooms]

    @property
    def was_taken(self) -> bool:
        """Whether it is about the map in force: the mission's map was taken, with what the meta layer settled or without."""
        return self.conflict.resolved or self.mission.version != self.conflict.base_version

    @cached_property
    def current(self) -> SemanticMap:
        return current_map(self.of, self.head, self.now)

    def proposal(self, name: str | None) -> ProposalRow:
        """The one of that name, or the recommended one. Raises InvalidInput."""
        if not self.proposals:
            detail = "There is nothing to accept here: say which floor the mission belongs to, or reject."
            raise InvalidInput(detail, (Fault("/response", "nothing is proposed"),))
        wanted = [p for p in self.proposals if (p.recommended if name is None else p.name == name)]
        if not wanted:
            raise InvalidInput(f"There is no proposal {name}.", (Fault("/proposal", "no such proposal"),))
        return wanted[0]


@dataclass(frozen=True)
class Under:
    """The grid that a version lies on, and where its frame comes from."""

    mission: str | None
    grid: str
    frame_from: int
    motion: Json | None = None


@dataclass(frozen=True)
class Plan:
    """`map` would be in force. Without `under` that is the one in force now, and there is no new version."""

    map: SemanticMap
    under: Under | None = None
    retired: Mapping[str, str | None] = field(default_factory=dict)
    met: sightings.Met | None = None
    """What the mission meets that was run again."""
    settles_mission: bool = False
    """Whether nothing else is open about a mission that was not taken."""


def look_up(database: Database, robot_id: str, map_name: str, key: str) -> Asked:
    """Raises NotFound."""
    with database.read() as tx:
        of, row = find_conflict(tx, robot_id, map_name, key)
        _, number = find_in_force(tx, robot_id, map_name)
        head = maps.version_at(tx, of.id, number)
        assert head is not None
        proposals = conflicts.proposals(tx, [row.sighting_id])[row.sighting_id]
        return Asked(of, head, row, missions.get(tx, row.mission_id), proposals, clock.now(tx))


def plan(means: Means, asked: Asked, made_by: str, request: DecisionRequest) -> Plan:
    """Raises InvalidInput where the decision can't be made, ProposalOutdated where it can't be made any more."""
    if request.dividers and request.response != "annotate":
        raise InvalidInput("Lines are for annotate.", (Fault("/dividers", "only with the response annotate"),))
    if request.proposal is not None and request.response != "accept":
        asked.proposal(request.proposal)
    match request.response:
        case "accept":
            return _accepted(means, asked, asked.proposal(request.proposal))
        case "annotate":
            return _annotated(means, asked, made_by, request)
        case "reject":
            return _refused(means, asked, None)
        case "temporary":
            return _refused(means, asked, (asked.now + sightings.ANSWER_WITHIN).isoformat())


def _accepted(means: Means, asked: Asked, proposal: ProposalRow) -> Plan:
    current, rooms = asked.current, asked.rooms
    here = _on_head(asked)
    takes_new = proposal.action == "take_new"
    if is_discovery(asked.conflict):
        return Plan(confirm(current, rooms), here) if takes_new else _joined(asked, None)
    if is_door(asked.conflict) and asked.was_taken:
        return Plan(confirm(make_doors(current, asked.conflict.dividers), rooms), here)
    contradicted = asked.conflict.kind == "connectivity" and asked.was_taken
    if proposal.action == "keep_previous" or (
        takes_new and asked.was_taken and not (asked.conflict.resolved or contradicted)
    ):
        return Plan(confirm(current, rooms), here)
    if not asked.was_taken:
        return _brought_into_force(means, asked, proposal)
    grid, corrections = _grid_of_head(means, asked), corrections_of(current, rooms)
    if takes_new:
        decided = refuse(current, corrections, grid, here.mission or "")
        return Plan(confirm(decided.map, rooms), here, decided.retired)
    return Plan(confirm(own(current, corrections, grid), rooms), here)


def _brought_into_force(means: Means, asked: Asked, proposal: ProposalRow) -> Plan:
    """The map that was proposed from a mission that was not taken."""
    m, motion = _proposed(means, asked, proposal)
    grid = read_grid(means.grids.get(asked.mission.grid), stored_meta(asked.mission.meta).reading())
    owned = confirm(own(m, corrections_of(m, asked.rooms), grid), asked.rooms)
    under = Under(asked.mission.key, asked.mission.grid, asked.head.number, encode_motion(motion))
    return Plan(owned, under, ended(asked.current, owned, motion or IDENTITY), settles_mission=True)


def _proposed(means: Means, asked: Asked, proposal: ProposalRow) -> tuple[SemanticMap, Motion | None]:
    """The map as it was stored; where the map in force has changed since, as the mission would come out now."""
    if asked.head.number == asked.conflict.base_version:
        with means.database.read() as tx:
            document, _ = conflicts.proposed_map(tx, proposal.sighting_id, proposal.name)
        return decode_map(document, ids_of(asked.of)), decode_motion(asked.conflict.motion)
    gathered = gather(means.database, asked.mission.id)
    update = means.carry_over(gathered, gathered.previous, Timings())
    found = _same_proposal(update, asked, proposal)
    if found is None:
        raise ProposalOutdated(
            f"The map has changed since mission {asked.mission.key}, and what was proposed does not fit it any more: {update.reason}"
        )
    return found, update.motion


def _same_proposal(update: MapUpdate, asked: Asked, proposal: ProposalRow) -> SemanticMap | None:
    about = [c for c in update.conflicts if sightings.place_of(c) == asked.conflict.place]
    about += [c for c in update.conflicts if {room.id for room in c.rooms} & set(asked.rooms)]
    again = (p.map for c in about for p in c.proposals if p.action == proposal.action)
    return next(again, update.map if update.taken else None)


def _annotated(means: Means, asked: Asked, made_by: str, request: DecisionRequest) -> Plan:
    """The mission run again, with the owner's lines as dividers."""
    if not request.dividers:
        raise InvalidInput("Draw at least one line.", (Fault("/dividers", "missing"),))
    gathered = gather(means.database, asked.mission.id)
    previous = gathered.previous
    assert previous is not None
    without = means.carry_over(gathered, previous, Timings())
    if without.motion is None:
        raise InvalidInput(f"Lines don't help here. {without.reason}", (Fault("/response", "nothing to draw on"),))
    drawn = annotated(previous, request.dividers, without.motion)
    update = means.carry_over(gathered, drawn, Timings())
    _check_lines(update, [divider.id for divider in drawn.dividers[len(previous.dividers) :]], request)
    if not update.taken:
        raise InvalidInput(
            f"With these lines the map is still not valid. {update.reason}", (Fault("/dividers", update.reason),)
        )
    under = Under(asked.mission.key, asked.mission.grid, asked.head.number, encode_motion(update.motion))
    confirmed = replace(update, map=confirm(update.map, asked.rooms))
    met = sightings.meet(asked.of, asked.mission, made_by, previous, _without_answered(confirmed, asked))
    retired = ended(previous, confirmed.map, update.motion or IDENTITY)
    return Plan(confirmed.map, under, retired, met, settles_mission=True)


def _without_answered(update: MapUpdate, asked: Asked) -> MapUpdate:
    """Without what would be asked about the rooms that a person has just looked at."""
    conflicts = (c for c in update.conflicts if c.resolved or not {room.id for room in c.rooms} & set(asked.rooms))
    return replace(update, conflicts=tuple(conflicts))


def _check_lines(update: MapUpdate, names: Sequence[str], request: DecisionRequest) -> None:
    """Raises InvalidInput for lines that found no wall to end on."""
    m = update.map if update.taken else update.candidate
    adrift = [k for k, name in enumerate(names) if m is None or m.divider(name) is None]
    if m is not None and adrift:
        faults = []
        for k in adrift:
            (x0, y0), (x1, y1) = request.dividers[k]
            faults.append(
                Fault(f"/dividers/{k}", f"The line from ({x0:.2f}, {y0:.2f}) to ({x1:.2f}, {y1:.2f}) ends in mid-air.")
            )
        raise InvalidInput(faults[0].detail, tuple(faults))


def _joined(asked: Asked, until: str | None) -> Plan:
    """What was found is part of its neighbour."""
    current = asked.current
    part = next((room for room in current.rooms if room.id in asked.rooms), None)
    whole = None if part is None else neighbour_of(part, current)
    if part is None or whole is None:
        return Plan(current)
    decided = joined(current, part.id, whole.id, until)
    return Plan(confirm(decided.map, [whole.id]), _on_head(asked), decided.retired)


def _refused(means: Means, asked: Asked, until: str | None) -> Plan:
    """Without the corrections that settled it. An open one leaves the map as it is."""
    current = asked.current
    if is_discovery(asked.conflict):
        return _joined(asked, until)
    corrections = corrections_of(current, asked.rooms)
    if not asked.conflict.resolved or not corrections.corrects:
        return Plan(current)
    here = _on_head(asked)
    decided = refuse(current, corrections, _grid_of_head(means, asked), here.mission or "", until)
    return Plan(decided.map, here, decided.retired)


def _on_head(asked: Asked) -> Under:
    return Under(asked.head.mission, asked.head.grid, asked.head.number)


def _grid_of_head(means: Means, asked: Asked) -> OccupancyGrid:
    return read_grid(means.grids.get(asked.head.grid), reading_of(means.database, asked.of, asked.head))
