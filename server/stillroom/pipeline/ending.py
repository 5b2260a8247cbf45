"""Rooms that end: a person joined them to others, or bit by bit they became less than a room and can't be found any more."""

from collections.abc import Collection
from dataclasses import replace

import shapely

from stillroom.maps.geometry import as_points
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.params import Params
from stillroom.pipeline.rooms import overlaps


def ended(before: SemanticMap, after: SemanticMap, motion: Motion) -> dict[str, str | None]:
    """Rooms of `before` that `after` does not have -> the room that has their space there, if any."""
    living = {room.id for room in after.rooms}
    gone = [room for room in before.rooms if room.id not in living]
    polygons = [shapely.transform(room.polygon, lambda p: motion.apply(as_points(p))) for room in gone]
    common = overlaps([shapely.make_valid(p) for p in polygons], [room.polygon for room in after.rooms])
    return {
        room.id: after.rooms[int(row.argmax())].id if row.any() else None
        for room, row in zip(gone, common, strict=True)
    }


def withered(m: SemanticMap, lost: Collection[str], params: Params) -> frozenset[str]:
    """Of the `lost` rooms those that are smaller than what a divider parts off to be a room, and were not when somebody last confirmed them.

    What a person named, drew, pinned or said the use of stays: they know better what a room is.
    """
    drawn = {room for divider in m.dividers if divider.made_by == "user" for room in divider.rooms}
    return frozenset(
        room.id
        for room in m.rooms
        if room.id in lost
        and (room.made_by, room.named_by, room.kind, room.pinned) == ("algorithm", "algorithm", None, False)
        and room.id not in drawn
        and room.anchor is not None
        and room.polygon.area < params.divided_room_m2 <= room.anchor.area
    )


def without(m: SemanticMap, rooms: Collection[str]) -> SemanticMap:
    """The map without those rooms, and without the dividers that parted them from others."""
    return replace(
        m,
        rooms=tuple(room for room in m.rooms if room.id not in rooms),
        dividers=tuple(divider for divider in m.dividers if not set(divider.rooms) & set(rooms)),
    )
