"""Semantic map creation (paper, section II-A): walls, clutter, dividers and rooms of a map without history, by algorithm."""

from collections.abc import Sequence

import shapely
from shapely import MultiPolygon, Polygon

from stillroom.maps.geometry import Line
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import Divider, Ids, Room, SemanticMap
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.rooms import partition, rooms_beside
from stillroom.pipeline.segmentation import propose_dividers
from stillroom.pipeline.walls import clutter_features, distance_to, outline, separate_clutter, wall_features

SEGMENTS_A_MAP = 10_000
"""Segment ids of a robot's second map begin here, so that one small number never names two rooms of a robot."""


def create_map(grid: OccupancyGrid, mission_id: str, ids: Ids, params: Params = PARAMS) -> SemanticMap:
    """Rooms, dividers, walls and clutter of `grid`; new ids are taken from `ids`."""
    obstacles = separate_clutter(grid, params)
    floor = outline(obstacles.floor, grid.frame, params, smallest_m2=params.pocket_area_m2)
    lines = propose_dividers(floor, obstacles.floor, grid.frame, params)
    polygons = partition(floor, lines, params.face_area_m2)
    rooms, ids = new_rooms(polygons, mission_id, ids)
    dividers, ids = new_dividers(lines, rooms, ids)
    (version,), ids = ids.take("v")
    return SemanticMap(
        frame=grid.frame,
        rooms=rooms,
        dividers=dividers,
        walls=wall_features(floor, distance_to(grid.occupied, grid.frame.resolution), grid.frame, version[1:], params),
        clutter=clutter_features(obstacles.clutter, grid.frame, version[1:], params),
        ids=ids,
    )


def new_rooms(polygons: Sequence[Polygon], mission_id: str | None, ids: Ids) -> tuple[tuple[Room, ...], Ids]:
    """Rooms that nobody has named yet, with new ids."""
    fresh, ids = ids.take("r", len(polygons))
    rooms = tuple(
        Room(room_id, f"Room {_number(room_id)}", segment_id(room_id), polygon, last_visited=mission_id)
        for room_id, polygon in zip(fresh, polygons, strict=True)
    )
    return rooms, ids


def _number(room_id: str) -> int:
    return int(room_id[1:].rpartition("-")[2])


def segment_id(room_id: str) -> int:
    """The small integer that names a room for home automation: as stable as the id, unique over the robot's maps."""
    ordinal = room_id[1:].rpartition("-")[0]
    return (int(ordinal) - 1 if ordinal else 0) * SEGMENTS_A_MAP + _number(room_id)


def new_dividers(lines: Sequence[Line], rooms: Sequence[Room], ids: Ids) -> tuple[tuple[Divider, ...], Ids]:
    fresh, ids = ids.take("d", len(lines))
    beside = rooms_beside(lines, [room.polygon for room in rooms])
    dividers = tuple(
        Divider(divider_id, line, rooms=tuple(rooms[i].id for i in sides))
        for divider_id, line, sides in zip(fresh, lines, beside, strict=True)
    )
    return dividers, ids


def floor_of(rooms: Sequence[Room]) -> MultiPolygon:
    """The floor that rooms cover together, dividers dissolved."""
    from stillroom.pipeline.walls import GRID_M, polygons_in

    return shapely.orient_polygons(MultiPolygon(polygons_in(shapely.union_all([room.polygon for room in rooms], grid_size=GRID_M))))
