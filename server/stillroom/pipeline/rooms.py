"""Rooms from walls and dividers: the floor's outline cut along dividers, so that neighbours share the very edge that divides them."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import GRID_M, Line, polygons_in
from stillroom.maps.semantics import Ids, Room

BESIDE_M = 0.03
"""Where to look for the room beside a divider."""
SEGMENTS_A_MAP = 10_000
"""Segment ids of a robot's second map begin here, so that one small number never names two rooms of a robot."""
STATIONS = np.linspace(0.08, 0.92, 8)


def partition(floor: MultiPolygon, lines: Sequence[Line], smallest_m2: float = 0.0) -> tuple[Polygon, ...]:
    """The pieces of `floor` between `lines`, largest first: valid, disjoint, with common vertices where they meet.

    Snap rounding makes a corner of each divider's end that lies on an edge, however its coordinates were rounded.
    Pieces below `smallest_m2` join the neighbour with the longest common edge; without one they stay.
    """
    if floor.is_empty:
        return ()
    edges = [shapely.boundary(floor), *(LineString(line) for line in lines)]
    noded = shapely.union_all(edges, grid_size=GRID_M)
    faces = polygons_in(shapely.polygonize(shapely.get_parts([noded])))
    inside = shapely.contains(floor, shapely.point_on_surface(faces)) if faces else []
    pieces = [face for face, keep in zip(faces, inside, strict=True) if keep]
    pieces = _join_small(pieces, smallest_m2)
    return tuple(sorted((shapely.orient_polygons(p) for p in pieces), key=lambda p: (-p.area, p.bounds)))


def _join_small(pieces: list[Polygon], smallest_m2: float) -> list[Polygon]:
    """Joins each piece that is too small to the neighbour with the longest common edge."""
    pieces = sorted(pieces, key=lambda p: p.area)
    kept: list[Polygon] = []
    while pieces:
        piece = pieces.pop(0)
        if piece.area >= smallest_m2:
            kept.append(piece)
            continue
        common = shapely.length(shapely.intersection(piece, pieces)) if pieces else np.zeros(0)
        if not len(common) or common.max() < GRID_M:
            kept.append(piece)
            continue
        other = int(common.argmax())
        joined = polygons_in(shapely.union(piece, pieces[other], grid_size=GRID_M))
        pieces[other] = max(joined, key=lambda p: p.area)
        pieces.sort(key=lambda p: p.area)
    return kept


def rooms_beside(lines: Sequence[Line], polygons: Sequence[Polygon]) -> tuple[tuple[int, ...], ...]:
    """For each line the indices of the polygons that it separates, the most touched first; one index where both sides are the same room."""
    if not lines or not polygons:
        return tuple(() for _ in lines)
    ends = np.array(lines, dtype=np.float64)
    along = ends[:, 1] - ends[:, 0]
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / np.maximum(np.hypot(*along.T), 1e-9)[:, None] * BESIDE_M
    middle = ends[:, None, 0] + STATIONS[:, None] * along[:, None]
    samples = np.stack([middle + normal[:, None], middle - normal[:, None]], 1)
    place, polygon = shapely.STRtree(list(polygons)).query(shapely.points(samples.reshape(-1, 2)), predicate="within")
    hits = np.zeros((len(lines) * 2, len(polygons)), np.int64)
    np.add.at(hits, (place // len(STATIONS), polygon), 1)
    return tuple(_touched(left, right) for left, right in hits.reshape(len(lines), 2, -1))


def _touched(left: npt.NDArray[np.int64], right: npt.NDArray[np.int64]) -> tuple[int, ...]:
    """Polygons beside a line, by how many samples on each side lie in each: the main one of both sides, and what is hit twice."""
    both = left + right
    across = {int(side.argmax()) for side in (left, right) if side.any()}
    met = np.flatnonzero(both)
    ranked = met[np.argsort(-both[met], kind="stable")].tolist()
    return tuple(i for i in ranked if i in across or both[i] >= 2)


def overlaps(first: Sequence[Polygon], second: Sequence[Polygon]) -> npt.NDArray[np.float64]:
    """Common area of each pair in square metres, shape (len(first), len(second))."""
    common = np.zeros((len(first), len(second)))
    if not len(first) or not len(second):
        return common
    i, j = shapely.STRtree(list(second)).query(list(first), predicate="intersects")
    common[i, j] = shapely.area(
        shapely.intersection(np.array(first, dtype=object)[i], np.array(second, dtype=object)[j])
    )
    return common


def most_common(rooms: Sequence[Polygon], pieces: Sequence[Polygon]) -> npt.NDArray[np.float64]:
    """As `overlaps`, for disjoint `rooms`; but where one of them has more than half of a piece, what others have of it is left out.

    No other can have more of it then, and most pieces are of one room.
    """
    common = np.zeros((len(rooms), len(pieces)))
    if not len(rooms) or not len(pieces):
        return common
    first, second = np.array(rooms, dtype=object), np.array(pieces, dtype=object)
    i, j = shapely.STRtree(second).query(first, predicate="intersects")
    a, b = shapely.bounds(first)[i], shapely.bounds(second)[j]
    box = (np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2])).prod(1)
    order = np.lexsort((-box, j))
    is_likely = np.zeros(len(j), np.bool_)
    is_likely[order[np.unique(j[order], return_index=True)[1]]] = True
    for chosen in (is_likely, ~is_likely):
        chosen = chosen & (common.max(0) <= shapely.area(second) / 2)[j]
        if chosen.any():
            common[i[chosen], j[chosen]] = shapely.area(shapely.intersection(first[i[chosen]], second[j[chosen]]))
    return common


def absorb(rooms: Sequence[Polygon], pieces: Sequence[Polygon]) -> list[Polygon]:
    """`rooms` with each piece joined to the one with which it has the longest common edge; pieces that touch none are dropped."""
    grown = list(rooms)
    for piece in pieces:
        common = shapely.length(shapely.intersection(piece, grown)) if grown else np.zeros(0)
        if len(common) and common.max() > GRID_M:
            best = int(common.argmax())
            grown[best] = max(polygons_in(shapely.union(grown[best], piece, grid_size=GRID_M)), key=lambda p: p.area)
    return grown


def floor_of(rooms: Sequence[Room]) -> MultiPolygon:
    """The floor that rooms cover together, dividers dissolved."""
    return shapely.orient_polygons(
        MultiPolygon(polygons_in(shapely.union_all([room.polygon for room in rooms], grid_size=GRID_M)))
    )


def new_rooms(polygons: Sequence[Polygon], mission_id: str | None, ids: Ids) -> tuple[tuple[Room, ...], Ids]:
    """Rooms that nobody has named yet, with new ids."""
    fresh, ids = ids.take("r", len(polygons))
    rooms = tuple(
        Room(room_id, f"Room {_number(room_id)}", segment_id(room_id), polygon, last_visited=mission_id, anchor=polygon)
        for room_id, polygon in zip(fresh, polygons, strict=True)
    )
    return rooms, ids


def _number(room_id: str) -> int:
    return int(room_id[1:].rpartition("-")[2])


def segment_id(room_id: str) -> int:
    """The small integer that names a room for home automation: as stable as the id, unique over the robot's maps."""
    ordinal = room_id[1:].rpartition("-")[0]
    return (int(ordinal) - 1 if ordinal else 0) * SEGMENTS_A_MAP + _number(room_id)
