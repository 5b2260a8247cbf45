"""A map and a batch of operations in, a new map or `InvalidEdit` out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import shapely
from shapely import LineString

from stillroom.maps.geometry import as_points
from stillroom.maps.meta import MetaDivider
from stillroom.maps.semantics import Divider, Phantom, Restriction, Room, SemanticMap
from stillroom.pipeline.edits.draft import END_M, Draft, Setting, checked_line, checked_name, checked_shape, fault
from stillroom.pipeline.edits.ends import attach_drawn, check_untouched
from stillroom.pipeline.edits.floor import clutter_on, cut_phantoms, new_phantoms, walls_of
from stillroom.pipeline.edits.merging import merge_rooms
from stillroom.pipeline.edits.operations import (
    AcceptMetaDivider,
    AddDivider,
    AddRestriction,
    MarkPhantom,
    MergeRooms,
    MoveDivider,
    MoveRestriction,
    Operation,
    PinRoom,
    Problem,
    RemoveDivider,
    RemovePhantom,
    RemoveRestriction,
    RenameRoom,
    RoomRef,
    SetDividerKind,
    SetRoomKind,
)
from stillroom.pipeline.edits.problems import problems
from stillroom.pipeline.edits.rooms import match_rooms, with_settings
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.rooms import floor_of, partition, rooms_beside

MOST_OPERATIONS = 500
AnyDivider = TypeVar("AnyDivider", Divider, MetaDivider)


@dataclass(frozen=True)
class EditResult:
    map: SemanticMap
    retired: Mapping[str, str | None] = field(default_factory=dict)
    """Ids of rooms that ended -> the room that has their space now, if any."""
    problems: tuple[Problem, ...] = ()
    made: Mapping[str, str] = field(default_factory=dict)
    """JSON pointers of operations -> ids of the features that they made."""


def apply_edits(previous: SemanticMap, operations: Sequence[Operation], params: Params = PARAMS) -> EditResult:
    """All operations or none, judged as a whole.

    Raises InvalidEdit with a JSON pointer into {"operations": [...]} for what can't be applied, and the fixes that there are.
    """
    if not 1 <= len(operations) <= MOST_OPERATIONS:
        raise fault("/operations", f"A batch holds 1 to {MOST_OPERATIONS} operations, this one {len(operations)}.")
    draft = Draft.of(previous)
    for index, operation in enumerate(operations):
        draft = _apply(draft, f"/operations/{index}", operation)
    return finish(draft, (), params)


def finish(draft: Draft, back: Sequence[Room], params: Params) -> EditResult:
    """The draft as a map: floor, ends of dividers, rooms. `back`: rooms as they were (see match_rooms). Raises InvalidEdit."""
    previous = draft.previous
    floor_before = floor_of(previous.rooms)
    draft, floor = cut_phantoms(draft, floor_before, params)
    draft = attach_drawn(draft, floor, params)
    check_untouched(draft, floor, floor_before)
    pieces = partition(floor, draft.lines(), params.face_area_m2)
    matched = match_rooms(previous.rooms, pieces, draft.ids, back)
    rooms, ids = with_settings(matched, draft.settings), matched.ids
    walls, clutter = previous.walls, previous.clutter
    if floor is not floor_before:
        walls, ids = walls_of(walls, floor, ids)
        clutter = clutter_on(clutter, floor)
    edited = replace(
        previous,
        rooms=rooms,
        dividers=_with_rooms(draft.dividers, rooms),
        walls=walls,
        clutter=clutter,
        restrictions=draft.restrictions,
        phantoms=draft.phantoms,
        meta=replace(previous.meta, dividers=_with_rooms(draft.meta_dividers, rooms)),
        ids=ids,
    )
    return EditResult(edited, matched.retired, tuple(problems(previous, edited, new_phantoms(draft))), draft.made)


def _with_rooms(dividers: Sequence[AnyDivider], rooms: Sequence[Room]) -> tuple[AnyDivider, ...]:
    beside = rooms_beside([d.line for d in dividers], [room.polygon for room in rooms])
    return tuple(replace(d, rooms=tuple(rooms[i].id for i in sides)) for d, sides in zip(dividers, beside, strict=True))


def _apply(draft: Draft, pointer: str, operation: Operation) -> Draft:
    match operation:
        case AddDivider() | MoveDivider() | RemoveDivider() | SetDividerKind() | AcceptMetaDivider():
            return _on_dividers(draft, pointer, operation)
        case RenameRoom(room, name):
            named = {"name": checked_name(pointer, name), "named_by": "user"}
            return _set(draft, pointer, room, named)
        case SetRoomKind(room, kind):
            return _set(draft, pointer, room, {"kind": kind})
        case PinRoom(room, pinned):
            return _set(draft, pointer, room, {"pinned": pinned})
        case MergeRooms(room_ids):
            return merge_rooms(draft, pointer, room_ids)
        case AddRestriction() | MoveRestriction() | RemoveRestriction():
            return _on_restrictions(draft, pointer, operation)
        case MarkPhantom(shape):
            (fresh,), ids = draft.ids.take("p")
            phantom = Phantom(fresh, checked_shape(pointer, "no_go", shape, draft.previous.frame))
            return replace(draft, phantoms=(*draft.phantoms, phantom), ids=ids, made={**draft.made, pointer: fresh})
        case RemovePhantom(phantom_id):
            kept = tuple(p for p in draft.phantoms if p.id != phantom_id)
            if len(kept) == len(draft.phantoms):
                raise fault(f"{pointer}/id", f"There is no phantom {phantom_id}.")
            return replace(draft, phantoms=kept)


def _set(draft: Draft, pointer: str, room: RoomRef, values: Mapping[str, object]) -> Draft:
    if isinstance(room, str):
        draft.room(f"{pointer}/id", room)
    return replace(draft, settings=(*draft.settings, Setting(pointer, room, values)))


def _on_dividers(
    draft: Draft,
    pointer: str,
    operation: AddDivider | MoveDivider | RemoveDivider | SetDividerKind | AcceptMetaDivider,
) -> Draft:
    match operation:
        case AddDivider(line, kind):
            (fresh,), ids = draft.ids.take("d")
            divider = Divider(fresh, checked_line(pointer, line), kind, "user")
            return replace(
                draft,
                dividers=(*draft.dividers, divider),
                ids=ids,
                drawn={**draft.drawn, fresh: pointer},
                made={**draft.made, pointer: fresh},
            )
        case MoveDivider(divider_id, line):
            moved = replace(draft.divider(pointer, divider_id), line=checked_line(pointer, line), made_by="user")
            return replace(draft.put(moved), drawn={**draft.drawn, divider_id: pointer})
        case RemoveDivider(divider_id):
            gone = draft.divider(pointer, divider_id)
            kept = tuple(d for d in draft.dividers if d is not gone)
            return replace(draft, dividers=kept, drawn={d: p for d, p in draft.drawn.items() if d != divider_id})
        case SetDividerKind(divider_id, kind):
            return draft.put(replace(draft.divider(pointer, divider_id), kind=kind, made_by="user"))
        case AcceptMetaDivider(meta_id):
            return _accept(draft, pointer, meta_id)


def _accept(draft: Draft, pointer: str, meta_id: str) -> Draft:
    """With the meta-dividers that it ends on: a divider may not end on one that can be dropped at any time."""
    accepted = next((m for m in draft.meta_dividers if m.id == meta_id), None)
    if accepted is None:
        raise fault(f"{pointer}/id", f"There is no meta-divider {meta_id}.")
    (fresh,), ids = draft.ids.take("d")
    kept = tuple(m for m in draft.meta_dividers if m is not accepted)
    draft = replace(
        draft,
        dividers=(*draft.dividers, Divider(fresh, accepted.line, "open", "user")),
        meta_dividers=kept,
        ids=ids,
        made={**draft.made, pointer: fresh},
    )
    firm = shapely.GeometryCollection(
        [shapely.boundary(floor_of(draft.previous.rooms)), *(LineString(d.line) for d in draft.dividers[:-1])]
    )
    for end in shapely.points(as_points(accepted.line)):
        if shapely.distance(end, firm) <= END_M:
            continue
        for other in draft.meta_dividers:
            if shapely.distance(end, LineString(other.line)) <= END_M:
                draft = _accept(draft, pointer, other.id)
                break
    return replace(draft, made={**draft.made, pointer: fresh})


def _on_restrictions(
    draft: Draft, pointer: str, operation: AddRestriction | MoveRestriction | RemoveRestriction
) -> Draft:
    match operation:
        case AddRestriction(kind, shape):
            (fresh,), ids = draft.ids.take("z")
            drawn = Restriction(fresh, kind, checked_shape(pointer, kind, shape, draft.previous.frame))
            return replace(
                draft, restrictions=(*draft.restrictions, drawn), ids=ids, made={**draft.made, pointer: fresh}
            )
        case MoveRestriction(restriction_id, shape):
            known = _restriction(draft, pointer, restriction_id)
            placed = checked_shape(pointer, known.kind, shape, draft.previous.frame)
            moved = replace(known, shape=placed, placed=True)
            return replace(draft, restrictions=tuple(moved if r is known else r for r in draft.restrictions))
        case RemoveRestriction(restriction_id):
            gone = _restriction(draft, pointer, restriction_id)
            return replace(draft, restrictions=tuple(r for r in draft.restrictions if r is not gone))


def _restriction(draft: Draft, pointer: str, restriction_id: str) -> Restriction:
    for restriction in draft.restrictions:
        if restriction.id == restriction_id:
            return restriction
    raise fault(f"{pointer}/id", f"There is no restriction {restriction_id}.")
