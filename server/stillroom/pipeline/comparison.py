"""Two versions of a map compared: what changed, feature by feature, with the numbers that a sentence about it needs."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from shapely import LineString

from stillroom.maps.geometry import as_points
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Divider, SemanticMap

ChangeCode = Literal[
    "room-added", "room-ended", "room-renamed", "room-grew", "room-shrank", "room-reshaped", "room-kind", "room-pinned",
    "room-unpinned", "divider-added", "divider-removed", "divider-moved", "divider-kind", "restriction-added",
    "restriction-removed", "restriction-moved", "restriction-placement", "phantom-added", "phantom-removed",
    "repair-added", "repair-removed",
]  # fmt: skip
AREA_M2 = 0.1
"""Rooms that grow or shrink by less than this, or by less than `AREA_SHARE`, only wobble."""
AREA_SHARE = 0.02
RESHAPED_SHARE = 0.1
"""A room whose area stayed but whose ground changed by more than this has another shape."""
MOVED_M = 0.03


@dataclass(frozen=True)
class Change:
    """`name`: of the room, or of the rooms beside a divider; `value`: metres or square metres, where it is measured."""

    code: ChangeCode
    feature: str
    name: str
    text: str
    value: float | None = None


def compare(before: SemanticMap, after: SemanticMap, motion: Motion) -> tuple[Change, ...]:
    """`motion` takes the frame of `before` to that of `after`. Rooms first, then what lies between and in them."""
    return (
        *_rooms(before, after, motion),
        *_dividers(before, after, motion),
        *_zones(before, after, motion),
        *_repairs(before, after),
    )


def _rooms(before: SemanticMap, after: SemanticMap, motion: Motion) -> Iterator[Change]:
    for room in after.rooms:
        was = before.room(room.id)
        if was is None:
            parent = next((r.name for r in (*after.rooms, *before.rooms) if r.id == room.derived_from), None)
            origin = f", from {parent}" if parent else ""
            text = f"{room.name} is new{origin} ({room.polygon.area:.1f} m²)"
            yield Change("room-added", room.id, room.name, text, round(room.polygon.area, 2))
            continue
        if was.name != room.name:
            yield Change("room-renamed", room.id, room.name, f"{was.name} is called {room.name} now")
        if was.kind != room.kind:
            kind = "no particular use" if room.kind is None else room.kind.replace("_", " ")
            yield Change("room-kind", room.id, room.name, f"{room.name} is used as: {kind}")
        if was.pinned != room.pinned:
            code: ChangeCode = "room-pinned" if room.pinned else "room-unpinned"
            yield Change(code, room.id, room.name, f"{room.name} was {'pinned' if room.pinned else 'unpinned'}")
        place = shapely.transform(was.polygon, lambda points: motion.apply(as_points(points)))
        grown = room.polygon.area - place.area
        if abs(grown) >= max(AREA_M2, AREA_SHARE * place.area):
            word, code = ("grew", "room-grew") if grown > 0 else ("shrank", "room-shrank")
            text = f"{room.name} {word} by {abs(grown):.1f} m²"
            yield Change(code, room.id, room.name, text, round(grown, 2))
        elif shapely.symmetric_difference(shapely.make_valid(place), room.polygon).area > RESHAPED_SHARE * place.area:
            yield Change("room-reshaped", room.id, room.name, f"{room.name} has another shape")
    for was in before.rooms:
        if after.room(was.id) is None:
            yield Change("room-ended", was.id, was.name, f"{was.name} is no room of its own any more")


def _dividers(before: SemanticMap, after: SemanticMap, motion: Motion) -> Iterator[Change]:
    for divider in after.dividers:
        was, between = before.divider(divider.id), _between(after, divider)
        if was is None:
            yield Change("divider-added", divider.id, between, f"Divider {between} is new")
            continue
        moved = motion.apply(as_points(was.line))
        gap = float(shapely.hausdorff_distance(LineString(moved), LineString(divider.line)))
        if gap >= MOVED_M:
            text = f"Divider {between} moved by {gap * 100:.0f} cm"
            yield Change("divider-moved", divider.id, between, text, round(gap, 3))
        if was.kind != divider.kind:
            text = f"Divider {between} is {'a door' if divider.kind == 'door' else 'an open passage'} now"
            yield Change("divider-kind", divider.id, between, text)
    for was in before.dividers:
        if after.divider(was.id) is None:
            between = _between(before, was)
            yield Change("divider-removed", was.id, between, f"Divider {between} is gone")


def _between(semantic_map: SemanticMap, divider: Divider) -> str:
    names = {room.id: room.name for room in semantic_map.rooms}
    return " / ".join(names[room] for room in divider.rooms if room in names) or divider.id


ZONES = {"no_go": "No-go zone", "no_mop": "No-mop zone", "virtual_wall": "Virtual wall"}


def _zones(before: SemanticMap, after: SemanticMap, motion: Motion) -> Iterator[Change]:
    old, new = {z.id: z for z in before.restrictions}, {z.id: z for z in after.restrictions}
    for name, zone in new.items():
        was, kind = old.get(name), ZONES[zone.kind]
        if was is None:
            yield Change("restriction-added", name, kind, f"{kind} {name} is new")
            continue
        here, there = motion.apply(as_points(was.shape)), as_points(zone.shape)
        gap = float(np.linalg.norm(here - there, axis=1).max()) if len(here) == len(there) else np.inf
        if gap >= 2 * MOVED_M:
            metres = round(gap, 3) if np.isfinite(gap) else None
            yield Change("restriction-moved", name, kind, f"{kind} {name} was moved", metres)
        if was.placed != zone.placed:
            text = f"{kind} {name} {'is placed again' if zone.placed else 'could not be placed'}"
            yield Change("restriction-placement", name, kind, text)
    for name in sorted(old.keys() - new.keys()):
        kind = ZONES[old[name].kind]
        yield Change("restriction-removed", name, kind, f"{kind} {name} is gone")
    gone, come = {p.id for p in before.phantoms}, {p.id for p in after.phantoms}
    for name in sorted(come - gone):
        yield Change("phantom-added", name, name, f"Area {name} was marked as not a real place")
    for name in sorted(gone - come):
        yield Change("phantom-removed", name, name, f"Area {name} is no longer marked as not a real place")


def _repairs(before: SemanticMap, after: SemanticMap) -> Iterator[Change]:
    old, new = ({m.id for m in of.meta.dividers} | {m.id for m in of.meta.occupancy} for of in (before, after))
    for name in sorted(new - old):
        yield Change("repair-added", name, name, f"Repair {name} was made")
    for name in sorted(old - new):
        yield Change("repair-removed", name, name, f"Repair {name} is not needed any more")
