"""Discovery (paper, section V): floor that was no room before gets dividers of its own, and new rooms are made of it.

A wall that stood between a room and new floor is where the divider belongs; inside the new floor dividers are estimated as in a first map.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import Line, as_line, as_points, polygons_in
from stillroom.maps.grid import Mask, look_up
from stillroom.maps.meta import Declined, MetaOccupancy
from stillroom.maps.semantics import Divider
from stillroom.pipeline.declined import elsewhere
from stillroom.pipeline.evidence import grown
from stillroom.pipeline.gaps import Gap, find_gaps
from stillroom.pipeline.obstacles import filled
from stillroom.pipeline.params import Params
from stillroom.pipeline.resolution import Attempt, meta_walls
from stillroom.pipeline.rooms import partition, rooms_beside
from stillroom.pipeline.segmentation import propose_dividers
from stillroom.pipeline.transfer import Transfer, enclosure
from stillroom.pipeline.walls import without_small

JITTER_M = 0.15
"""The outline of a room comes out otherwise by up to this from mission to mission."""
SHOWN = 0.8
"""So much of new floor, at the least, is on cells of new floor: its outline is straightened."""
NEW = 0.7
"""A piece of floor of which more than this share is new is a new room."""
BESIDE_M = 0.35
"""A gap this near to new floor leads to it."""
STRAIGHT = 1.3
"""A gap is straight where its path is no longer than this many times from end to end."""
JAMB_M = 0.35
HELD = 0.8
"""Share of that length beyond a gap's end on which the wall goes on."""
MOVED = 0.5
"""Furniture hides at least so much floor where it stands now as it set free."""
BEHIND_M = 0.8
WIDER_M = 0.25
"""A room is wider than its doorway by this within that distance, on both sides together."""
SAME_M = 0.5
"""Dividers whose middles are nearer than this are one: both faces of a wall have a gap where there is a door."""


@dataclass(frozen=True)
class Discovery:
    """`dividers` part rooms from new floor that is a room too; `corrections` close walls towards what was only seen from afar."""

    dividers: tuple[Divider, ...] = ()
    corrections: tuple[MetaOccupancy, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.dividers or self.corrections)


def discover(attempt: Attempt, declined: Sequence[Declined], params: Params) -> Discovery:
    """What to do about floor that lies beyond all tracked rooms; nothing where a person `declined` it."""
    transfer = attempt.transfer
    regions = new_floor(transfer, params)
    if not regions:
        return Discovery()
    walls = [as_points(wall.line) for wall in transfer.tracked.walls if wall.kind != "open"]
    gaps = find_gaps(walls, ~transfer.obstacles.floor, transfer.grid.frame, params)
    dividers: list[Line] = []
    corrections: list[MetaOccupancy] = []
    for region in regions:
        beside = [gap for gap in gaps if shapely.dwithin(LineString(gap.path), region, BESIDE_M)]
        enclosed = enclosure(region, transfer.tracked, transfer.grid, params) >= params.room_enclosure
        if enclosed and region.area >= params.room_area_m2 and not was_furniture(region, transfer, params):
            doorways = [as_line(gap.path[[0, -1]]) for gap in beside if is_doorway(gap, region, transfer, params)]
            dividers += [line for line in doorways if _is_elsewhere(line, dividers)]
            known = [d.line for d in transfer.candidate.dividers]
            dividers += _estimated(region, [*known, *dividers], transfer, params)
        elif not enclosed:
            # seen through a window, or a doorway only: it fans out into the unexplored
            corrections += meta_walls(beside, transfer.grid.frame, params)
    allowed = elsewhere([LineString(line) for line in dividers], declined) if declined else [True] * len(dividers)
    found = (Divider("", line) for line, allow in zip(dividers, allowed, strict=True) if allow)
    return Discovery(tuple(found), tuple(corrections))


def new_floor(transfer: Transfer, params: Params) -> list[Polygon]:
    """The parts of the floor that no tracked room covered, too wide to be jitter."""
    frame = transfer.grid.frame
    beyond = transfer.obstacles.floor & ~grown(transfer.before, JITTER_M, frame)
    if not without_small(beyond, SHOWN * params.growth_area_m2 / frame.resolution**2).any():
        return []
    known = shapely.union_all([room.polygon for room in transfer.tracked.rooms])
    beyond_known = polygons_in(shapely.difference(transfer.floor, shapely.buffer(known, JITTER_M)))
    large = MultiPolygon([part for part in beyond_known if part.area >= params.growth_area_m2])
    parts = polygons_in(shapely.buffer(large, -JITTER_M / 2, join_style="mitre"))
    regions = [shapely.buffer(part, JITTER_M / 2, join_style="mitre") for part in parts]
    return [part for part in polygons_in(regions) if part.area >= params.growth_area_m2]


def was_furniture(region: Polygon, transfer: Transfer, params: Params) -> bool:
    """Whether something that stood on the new floor stands in the room beside it now: so much of what was floor there is not in sight."""
    if region.area > params.furniture_area_m2:
        return False
    visited = [room.polygon for room in transfer.tracked.rooms if room.id in transfer.visited]
    beside = [polygon for polygon in visited if shapely.dwithin(polygon, region, BESIDE_M)]
    hidden = filled(beside, transfer.grid.frame) & transfer.grid.unexplored
    return bool(np.count_nonzero(hidden) * transfer.grid.frame.resolution**2 > MOVED * region.area)


def is_doorway(gap: Gap, region: Polygon, transfer: Transfer, params: Params) -> bool:
    """Whether a gap in a wall leads to another room, the new floor behind it.

    Where furniture was taken for a wall and has gone, what was under it is no wider than the gap, or the wall does not go on straight
    beyond both of its ends. More floor than furniture covers was not under any, however ragged the wall.
    """
    detour = float(np.linalg.norm(np.diff(gap.path, axis=0), axis=1).sum())
    if not gap.bounded or not params.door_width_m < gap.chord_m <= params.divider_length_m[1]:
        return False
    if detour > STRAIGHT * gap.chord_m or not _widens(gap, region):
        return False
    return region.area > params.furniture_area_m2 or min(_held(as_line(gap.path[[0, -1]]), transfer)) > HELD


def _widens(gap: Gap, region: Polygon) -> bool:
    """Whether the region is wider, close behind a gap, than the gap."""
    ends = gap.path[[0, -1]]
    along = (ends[1] - ends[0]) / max(gap.chord_m, 1e-9)
    aside = BEHIND_M * np.array([-along[1], along[0]])
    ends = ends + BEHIND_M * np.array([-along, along])
    behind = shapely.intersection(region, Polygon([*(ends - aside), *(ends + aside)[::-1]]))
    stations = (shapely.get_coordinates(behind) - gap.path[0]) @ along
    return bool(np.ptp([0.0, gap.chord_m, *stations]) > gap.chord_m + WIDER_M)


def _held(line: Line, transfer: Transfer) -> tuple[float, float]:
    """Share of `JAMB_M` beyond each end of a line on which there is wall."""
    frame = transfer.grid.frame
    ends = as_points(line)
    along = (ends[1] - ends[0]) / max(float(np.hypot(*(ends[1] - ends[0]))), 1e-9)
    steps = np.arange(0.0, JAMB_M, frame.resolution / 2)[:, None]
    wall = cv2.dilate(transfer.obstacles.wall.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    begin, end = (look_up(wall, frame.to_cells(p), False) for p in (ends[0] - steps * along, ends[1] + steps * along))
    return float(begin.mean()), float(end.mean())


def _estimated(region: Polygon, known: Sequence[Line], transfer: Transfer, params: Params) -> list[Line]:
    """Automatic dividers that part new rooms from each other, or from what was known: those in a wall that goes on beyond both ends."""
    whole = [part for part in transfer.floor.geoms if shapely.intersects(part, region)]
    mask: Mask = transfer.obstacles.floor & filled(whole, transfer.grid.frame)
    lines = propose_dividers(MultiPolygon(whole), mask, transfer.grid.frame, params)
    lines = tuple(line for line in lines if _is_elsewhere(line, known))
    pieces = partition(MultiPolygon(whole), [*known, *lines])
    rooms = shapely.union_all([room.polygon for room in transfer.tracked.rooms])
    area = shapely.area(list(pieces))
    new = (shapely.area(shapely.difference(list(pieces), rooms)) > NEW * area) & (area >= params.room_area_m2)
    wanted = []
    for line, sides in zip(lines, rooms_beside(lines, pieces), strict=True):
        news = sum(bool(new[side]) for side in sides[:2])
        scrap = any(area[side] < params.room_area_m2 for side in sides[:2])
        if len(sides) > 1 and not scrap and (news == 2 or (news == 1 and min(_held(line, transfer)) > HELD)):
            wanted.append(line)
    return wanted


def _is_elsewhere(line: Line, others: Sequence[Line]) -> bool:
    middle = as_points(line).mean(0)
    return all(np.hypot(*(as_points(other).mean(0) - middle)) > SAME_M for other in others)
