"""What an edit causes that its author should see: only what was not so before."""

from collections.abc import Iterator, Sequence

import shapely
from shapely import Polygon

from stillroom.maps.geometry import as_points
from stillroom.maps.semantics import Phantom, SemanticMap
from stillroom.pipeline.edits.operations import Problem, RemoveDivider

SMALL_ROOM_M2 = 1.0


def problems(previous: SemanticMap, edited: SemanticMap, phantoms: Sequence[Phantom]) -> Iterator[Problem]:
    """`phantoms` are those that the edit marked."""
    yield from _dividers(previous, edited)
    yield from _rooms(previous, edited)
    yield from _restrictions(previous, edited)
    before = shapely.union_all([room.polygon for room in previous.rooms])
    for phantom in phantoms:
        if shapely.intersection(before, Polygon(phantom.shape)).area < SMALL_ROOM_M2 / 100:
            yield Problem("no-floor", "warning", phantom.id, "There was no floor where this phantom is.")
    for gone in {p.id for p in previous.phantoms} - {p.id for p in edited.phantoms}:
        yield Problem(
            "comes-back", "info", gone, "What lies there comes back as floor with the next mission that sees it."
        )


def _dividers(previous: SemanticMap, edited: SemanticMap) -> Iterator[Problem]:
    for divider in edited.dividers:
        before = previous.divider(divider.id)
        if len(divider.rooms) < 2 and (before is None or len(before.rooms) >= 2):
            yield Problem(
                "separates-nothing",
                "warning",
                divider.id,
                f"The divider {divider.id} has the same room on both sides.",
                "extend or remove it",
                None if before is None else RemoveDivider(divider.id),
            )


def _rooms(previous: SemanticMap, edited: SemanticMap) -> Iterator[Problem]:
    for room in edited.rooms:
        before = previous.room(room.id)
        if room.polygon.area < SMALL_ROOM_M2 and (before is None or before.polygon.area >= SMALL_ROOM_M2):
            yield Problem("small-room", "warning", room.id, f"{room.name} has only {room.polygon.area:.1f} m².")
        twins = [other.id for other in edited.rooms if other.name == room.name and other.id != room.id]
        changed = before is None or before.name != room.name
        if changed and any(twin < room.id or _kept_its_name(previous, edited, twin) for twin in twins):
            yield Problem("same-name", "warning", room.id, f"There is another room called {room.name}.")


def _kept_its_name(previous: SemanticMap, edited: SemanticMap, room_id: str) -> bool:
    before, after = previous.room(room_id), edited.room(room_id)
    return before is not None and after is not None and before.name == after.name


def _restrictions(previous: SemanticMap, edited: SemanticMap) -> Iterator[Problem]:
    """A zone that a robot can't leave a room by, or that covers one wholly, is allowed, but seldom meant."""
    known = dict.fromkeys(previous.restrictions, True)
    for restriction in edited.restrictions:
        if restriction in known or restriction.kind != "no_go":
            continue
        zone = Polygon(as_points(restriction.shape))
        for room in edited.rooms:
            if shapely.covers(zone, room.polygon):
                message = f"The robot will not go into {room.name} at all."
                yield Problem("room-forbidden", "warning", restriction.id, message)
