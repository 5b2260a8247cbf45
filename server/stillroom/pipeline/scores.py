"""How well each previous room was carried over: precision and recall (paper, section IV)."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import shapely
from shapely import LineString

from stillroom.maps.geometry import polygons_in
from stillroom.maps.semantics import Room, SemanticMap
from stillroom.pipeline.params import Params

NOTHING: Mapping[str, float] = MappingProxyType({})
EDGE_M = 0.05
FRONTIER_M = 0.5
"""So much of the border to unexplored space must lie along new floor."""


@dataclass(frozen=True)
class RoomScore:
    """How well one previous room was carried over: overlap C, only previous A, only candidate B; precision C/(B+C), recall C/(A+C).

    Floor beyond a border to what was unexplored counts for neither: the previous map said nothing about it.
    """

    id: str
    name: str
    precision: float
    recall: float
    passed: bool
    visited: bool = True


def score_rooms(
    tracked: SemanticMap,
    candidate: SemanticMap,
    visited: Collection[str],
    params: Params,
    common: Mapping[str, float] = NOTHING,
) -> tuple[RoomScore, ...]:
    """One score for each previous room; `tracked` holds them where tracking and alignment put them in the candidate's frame.

    Exactly `params.room_overlap` fails. A room that this mission did not visit has to keep its shape as well. `common`: overlaps C that
    are known already, by room, square metres.
    """
    scores = []
    for room in tracked.rooms:
        now = candidate.room(room.id)
        overlap = 0.0 if now is None else common.get(room.id) or shapely.intersection(room.polygon, now.polygon).area
        precision = 0.0 if now is None else overlap / now.polygon.area
        if now is not None and precision <= params.room_overlap:
            precision = overlap / (now.polygon.area - explored_m2(room, now, tracked))
        recall = overlap / room.polygon.area
        seen = room.id in visited
        passed = precision > params.room_overlap and recall > params.room_overlap
        scores.append(RoomScore(room.id, room.name, precision, recall, passed, seen))
    return tuple(scores)


def explored_m2(room: Room, now: Room, tracked: SemanticMap) -> float:
    """How much of a room's floor lies in no room of the tracked map, beyond the room's own border to what was unexplored."""
    frontier = [LineString(wall.line) for wall in tracked.walls if wall.kind == "open"]
    edge = shapely.intersection(shapely.MultiLineString(frontier), shapely.buffer(room.polygon, EDGE_M))
    grown = polygons_in(shapely.difference(now.polygon, shapely.union_all([r.polygon for r in tracked.rooms])))
    beyond = shapely.length(shapely.intersection(shapely.buffer(grown, EDGE_M), edge)) > FRONTIER_M if grown else []
    return float(sum(part.area for part, past in zip(grown, beyond, strict=True) if past))
