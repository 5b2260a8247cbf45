"""What people decide about conflicts, as pure actions on a map: corrections made their own or refused, shapes confirmed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import shapely
from shapely import LineString, Polygon

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Line, as_line, as_points, as_tuples
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.meta import Declined, MapMeta, MetaDivider
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Divider, Phantom, SemanticMap, Wall
from stillroom.pipeline.edits import AcceptMetaDivider, MergeRooms, SetDividerKind, apply_edits
from stillroom.pipeline.edits.rooms import match_rooms
from stillroom.pipeline.obstacles import corrected
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.phantoms import without_phantoms
from stillroom.pipeline.resolution import ADJOINS_M
from stillroom.pipeline.rooms import floor_of, rooms_beside
from stillroom.pipeline.transfer import transfer_semantics
from stillroom.pipeline.walls import wall_features


@dataclass(frozen=True)
class Decided:
    """The map after a decision."""

    map: SemanticMap
    retired: Mapping[str, str | None] = field(default_factory=dict)
    """Ids of rooms that ended -> the room that has their space now, if any."""


def corrections_of(m: SemanticMap, rooms: Collection[str]) -> MapMeta:
    """The corrections between or beside these rooms; all there are where no room is named."""
    if not rooms:
        return replace(m.meta, declined=())
    shapes = [room.polygon for room in m.rooms if room.id in rooms]
    return MapMeta(
        tuple(o for o in m.meta.occupancy if any(shapely.dwithin(o.polygon, shape, ADJOINS_M) for shape in shapes)),
        tuple(d for d in m.meta.dividers if set(d.rooms) & set(rooms)),
    )


def confirm(m: SemanticMap, rooms: Collection[str] | None = None) -> SemanticMap:
    """A person says that these rooms, or all, are as they should be."""
    confirmed = (replace(room, anchor=room.polygon) if rooms is None or room.id in rooms else room for room in m.rooms)
    return replace(m, rooms=tuple(confirmed))


def own(m: SemanticMap, corrections: MapMeta, grid: OccupancyGrid, params: Params = PARAMS) -> SemanticMap:
    """The corrections made the owner's own, without a change to any room.

    A meta-divider becomes a divider. A region that counts as occupied becomes a phantom: there is no floor in any later mission,
    whatever the robot senses. One that counts as free stays as it is: what stands there now is no wall.
    """
    for divider in corrections.dividers:
        if divider in m.meta.dividers:  # it may have been accepted with another that ends on it
            accepted = apply_edits(m, [AcceptMetaDivider(divider.id)], params).map
            m = replace(m, dividers=accepted.dividers, meta=accepted.meta, ids=accepted.ids)
    closed = [o for o in corrections.occupancy if o.cell == "occupied"]
    if not closed:
        return m
    names, ids = m.ids.take("p", len(closed))
    (version,), ids = ids.take("v")
    phantoms = tuple(
        Phantom(name, as_tuples(as_points(shapely.get_coordinates(section.polygon.exterior)[:-1])))
        for name, section in zip(names, closed, strict=True)
    )
    meta = replace(m.meta, occupancy=tuple(o for o in m.meta.occupancy if o not in closed))
    m = replace(m, phantoms=(*m.phantoms, *phantoms), meta=meta, ids=ids)
    under = grid_under(m, _covering(grid, m))
    walls = wall_features(floor_of(m.rooms), under.near_occupied(params.wall_reach_m), under.frame, version[1:])
    return replace(m, walls=walls)


def make_doors(m: SemanticMap, dividers: Collection[str], params: Params = PARAMS) -> SemanticMap:
    """With these dividers as doors, those that there still are."""
    operations = [SetDividerKind(divider.id, "door") for divider in m.dividers if divider.id in dividers]
    return apply_edits(m, operations, params).map if operations else m


def joined(m: SemanticMap, part: str, whole: str, until: str | None = None, params: Params = PARAMS) -> Decided:
    """The room `part` made part of the room `whole`, which stays what it is called; nothing is to divide them there again.

    Raises InvalidEdit where they do not touch.
    """
    dividers: tuple[Divider | MetaDivider, ...] = (*m.dividers, *m.meta.dividers)
    between = [d for d in dividers if {part, whole} <= set(d.rooms)]
    merged = apply_edits(m, [MergeRooms((whole, part))], params).map
    kept = m.room(whole)
    rooms = tuple(
        replace(kept, polygon=room.polygon, anchor=room.anchor) if kept and room.id in (part, whole) else room
        for room in merged.rooms
    )

    def beside(ids: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(whole if room == part else room for room in ids)

    declined = (*merged.meta.declined, *(Declined(LineString(d.line), until) for d in between))
    meta_dividers = tuple(replace(d, rooms=beside(d.rooms)) for d in merged.meta.dividers)
    without = replace(
        merged,
        rooms=rooms,
        dividers=tuple(replace(d, rooms=beside(d.rooms)) for d in merged.dividers),
        meta=replace(merged.meta, dividers=meta_dividers, declined=declined),
    )
    return Decided(without, {part: whole})


def annotated(m: SemanticMap, lines: Sequence[Line], motion: Motion) -> SemanticMap:
    """The map with dividers of a person's own that were drawn in a mission's frame; `motion` takes the map's frame to that one.

    They cut the map's rooms only when it is carried over to that mission.
    """
    names, ids = m.ids.take("d", len(lines))
    back = motion.inverse()
    drawn = tuple(
        Divider(name, as_line(back.apply(as_points(line))), "open", "user")
        for name, line in zip(names, lines, strict=True)
    )
    return replace(m, dividers=(*m.dividers, *drawn), ids=ids)


def grid_under(m: SemanticMap, grid: OccupancyGrid) -> OccupancyGrid:
    """A copy of the grid as the map takes it: without phantoms, with the meta-occupancy."""
    return corrected(without_phantoms(grid, m.phantoms), m.meta.occupancy)


def refuse(
    m: SemanticMap,
    corrections: MapMeta,
    grid: OccupancyGrid,
    mission_id: str,
    until: str | None = None,
    params: Params = PARAMS,
) -> Decided:
    """The map without these corrections: what they held apart runs together, and they are not proposed there again.

    Where no valid map is left without them, they stay until the next mission is carried over without them.
    """
    meta = MapMeta(
        tuple(o for o in m.meta.occupancy if o not in corrections.occupancy),
        tuple(d for d in m.meta.dividers if d not in corrections.dividers),
        (*m.meta.declined, *_declined(corrections, until)),
    )
    grid = _covering(grid, m)
    opened = replace(m, meta=meta, walls=_beside(m.walls, [o.polygon for o in corrections.occupancy], grid))
    transfer = transfer_semantics(opened, grid, mission_id, params, meta)
    candidate = transfer.candidate
    matched = match_rooms(m.rooms, [room.polygon for room in candidate.rooms], candidate.ids)
    merged = {room for room in matched.retired.values() if room is not None}
    before = {room.id: room for room in m.rooms}
    rooms = tuple(
        replace(room, anchor=before[room.id].anchor) if room.id in before and room.id not in merged else room
        for room in matched.rooms
    )
    polygons = [room.polygon for room in rooms]
    lines = [d.line for d in candidate.dividers] + [d.line for d in candidate.meta.dividers]
    beside = rooms_beside(lines, polygons)
    named = [tuple(rooms[i].id for i in sides) for sides in beside]
    own_, of_meta = named[: len(candidate.dividers)], named[len(candidate.dividers) :]
    without = replace(
        candidate,
        rooms=rooms,
        dividers=tuple(replace(d, rooms=ids) for d, ids in zip(candidate.dividers, own_, strict=True)),
        meta=replace(
            candidate.meta,
            dividers=tuple(replace(d, rooms=ids) for d, ids in zip(candidate.meta.dividers, of_meta, strict=True)),
            declined=meta.declined,
        ),
        ids=matched.ids,
    )
    if violations(without, transfer.grid, params.wall_reach_m):
        return Decided(replace(m, meta=replace(m.meta, declined=meta.declined)))
    return Decided(without, matched.retired)


def _covering(grid: OccupancyGrid, m: SemanticMap) -> OccupancyGrid:
    """The grid, as large as the map: rooms that a mission did not see may lie beyond it."""
    return grid.covering(as_points(shapely.get_coordinates([room.polygon for room in m.rooms])))


def _declined(corrections: MapMeta, until: str | None) -> list[Declined]:
    return [Declined(c.shape, until) for c in corrections.occupancy] + [
        Declined(c.shape, until) for c in corrections.dividers
    ]


def _beside(walls: Sequence[Wall], sections: Sequence[Polygon], grid: OccupancyGrid) -> tuple[Wall, ...]:
    """The walls but for what runs along these sections, which would be taken for gaps in them."""
    around = shapely.union_all([shapely.buffer(section, 2 * grid.frame.resolution) for section in sections])
    kept = []
    for wall in walls:
        parts = shapely.get_parts(shapely.difference(LineString(wall.line), around))
        kept += [replace(wall, line=as_tuples(shapely.get_coordinates(part))) for part in parts if part.length > 0]
    return tuple(kept)
