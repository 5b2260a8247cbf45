"""Rooms merged: what divides them from each other goes."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
import shapely
from shapely import LineString, Polygon

from stillroom.maps.geometry import GRID_M, Line, as_points
from stillroom.maps.meta import MetaDivider
from stillroom.maps.semantics import Divider, Ids
from stillroom.pipeline.edits.draft import END_M, Draft, fault
from stillroom.pipeline.rooms import rooms_beside

AnyDivider = TypeVar("AnyDivider", Divider, MetaDivider)


def merge_rooms(draft: Draft, pointer: str, room_ids: Sequence[str]) -> Draft:
    """A divider or meta-divider that goes on along other rooms keeps that part."""
    rooms = [draft.room(f"{pointer}/ids/{i}", room_id) for i, room_id in enumerate(room_ids)]
    if len(set(room_ids)) < 2:
        raise fault(f"{pointer}/ids", "Merging takes at least two rooms.")
    union = shapely.union_all([room.polygon for room in rooms], grid_size=GRID_M)
    if shapely.get_num_geometries(union) > 1:
        raise fault(f"{pointer}/ids", "Rooms that don't touch can't be merged.")
    polygons = [room.polygon for room in draft.previous.rooms]
    merged = {i for i, room in enumerate(draft.previous.rooms) if room.id in set(room_ids)}
    dividers, ids = _shortened(draft.dividers, "d", polygons, merged, draft.ids)
    meta_dividers, ids = _shortened(draft.meta_dividers, "m", polygons, merged, ids)
    return replace(draft, dividers=dividers, meta_dividers=meta_dividers, ids=ids)


def _shortened(
    dividers: Sequence[AnyDivider], kind: str, polygons: Sequence[Polygon], merged: set[int], ids: Ids
) -> tuple[tuple[AnyDivider, ...], Ids]:
    """Dividers without what lies between two of the `merged` rooms."""
    kept: list[AnyDivider] = []
    for divider in dividers:
        segments = _segments(divider.line, polygons)
        beside = rooms_beside(segments, polygons)
        staying = [
            s for s, sides in zip(segments, beside, strict=True) if not (len(sides) > 1 and set(sides) <= merged)
        ]
        if len(staying) == len(segments):
            kept.append(divider)
            continue
        parts = sorted(_joined(staying), key=lambda part: -LineString(part).length)
        for n, part in enumerate(parts):
            name = divider.id
            if n:
                (name,), ids = ids.take(kind)
            kept.append(replace(divider, id=name, line=part))
    return tuple(kept), ids


def _segments(line: Line, polygons: Sequence[Polygon]) -> list[Line]:
    """A divider cut at every corner of a room that lies on it."""
    ends = as_points(line)
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    along = along / length
    corners = shapely.get_coordinates(polygons) - ends[0]
    station, aside = corners @ along, corners @ np.array([-along[1], along[0]])
    on = station[(np.abs(aside) < END_M) & (station > END_M) & (station < length - END_M)]
    stops = np.unique(np.round(np.concatenate([[0.0, length], on]), 3))
    points = [(float(x), float(y)) for x, y in ends[0] + stops[:, None] * along]
    points[0], points[-1] = line
    return list(pairwise(points))


def _joined(segments: Sequence[Line]) -> list[Line]:
    """Consecutive segments of one line made one again."""
    parts: list[Line] = []
    for segment in segments:
        if parts and parts[-1][1] == segment[0]:
            parts[-1] = (parts[-1][0], segment[1])
        else:
            parts.append(segment)
    return parts
