"""Rooms after an edit: whose ids, names and settings they have."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from stillroom.maps.semantics import Ids, Room
from stillroom.pipeline.edits.draft import Setting, fault
from stillroom.pipeline.rooms import new_rooms, overlaps


@dataclass(frozen=True)
class Matched:
    rooms: tuple[Room, ...]
    retired: Mapping[str, str | None]
    """Ids of rooms that ended -> the room that has their space now, if any."""
    parts: Mapping[str, Sequence[str]]
    """Ids of rooms that were divided -> the new rooms that were parts of them."""
    ids: Ids


def match_rooms(previous: Sequence[Room], pieces: Sequence[Polygon], ids: Ids, back: Sequence[Room] = ()) -> Matched:
    """Rooms of the new pieces. The larger part of a split keeps the id, the larger room of a merger does.

    `back`: rooms as they were before what is being taken back. Those that ended since may come back with their old ids, the others
    are looked for where they were.
    """
    were = {room.id: room for room in back}
    known = {room.id for room in previous}
    candidates = [*previous, *(room for room in back if room.id not in known)]
    common = overlaps([were.get(room.id, room).polygon for room in candidates], pieces)
    goes_to = [int(row.argmax()) if row.any() else None for row in common]
    rooms: list[Room] = []
    retired: dict[str, str | None] = {}
    for i, room in enumerate(candidates):
        piece = goes_to[i]
        if piece is None:
            retired[room.id] = None
            continue
        merged = [k for k in range(len(candidates)) if goes_to[k] == piece]
        survivor = max(merged, key=lambda k: (common[k, piece], -k))
        if survivor != i:
            retired[room.id] = candidates[survivor].id
        else:
            living = [k for k in merged if candidates[k].id in known] or merged
            joined = [candidates[k] for k in living]
            rooms.append(_survivor(room, joined, common[living, piece], pieces[piece]))
    parts: dict[str, list[str]] = {}
    for piece in sorted(set(range(len(pieces))) - {p for p in goes_to if p is not None}):
        (fresh,), ids = new_rooms([pieces[piece]], None, ids)
        parent = candidates[int(common[:, piece].argmax())]
        rooms.append(_part_of(parent, fresh, (room.name for room in (*candidates, *rooms))))
        parts.setdefault(parent.id, []).append(fresh.id)
    return Matched(tuple(rooms), {name: to for name, to in retired.items() if name in known}, parts, ids)


def _survivor(
    room: Room, merged: Sequence[Room], areas: np.ndarray[tuple[int, ...], np.dtype[np.float64]], piece: Polygon
) -> Room:
    """A name that a person gave beats one of an algorithm; a use that was said, one that was not; a pinned part pins the whole."""
    by_size = [merged[k] for k in np.argsort(-areas, kind="stable")]
    named = next((other for other in by_size if other.named_by == "user"), room) if room.named_by != "user" else room
    kind = next((other.kind for other in (room, *by_size) if other.kind is not None), None)
    pinned = any(other.pinned for other in merged)
    return replace(_shaped(room, piece), name=named.name, named_by=named.named_by, kind=kind, pinned=pinned)


def _part_of(parent: Room, fresh: Room, taken: Iterable[str]) -> Room:
    """The smaller part of a split room: it has its parent's settings, and a name of its own."""
    name = _second_name(parent, taken) if parent.named_by == "user" else fresh.name
    return replace(
        fresh,
        name=name,
        made_by="user",
        derived_from=parent.id,
        last_visited=parent.last_visited,
        kind=parent.kind,
        pinned=parent.pinned,
        anchor=fresh.polygon,
    )


def _shaped(room: Room, after: Polygon) -> Room:
    """The room with a new shape, which the person who edits it confirms. Where nothing changed, its vertices keep their order."""
    if room.polygon.normalize().equals_exact(after.normalize(), 1e-6):
        return room
    return replace(room, polygon=after, anchor=after)


def _second_name(parent: Room, taken: Iterable[str]) -> str:
    """A name for the smaller part of a split room: "Kitchen 2"."""
    used = set(taken)
    number = 2
    while f"{parent.name} {number}" in used:
        number += 1
    return f"{parent.name} {number}"


def with_settings(matched: Matched, settings: Sequence[Setting]) -> tuple[Room, ...]:
    """What the batch says about rooms.

    Said of one that the batch merged, it counts for the survivor, unless that one was named itself; said of one that it divided, for
    all parts, but for the name.
    """
    rooms = {room.id: room for room in matched.rooms}
    for setting in settings:
        shared = {name: value for name, value in setting.values.items() if name in ("kind", "pinned")}
        for part in matched.parts.get(setting.room, ()) if isinstance(setting.room, str) else ():
            rooms[part] = replace(rooms[part], **shared)
    for direct in (False, True):
        for setting in settings:
            room_id = _room_id(setting, rooms.values())
            if (room_id in rooms) != direct:
                continue
            target = room_id if direct else matched.retired.get(room_id)
            if target is not None:
                rooms[target] = _with_values(rooms[target], setting.values)
    return tuple(rooms.values())


def _with_values(room: Room, values: Mapping[str, Any]) -> Room:
    """A person who pins a room confirms its shape."""
    changed = replace(room, **values)
    return replace(changed, anchor=changed.polygon) if values.get("pinned") else changed


def _room_id(setting: Setting, rooms: Iterable[Room]) -> str:
    if isinstance(setting.room, str):
        return setting.room
    x, y = setting.room
    for room in rooms:
        if shapely.contains_xy(room.polygon, x, y):
            return room.id
    raise fault(f"{setting.pointer}/at", f"There is no room at ({x:.2f}, {y:.2f}).")
