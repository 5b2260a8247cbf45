"""The floor without phantoms, and the walls and dividers that are left on it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import GRID_M, Line, as_line, as_points, as_tuples, polygons_in
from stillroom.maps.meta import MetaDivider
from stillroom.maps.semantics import Clutter, Divider, Ids, Phantom, Room, Wall
from stillroom.pipeline.dividers import SHORTEST_M
from stillroom.pipeline.edits.draft import CUT_BACK, END_M, Draft, fault
from stillroom.pipeline.params import Params

NARROW_M = 0.3
"""What a phantom leaves beside it and is narrower than this goes with it."""
AnyDivider = TypeVar("AnyDivider", Divider, MetaDivider)


def new_phantoms(draft: Draft) -> tuple[Phantom, ...]:
    known = {phantom.id for phantom in draft.previous.phantoms}
    return tuple(phantom for phantom in draft.phantoms if phantom.id not in known)


def cut_phantoms(draft: Draft, floor: MultiPolygon, params: Params) -> tuple[Draft, MultiPolygon]:
    """The floor outside of the batch's new phantoms, and the draft with its dividers cut back to it.

    Scraps that a phantom leaves, too small or too narrow to be a room, go with it: nobody draws along walls to the centimetre.
    """
    phantoms = new_phantoms(draft)
    if not phantoms:
        return draft, floor
    area = shapely.union_all([Polygon(phantom.shape) for phantom in phantoms])
    area = MultiPolygon(polygons_in(shapely.union_all([area, *_scraps(draft.previous.rooms, area, params)])))
    parts = polygons_in(_without_slivers(shapely.difference(floor, area, grid_size=GRID_M), area))
    before = shapely.STRtree(polygons_in(floor))
    kept = [p for p in parts if p.area >= params.room_area_m2 or _is_whole(p, before)]
    if not kept:
        raise fault("/operations", "Nothing would be left of the map.")
    left = shapely.orient_polygons(MultiPolygon(kept))
    on_floor = shapely.buffer(left, END_M, quad_segs=1)
    dividers = _cut_back(draft.dividers, on_floor)
    before = {divider.id: divider.line for divider in draft.dividers}
    cut_now = {d.id: draft.drawn.get(d.id, CUT_BACK) for d in dividers if d.line != before[d.id]}
    there = {d.id for d in dividers}
    shortened = replace(
        draft,
        dividers=dividers,
        meta_dividers=_cut_back(draft.meta_dividers, on_floor),
        drawn={d: pointer for d, pointer in draft.drawn.items() if d in there} | cut_now,
    )
    return shortened, left


def _scraps(rooms: Sequence[Room], area: shapely.Geometry, params: Params) -> list[Polygon]:
    """What is left of rooms of which most goes."""
    polygons = np.array([room.polygon for room in rooms], dtype=object)
    left = shapely.difference(polygons, area, grid_size=GRID_M)
    size, was = shapely.area(left), shapely.area(polygons)
    return polygons_in(left[(size < was / 2) & (size < params.divided_room_m2)])


def _is_whole(part: Polygon, before: shapely.STRtree) -> bool:
    """Whether a part of the floor is as large as it was."""
    (was,) = before.geometries[before.query(part.representative_point(), predicate="within")]
    return bool(part.area > was.area - END_M)


def _without_slivers(floor: shapely.Geometry, area: shapely.Geometry) -> shapely.Geometry:
    wide = shapely.buffer(
        shapely.buffer(floor, -NARROW_M / 2, join_style="mitre"), NARROW_M / 2 + GRID_M, join_style="mitre"
    )
    slivers = [p for p in polygons_in(shapely.difference(floor, wide)) if shapely.distance(p, area) < END_M]
    return shapely.difference(floor, shapely.union_all(slivers), grid_size=GRID_M) if slivers else floor


def _cut_back(dividers: Sequence[AnyDivider], on_floor: shapely.Geometry) -> tuple[AnyDivider, ...]:
    """The longest part of each that lies on the floor; without it, a divider goes."""
    kept: list[AnyDivider] = []
    for divider in dividers:
        line = LineString(divider.line)
        parts = shapely.get_parts(shapely.intersection(line, on_floor))
        longest = max(parts, key=lambda part: float(part.length), default=line)
        if longest.length >= line.length - END_M / 2:
            kept.append(divider)
        elif longest.length >= SHORTEST_M:
            kept.append(replace(divider, line=_same_way(divider.line, longest)))
    return tuple(kept)


def _same_way(line: Line, part: LineString) -> Line:
    """The ends of a part of a line, in the line's own direction."""
    ends = as_points(shapely.get_coordinates(part))[[0, -1]]
    along = as_points(line)[1] - as_points(line)[0]
    return as_line(np.round(ends if (ends[1] - ends[0]) @ along > 0 else ends[::-1], 3))


def walls_of(walls: Sequence[Wall], floor: MultiPolygon, ids: Ids) -> tuple[tuple[Wall, ...], Ids]:
    """What is left of the walls around the floor; where a phantom was cut off, it is open to the unknown."""
    outline = shapely.boundary(floor)
    near = shapely.buffer(outline, END_M, quad_segs=1)
    (version,), ids = ids.take("v")
    kept: list[Wall] = []
    for wall in walls:
        line = LineString(wall.line)
        if shapely.covers(near, line):
            kept.append(wall)
            continue
        parts = _lines(shapely.intersection(line, near))
        kept += [
            replace(wall, id=wall.id if not n else f"{wall.id}-{version[1:]}-{n}", line=as_tuples(part))
            for n, part in enumerate(parts)
        ]
    known = shapely.buffer(shapely.MultiLineString([w.line for w in kept]), END_M, quad_segs=1)
    fresh = _lines(shapely.difference(outline, known))
    opened = [Wall(f"w{version[1:]}-{n}", as_tuples(np.round(part, 4)), "open") for n, part in enumerate(fresh, 1)]
    return (*kept, *opened), ids


def _lines(geometry: shapely.Geometry) -> list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    """The lines in a geometry that are long enough to see, longest first, each an array of shape (n, 2)."""
    merged = shapely.line_merge(geometry) if geometry.geom_type == "MultiLineString" else geometry
    parts = [p for p in shapely.get_parts(merged) if isinstance(p, LineString) and p.length > END_M]
    return [as_points(shapely.get_coordinates(p)) for p in sorted(parts, key=lambda p: -p.length)]


def clutter_on(clutter: Sequence[Clutter], floor: MultiPolygon) -> tuple[Clutter, ...]:
    return tuple(c for c in clutter if shapely.intersects(c.polygon, floor))
