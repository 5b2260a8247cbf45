"""People decide conflicts: accept, refuse, draw it themselves, or put it off. The same again is the same decision.

Nothing is held while it is worked out what a decision comes to. It is committed only if the map and the question are still the
same; else it is worked out anew from what they are by then.
"""

from contextlib import suppress
from datetime import UTC, datetime

from stillroom.documents import api
from stillroom.documents.conflicts import ConflictDocument, DecisionRequest
from stillroom.documents.stored import decode_map
from stillroom.errors import AlreadyDecided, Fault, InvalidInput, NotFound, ProposalOutdated, StillroomError
from stillroom.service import sightings
from stillroom.service.access import Principal, signature
from stillroom.service.conflicts import conflict_by_key, documents
from stillroom.service.maps import document_fields, find_map, map_url
from stillroom.service.planning import Asked, Means, Plan, Under, look_up, plan
from stillroom.service.versions import new_version
from stillroom.store import clock, conflicts, events, lanes, maps
from stillroom.store.conflicts import Ending
from stillroom.store.database import Database, Transaction
from stillroom.store.events import Happened
from stillroom.store.rows import ConflictRow, MapRow, ProposalRow, VersionRow

STATES = {"accept": "accepted", "reject": "rejected", "temporary": "rejected", "annotate": "annotated"}
AT_ONCE = 100
"""So many questions are answered by one call, and so many deadlines looked at in one go."""


def decide(
    means: Means, caller: Principal, robot_id: str, map_name: str, key: str, request: DecisionRequest
) -> ConflictDocument:
    """Raises NotFound, InvalidInput, ProposalOutdated, and AlreadyDecided where it ended otherwise."""
    while True:
        asked = look_up(means.database, robot_id, map_name, key)
        if asked.conflict.decided_by is not None:
            _check_same(asked, request)
            break
        made = plan(means, asked, signature(caller), request)
        if _commit(means.database, asked, made, signature(caller), request):
            break
    return conflict_by_key(means.database, robot_id, map_name, key)


def preview(
    means: Means, caller: Principal, robot_id: str, map_name: str, key: str, request: DecisionRequest
) -> api.EditPreview:
    """The map that would be in force after that decision. Raises as `decide` does."""
    asked = look_up(means.database, robot_id, map_name, key)
    if asked.conflict.decided_by is not None:
        raise _already(asked.conflict)
    made = plan(means, asked, signature(caller), request)
    problems = [
        api.EditProblem(code="room-ended", severity="warning", feature=room, message=_end(asked, room, into), fix=None)
        for room, into in made.retired.items()
    ]
    fields = _fields(asked, made, signature(caller)) | {"problems": problems, "made": []}
    return api.EditPreview.model_validate(fields)


def preview_proposal(
    means: Means, caller: Principal, robot_id: str, map_name: str, key: str, name: str
) -> api.MapDocument:
    """The map that would be in force if it were accepted; of a conflict that ended, the map that was proposed. Raises NotFound."""
    asked = look_up(means.database, robot_id, map_name, key)
    proposal = next((row for row in asked.proposals if row.name == name), None)
    if proposal is None:
        raise NotFound(f"The conflict {key} has no proposal {name}.")
    if asked.conflict.decided_by is None:
        made = plan(means, asked, signature(caller), DecisionRequest(response="accept", proposal=name))
    else:
        made = _as_proposed(means.database, asked, proposal)
    return api.MapDocument.model_validate(_fields(asked, made, signature(caller)))


def decide_all(
    means: Means, caller: Principal, robot_id: str, map_name: str, request: DecisionRequest
) -> api.Page[ConflictDocument]:
    """The same answer to all that is open about a map, the newest first; what can't be answered so stays open. Raises NotFound."""
    if request.proposal is not None or request.response == "annotate":
        raise InvalidInput(
            "All at once can be accepted as recommended, rejected or put off.", (Fault("/response", "one by one"),)
        )
    with means.database.read() as tx:
        of = find_map(tx, robot_id, map_name)
        rows = conflicts.page(tx, conflicts.is_of_map(of.id), "open", None, AT_ONCE)
    for row in rows:
        # another's answer, or this one to another question, may have ended it; or it takes more than this
        with suppress(AlreadyDecided, InvalidInput, ProposalOutdated):
            decide(means, caller, robot_id, map_name, row.key, request)
    with means.database.read() as tx:
        after = [conflicts.get(tx, row.id) for row in rows]
        return api.Page(items=documents(tx, after), next=None)


def expire(database: Database) -> int:
    """Gives the default answer to questions whose time is over, once each; how many, at most `AT_ONCE`."""
    with database.read() as tx:
        rows = conflicts.due(tx, clock.now(tx), AT_ONCE)
    count = 0
    for row in rows:
        with database.write() as tx:
            lanes.lock(tx, row.map_id)
            of, now = maps.get(tx, row.map_id), clock.now(tx)
            if conflicts.end(tx, row.id, Ending("expired", "deadline", of.head), now):
                events.add(tx, of, [_event(row, "expired", of.head)], now)
                count += 1
    return count


def _commit(database: Database, asked: Asked, made: Plan, made_by: str, request: DecisionRequest) -> bool:
    """Version, ending and events in one transaction. False where the map or the question is not what it was."""
    row = asked.conflict
    with database.write() as tx:
        lanes.lock(tx, asked.of.id)
        of, question = maps.get(tx, asked.of.id), conflicts.get(tx, row.id)
        if of.head != asked.head.number or question.sighting_id != row.sighting_id or question.decided_by is not None:
            return False
        now, happened, version = clock.now(tx), list[Happened](), asked.head.number
        if made.under is not None:
            version = _add_version(tx, of, made, made.under, made_by, now)
            happened.append(("version", {"version": version, "cause": "decision", "mission": made.under.mission}))
        ending = Ending(
            state=STATES[request.response],
            decided_by=made_by,
            version=version,
            response=request.response,
            proposal=asked.proposal(request.proposal).name if request.response == "accept" else None,
            dividers=request.dividers or None,
            note=request.note or None,
        )
        conflicts.end(tx, row.id, ending, now)
        happened.append(_event(row, ending.state, version))
        if made.settles_mission:
            happened += _settle_mission(tx, row, made_by, version, now)
        if made.met is not None:
            happened += sightings.keep(tx, made.met, version, now)
        events.add(tx, of, happened, now)
    return True


def _add_version(tx: Transaction, of: MapRow, made: Plan, under: Under, made_by: str, now: datetime) -> int:
    new = new_version(
        made.map,
        retired=made.retired,
        parent=of.head,
        cause="decision",
        mission=under.mission,
        made_by=made_by,
        grid=under.grid,
        frame_from=under.frame_from,
        motion=under.motion,
    )
    return maps.add_version(tx, of, new, now)


def _settle_mission(tx: Transaction, row: ConflictRow, made_by: str, version: int, now: datetime) -> list[Happened]:
    """The mission is in force now: nothing else is open about it."""
    happened = []
    for other in conflicts.standing(tx, row.map_id):
        if other.mission_id == row.mission_id:
            conflicts.end(tx, other.id, Ending("superseded", made_by, version, mission_id=row.mission_id), now)
            happened.append(_event(other, "superseded", version))
    return happened


def _event(row: ConflictRow, state: str, version: int | None) -> Happened:
    return "conflict", {"conflict": row.key, "state": state, "mission": row.mission, "version": version}


def _check_same(asked: Asked, request: DecisionRequest) -> None:
    """Raises AlreadyDecided, unless it ended by this very decision."""
    row = asked.conflict
    same = row.response == request.response
    if same and request.response == "accept":
        same = row.proposal == asked.proposal(request.proposal).name
    if same and request.response == "annotate":
        same = row.drawn == [[list(point) for point in line] for line in request.dividers]
    if not same:
        raise _already(row)


def _already(row: ConflictRow) -> StillroomError:
    if row.state == "superseded" and row.superseded_by is not None:
        detail = f"Mission {row.superseded_by} has made it pointless: there is nothing to decide any more."
    elif row.state == "expired":
        detail = "Nobody answered in time; the previous map was kept."
    else:
        detail = f"It was {row.state} by {row.decided_by}."
    return AlreadyDecided(
        detail,
        decided_by=row.decided_by,
        decided_at=row.decided_at,
        state=row.state,
        response=row.response,
        proposal=row.proposal,
        version=row.version,
        superseded_by=row.superseded_by,
    )


def _as_proposed(database: Database, asked: Asked, proposal: ProposalRow) -> Plan:
    with database.read() as tx:
        document, _ = conflicts.proposed_map(tx, proposal.sighting_id, proposal.name)
        base = maps.version_at(tx, asked.of.id, asked.conflict.base_version)
    assert base is not None
    mission = asked.mission
    kept = proposal.action == "keep_previous"
    under = Under(base.mission, base.grid, base.number) if kept else Under(mission.key, mission.grid, base.number)
    return Plan(decode_map(document), under)


def _fields(asked: Asked, made: Plan, made_by: str) -> dict[str, object]:
    """The document of a map that is not in force, and perhaps never will be."""
    of, head = asked.of, asked.head
    if made.under is None:
        return document_fields(of, head, made.map)
    changed = {
        "number": head.number + 1,
        "parent": head.number,
        "cause": "decision",
        "mission": made.under.mission,
        "made_by": made_by,
        "created_at": datetime.now(UTC),
    }
    row = VersionRow(**vars(head) | changed)
    # A map that is not in force has no address of its own: the pixels are those of the mission that it lies on.
    same = made.under.grid == head.grid
    pixels = f"{map_url(of)}/versions/{head.number}" if same else f"{map_url(of)}/missions/{made.under.mission}"
    return document_fields(of, row, made.map) | {"grid": f"{pixels}/grid.png", "cells": f"{pixels}/cells.png"}


def _end(asked: Asked, room: str, into: str | None) -> str:
    names = {r.id: r.name for r in asked.current.rooms}
    name = names.get(room, room)
    return f"{name} becomes part of {names.get(into, into)}." if into else f"{name} ends."
