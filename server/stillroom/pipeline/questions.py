"""What a map that was taken leaves to ask: nothing about it failed, but only a person knows what it means."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Protocol

import shapely
from shapely import LineString

from stillroom.errors import InvalidEdit
from stillroom.maps.meta import MetaDivider
from stillroom.maps.semantics import Divider, Room, SemanticMap
from stillroom.pipeline.conflicts import Conflict, Naming, Proposal
from stillroom.pipeline.decisions import joined, make_doors
from stillroom.pipeline.scores import RoomScore
from stillroom.pipeline.update import MapUpdate


class About(Protocol):
    """Any form of a conflict."""

    @property
    def kind(self) -> str: ...
    @property
    def cause(self) -> str: ...
    @property
    def resolved(self) -> bool: ...


def is_discovery(conflict: About) -> bool:
    """Whether it says that a room is new: on the map already, to be named, or to be part of its neighbour."""
    return conflict.kind == "connectivity" and conflict.resolved


def is_door(conflict: About) -> bool:
    """Whether it asks if a divider is a door."""
    return conflict.kind == "connectivity" and conflict.cause == "door_closed"


def ask(previous: SemanticMap, mission_id: str, update: MapUpdate) -> MapUpdate:
    """The update with its questions: whether a divider that was shut and is open again is a door, and what a new room is."""
    if not update.taken:
        return update
    named = Naming(previous, mission_id)
    questions = (*_doors(previous, update, named), *_new_rooms(update, named))
    return replace(update, conflicts=(*update.conflicts, *questions))


def _doors(previous: SemanticMap, update: MapUpdate, named: Naming) -> Iterator[Conflict]:
    scores = {score.id: score for score in update.rooms}
    waiting = {divider.id for divider in previous.dividers if divider.shut == "once"}
    for divider in update.map.dividers:
        if divider.id in waiting and divider.shut == "asked":
            proposal = Proposal("p1", "take_new", True, make_doors(update.map, [divider.id]))
            yield Conflict(
                named.id_of("connectivity", [divider.id]),
                "connectivity",
                "door_closed",
                tuple(scores[room] for room in divider.rooms if room in scores),
                (divider.id,),
                (),
                f"The way between {named.rooms(divider.rooms, update.map)} was closed and is open again. Is there a door?",
                False,
                (proposal,),
            )


def _new_rooms(update: MapUpdate, named: Naming) -> Iterator[Conflict]:
    for room in update.map.rooms:
        if room.id not in update.discovered:
            continue
        proposals = [Proposal("p1", "take_new", True, update.map)]
        neighbour = neighbour_of(room, update.map)
        whole = None if neighbour is None else _as_part(update.map, room, neighbour)
        if whole is not None:
            proposals.append(Proposal("p2", "keep_previous", False, whole))
        yield Conflict(
            named.id_of("connectivity", [room.id]),
            "connectivity",
            "new_passage",
            (RoomScore(room.id, room.name, 1.0, 1.0, passed=True),),
            tuple(divider.id for divider in _dividers(update.map) if room.id in divider.rooms),
            (),
            f"A new room was found{'' if neighbour is None else f' beside {neighbour.name}'}: {room.name}.",
            True,
            tuple(proposals),
        )


def _as_part(m: SemanticMap, room: Room, neighbour: Room) -> SemanticMap | None:
    """The new room as part of the other; None where another divider would be left in mid-air."""
    try:
        return joined(m, room.id, neighbour.id).map
    except InvalidEdit:
        return None


def neighbour_of(room: Room, m: SemanticMap) -> Room | None:
    """The room to which most of what divides leads."""
    widths: dict[str, float] = {}
    for divider in _dividers(m):
        if room.id in divider.rooms:
            for other in set(divider.rooms) - {room.id}:
                widths[other] = widths.get(other, 0.0) + float(shapely.length(LineString(divider.line)))
    return m.room(max(widths, key=lambda other: (widths[other], other))) if widths else None


def _dividers(m: SemanticMap) -> tuple[Divider | MetaDivider, ...]:
    return (*m.dividers, *m.meta.dividers)
