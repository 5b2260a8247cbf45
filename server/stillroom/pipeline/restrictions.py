"""Restrictions move with the map, keep their shape, and are never silently weakened: one that can't be placed is kept and says so."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, Polygon

from stillroom.maps.geometry import Points, as_points, as_tuples, fit_pose
from stillroom.maps.grid import GridFrame
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Restriction, RestrictionKind, Room

STRAIN_M = 0.25
"""Where the map under a restriction moved apart by more than this, there is no telling where it belongs."""
LOST_SHARE = 0.3
"""Nor where more than this share of it lies in other rooms than before."""
SMALLEST_M2 = 0.01
SHORTEST_M = 0.05


def faults_of(kind: RestrictionKind, shape: Points, frame: GridFrame) -> str | None:
    """What is wrong with a drawn restriction, in words; None where nothing is. `shape`: (n, 2), metres, first point not repeated."""
    if not np.isfinite(shape).all():
        return "Coordinates are finite numbers."
    if kind == "virtual_wall":
        if len(shape) != 2 or float(np.hypot(*(shape[1] - shape[0]))) < SHORTEST_M:
            return "A virtual wall is a line of two different points."
    else:
        ring = Polygon(shape) if len(shape) >= 3 else Polygon()
        if not ring.is_valid or ring.area < SMALLEST_M2:
            return "A zone is a ring of three or more points that doesn't cross itself."
    cells = frame.to_cells(shape)
    if (cells.max(0) < 0).any() or (cells.min(0) > (frame.width, frame.height)).any():
        return "The restriction lies off the map."
    return None


def carry_restrictions(
    restrictions: Sequence[Restriction], motion: Motion, before: Sequence[Room], after: Sequence[Room], frame: GridFrame
) -> tuple[Restriction, ...]:
    """Each restriction moved as one rigid shape with the ground under it, and whether it is placed.

    It is placed where it still lies in the rooms it lay in; once lost, it stays so until a person draws it again.
    `before` are the previous map's rooms, `after` those of the new map with `frame`.
    """
    return tuple(_carry(restriction, motion, before, after, frame) for restriction in restrictions)


def _carry(
    restriction: Restriction, motion: Motion, before: Sequence[Room], after: Sequence[Room], frame: GridFrame
) -> Restriction:
    shape = as_points(restriction.shape)
    target = motion.apply(shape)
    moved = fit_pose(shape, target).apply(shape)
    strained = float(np.linalg.norm(moved - target, axis=1).max()) > STRAIN_M
    then, now = _shares(shape, restriction.kind, before), _shares(moved, restriction.kind, after)
    lost = sum(max(0.0, share - now.get(room, 0.0)) for room, share in then.items())
    placed = (
        restriction.placed and not strained and lost <= LOST_SHARE and faults_of(restriction.kind, moved, frame) is None
    )
    return replace(restriction, shape=as_tuples(np.round(moved, 4)), placed=placed)


def _shares(shape: Points, kind: RestrictionKind, rooms: Sequence[Room]) -> dict[str, float]:
    """The part of a restriction that lies in each room, of what lies in any."""
    figure = LineString(shape) if kind == "virtual_wall" else Polygon(shape)
    measure = shapely.length if kind == "virtual_wall" else shapely.area
    parts = {room.id: float(measure(shapely.intersection(figure, room.polygon))) for room in rooms}
    total = sum(parts.values())
    return {room: part / total for room, part in parts.items() if part > 0}
