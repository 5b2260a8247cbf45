"""Conflict resolution (paper, section IV): corrections in the meta layer until every previous room is back, and no more than it takes.

Each step is followed by a fresh transfer. The robot's grid is never altered: corrections are polygons and lines of the meta layer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, Polygon

from stillroom.maps.geometry import GRID_M, as_line, as_points, polygons_in
from stillroom.maps.grid import GridFrame, OccupancyGrid
from stillroom.maps.meta import MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.semantics import Room
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.gaps import Gap, find_gaps
from stillroom.pipeline.obstacles import band, filled
from stillroom.pipeline.params import Params
from stillroom.pipeline.rooms import overlaps
from stillroom.pipeline.scores import RoomScore
from stillroom.pipeline.transfer import Transfer
from stillroom.pipeline.walls import clutter_features

ResolverName = Literal["meta_occupancy", "meta_dividers"]

ADJOINS_M = 0.30
"""A correction this near to a room adjoins it."""
CUT_OFF_M2 = 0.25
"""Counted without a rim of the classification distance."""
LEAP_M = 0.15
"""A boundary that leaps by more than this from one obstacle to another has a way between them."""
STRAIGHT_M = 0.02
"""A path of meta-dividers is straightened by up to this."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A transfer and how well each previous room came through it."""

    transfer: Transfer
    scores: tuple[RoomScore, ...]
    sensed: OccupancyGrid
    """Without the meta-occupancy that the transfer's grid has."""

    @property
    def meta(self) -> MapMeta:
        return self.transfer.candidate.meta

    @property
    def failed(self) -> frozenset[str]:
        return frozenset(score.id for score in self.scores if not score.passed)

    def failed_rooms(self) -> tuple[Room, ...]:
        """As they were tracked."""
        return tuple(room for room in self.transfer.tracked.rooms if room.id in self.failed)


Retry = Callable[[MapMeta], Attempt]
"""A fresh transfer of the same mission with that meta layer."""
Resolver = Callable[[Attempt, Retry, Params], Attempt]


def resolve_conflicts(
    first: Attempt, retry: Retry, resolvers: Sequence[ResolverName], params: Params
) -> dict[ResolverName, Attempt]:
    """What came of each resolver, in order, each on top of the one before; those after one that settled all are not tried."""
    attempts: dict[ResolverName, Attempt] = {}
    best = first
    for name in resolvers:
        if best.failed:
            best = STEPS[name](best, retry, params)
            attempts[name] = best
    return attempts


def meta_occupancy(attempt: Attempt, retry: Retry, params: Params) -> Attempt:
    """Adds back small sections that were wall and are none any more, then those that were free and are wall, beside failed rooms."""
    for differences in (wall_differences, free_differences):
        for _ in range(ROUNDS):
            found = differences(attempt, params) if attempt.failed else ()
            if not found:
                break
            tried = retry(replace(attempt.meta, occupancy=(*attempt.meta.occupancy, *found)))
            if not _is_better(tried, attempt):
                break
            attempt = tried
    return attempt


def meta_dividers(attempt: Attempt, retry: Retry, params: Params) -> Attempt:
    """Adds the tracked boundary of lost rooms, then keeps of it what parts rooms that no wall and no divider parts.

    Where that takes long lines over free floor, the boundary of the rooms that they ran into may take shorter ones: where furniture
    moved, a lost room's boundary is not where its walls are.
    """
    for _ in range(ROUNDS):
        if not attempt.failed:
            break
        parted = _parted(attempt, attempt.failed_rooms(), retry)
        if parted is None or _length(parted) > params.meta_length_m:
            others = ran_into(attempt)
            instead = _parted(attempt, others, retry) if others else None
            parted = min((p for p in (parted, instead) if p), key=lambda p: (len(p.failed), _length(p)), default=None)
        if parted is None:
            break
        attempt = parted
    return attempt


def _parted(attempt: Attempt, rooms: Sequence[Room], retry: Retry) -> Attempt | None:
    """With what it takes of the tracked boundary of these rooms; None where that brings no room back."""
    tried = retry(replace(attempt.meta, dividers=(*attempt.meta.dividers, *tracked_boundary(rooms))))
    if not _is_better(tried, attempt):
        return None
    kept = retry(replace(tried.meta, dividers=parting(tried)))
    return None if kept.failed - tried.failed else kept


def ran_into(attempt: Attempt) -> tuple[Room, ...]:
    """As they were tracked, the rooms that are where failed ones should be."""
    lost, rooms = attempt.failed_rooms(), attempt.transfer.candidate.rooms
    common = overlaps([room.polygon for room in lost], [room.polygon for room in rooms])
    there = {rooms[int(row.argmax())].id for row in common if row.any()} - attempt.failed
    return tuple(room for room in attempt.transfer.tracked.rooms if room.id in there)


def _length(attempt: Attempt) -> float:
    """Of all meta-dividers, metres."""
    return float(sum(d.shape.length for d in attempt.meta.dividers))


ROUNDS = 2
"""A room that comes back may show another that fails."""
STEPS: dict[ResolverName, Resolver] = {"meta_occupancy": meta_occupancy, "meta_dividers": meta_dividers}


def _is_better(tried: Attempt, before: Attempt) -> bool:
    """Whether rooms came back, and none was lost for them."""
    return tried.failed < before.failed


# -- meta-occupancy ------------------------------------------------------------------------------------------------


def wall_differences(attempt: Attempt, params: Params) -> tuple[MetaOccupancy, ...]:
    """Sections of the tracked walls that are no wall now, small and beside failed rooms."""
    transfer = attempt.transfer
    walls = [as_points(wall.line) for wall in transfer.tracked.walls if wall.kind != "open"]
    gaps = find_gaps(walls, transfer.obstacles.wall, transfer.grid.frame, params, LEAP_M)
    sections = meta_walls(gaps, transfer.grid.frame, params)
    rooms = [room.polygon for room in attempt.failed_rooms()]
    return tuple(s for s in sections if shapely.dwithin(s.polygon, rooms, ADJOINS_M).any())


def meta_walls(gaps: Sequence[Gap], frame: GridFrame, params: Params) -> tuple[MetaOccupancy, ...]:
    """Gaps as occupied polygons, connected components of all of them, those that are small."""
    half = max(0.75 * frame.resolution, params.meta_thickness_m / 2)
    # the two faces of one wall are one section
    between = params.meta_thickness_m + frame.resolution
    with np.errstate(divide="ignore", invalid="ignore"):  # GEOS tries mitres of edges that go on almost straight
        drawn = [shapely.buffer(LineString(gap.path), half, cap_style="square", join_style="mitre") for gap in gaps]
        closed = shapely.buffer(shapely.union_all(drawn), between, join_style="mitre")
        sections = polygons_in(shapely.buffer(closed, -between, join_style="mitre"))
    return tuple(
        MetaOccupancy("", section, "occupied", "") for section in sections if _extent(section) <= params.meta_length_m
    )


def free_differences(attempt: Attempt, params: Params) -> tuple[MetaOccupancy, ...]:
    """What is wall now well inside a failed room as it was tracked, where it is small: as free polygons."""
    return _opened(attempt.failed_rooms(), attempt, params)


def _opened(rooms: Sequence[Room], attempt: Attempt, params: Params) -> tuple[MetaOccupancy, ...]:
    transfer = attempt.transfer
    frame = transfer.grid.frame
    inside = filled([room.polygon for room in rooms], frame)
    along = band([as_points(wall.line) for wall in transfer.tracked.walls], params.wall_offset_m, frame)
    sections = clutter_features(transfer.obstacles.wall & inside & ~along, frame, "", params)
    return tuple(
        MetaOccupancy("", section.polygon, "free", "")
        for section in sections
        if section.polygon.area <= params.meta_area_m2 and _extent(section.polygon) <= params.meta_length_m
    )


def rejoin(attempt: Attempt, retry: Retry, params: Params) -> Attempt:
    """Opens what cuts off a part of a room that passed: small obstacles that the robot could not get past are no walls."""
    cut = cut_off(attempt, params)
    found = _opened([room for room in attempt.transfer.tracked.rooms if room.id in cut], attempt, params) if cut else ()
    if not found:
        return attempt
    tried = retry(replace(attempt.meta, occupancy=(*attempt.meta.occupancy, *found)))
    return tried if not tried.failed - attempt.failed and cut_off(tried, params) < cut else attempt


def cut_off(attempt: Attempt, params: Params) -> frozenset[str]:
    """Rooms of which a part that is wide enough to be no jitter is in no room any more, or in a new one."""
    before = {room.id: room.polygon for room in attempt.transfer.tracked.rooms}
    now = {room.id: room.polygon for room in attempt.transfer.candidate.rooms if room.id in before}

    def lost(id_: str, still: shapely.Geometry) -> bool:
        beyond = shapely.difference(before[id_], still)
        return bool(shapely.buffer(beyond, -params.wall_classification_m).area > CUT_OFF_M2)

    less = [s.id for s in attempt.scores if (1 - s.recall) * before[s.id].area > CUT_OFF_M2]
    # what a room lost to others is seldom wide: then nobody has to know where all of them are
    less = [id_ for id_ in less if lost(id_, now.get(id_, Polygon()))]
    still = shapely.union_all([*now.values()]) if less else Polygon()
    return frozenset(id_ for id_ in less if lost(id_, still))


def _extent(polygon: Polygon) -> float:
    """The longer side of the smallest rectangle around it, metres."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon))
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max())


# -- meta-dividers -------------------------------------------------------------------------------------------------


def tracked_boundary(rooms: Sequence[Room]) -> tuple[MetaDivider, ...]:
    """The whole tracked boundary of each room, segment by segment."""
    return _segments(shapely.union_all([room.polygon.exterior for room in rooms], grid_size=GRID_M))


def parting(attempt: Attempt) -> tuple[MetaDivider, ...]:
    """What lies between different rooms and is no divider, as straight segments from wall to wall."""
    candidate = attempt.transfer.candidate
    rooms = [room.polygon for room in candidate.rooms]
    dividers = shapely.buffer(
        shapely.MultiLineString([d.line for d in candidate.dividers]), 2 * GRID_M, cap_style="flat"
    )
    first, second = shapely.STRtree(rooms).query(rooms, predicate="intersects")
    pairs = [(i, j) for i, j in zip(first.tolist(), second.tolist(), strict=True) if i < j]
    edges = [shapely.intersection(rooms[i].boundary, rooms[j].boundary) for i, j in pairs]
    shared = shapely.difference(shapely.union_all(edges), dividers)
    return _segments(shapely.simplify(shapely.line_merge(shared), STRAIGHT_M))


def _segments(lines: shapely.Geometry) -> tuple[MetaDivider, ...]:
    merged = [part for part in shapely.get_parts(shapely.line_merge(lines)) if part.geom_type == "LineString"]
    return tuple(
        MetaDivider("", as_line(points[k : k + 2]), (), "")
        for points in (np.round(shapely.get_coordinates(part), 3) for part in merged)
        for k in range(len(points) - 1)
        if np.hypot(*(points[k + 1] - points[k])) > GRID_M / 2
    )


# -- as little as possible -----------------------------------------------------------------------------------------


def settle(
    attempt: Attempt,
    retry: Retry,
    resolvers: Sequence[ResolverName],
    params: Params,
    keep: Sequence[MetaOccupancy] = (),
) -> Attempt:
    """The attempt with no more corrections than it takes, and no room in parts."""
    least = minimise(attempt, retry, keep)
    return rejoin(least, retry, params) if "meta_occupancy" in resolvers else least


def minimise(attempt: Attempt, retry: Retry, keep: Sequence[MetaOccupancy] = ()) -> Attempt:
    """Without the corrections that part nothing, but for those to `keep`: the less the map disagrees with the robot, the better."""
    if attempt.failed or not attempt.meta.corrects:
        return attempt
    wanted = needed(attempt, keep)
    for _ in range(ROUNDS):
        if wanted == attempt.meta:
            break
        tried = retry(wanted)
        if not tried.failed:
            return tried
        lost = [room.polygon for room in tried.failed_rooms()]
        back = [o for o in attempt.meta.occupancy if shapely.dwithin(o.polygon, lost, ADJOINS_M).any()]
        wanted = replace(
            wanted, occupancy=tuple(o for o in attempt.meta.occupancy if o in wanted.occupancy or o in back)
        )
    return attempt


def needed(attempt: Attempt, keep: Sequence[MetaOccupancy] = ()) -> MapMeta:
    """The corrections without which different rooms would be one, and those that open the floor."""
    transfer = attempt.transfer
    frame = transfer.grid.frame
    rooms = np.zeros((frame.height, frame.width), np.int32)
    for number, room in enumerate(transfer.candidate.rooms, 1):
        rooms[cells_in([room.polygon], frame)] = number
    occupancy = [
        o for o in attempt.meta.occupancy if o.cell == "free" or o in keep or _parts(o.polygon, rooms, attempt)
    ]
    dividers = tuple(d for d in attempt.meta.dividers if len(d.rooms) > 1)
    return replace(attempt.meta, occupancy=tuple(occupancy), dividers=dividers)


def _parts(polygon: Polygon, rooms: npt.NDArray[np.int32], attempt: Attempt) -> bool:
    """Whether what is no obstacle under a correction borders on more than one room. `rooms`: numbers by cell, 0 where there is none."""
    frame = attempt.transfer.grid.frame
    cells = frame.to_cells(shapely.get_coordinates(polygon.exterior))
    left, low = np.maximum(np.floor(cells.min(0)).astype(int) - 2, 0).tolist()
    right, high = (np.ceil(cells.max(0)).astype(int) + 3).tolist()
    window = (slice(low, high), slice(left, right))
    open_ = (cells_in([polygon], frame) & ~attempt.sensed.occupied)[window]
    count, labels = cv2.connectedComponents(open_.view(np.uint8), connectivity=4)
    # a room's edge is straightened, and may be a cell away
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    for label in range(1, count):
        beside = cv2.dilate((labels == label).view(np.uint8), disc) > 0
        if len(np.setdiff1d(rooms[window][beside], [0])) > 1:
            return True
    return False
