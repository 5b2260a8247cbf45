"""How corrections of the meta layer stand: which were there before, since when, and how often the robot sensed the opposite.

The layer is made anew at each mission; only what it is called is carried over.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
import shapely
from shapely import LineString

from stillroom.maps.geometry import polygons_in
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.meta import MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import Divider, Ids, SemanticMap
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.transfer import Transfer

Correction = TypeVar("Correction", MetaOccupancy, MetaDivider)

AROUND_M = 0.15
SAME_PLACE = 0.5
"""A correction stood there before where one covers this share of it, both with a margin."""
CONTRADICTED = 0.5
"""Share of a correction on which the opposite was sensed."""
BESIDE_M = 0.30
ALONG = 0.7
"""A meta-divider stands for a divider where this share of both lies that near."""


def restore_dividers(transfer: Transfer) -> Transfer:
    """Dividers that found no wall to end on, but along which a meta-divider runs now: that is where they are."""
    candidate, lost = transfer.candidate, list(transfer.lost_dividers)
    left = list(candidate.meta.dividers)
    restored: list[Divider] = []
    for divider in [d for d in transfer.tracked.dividers if d.id in lost]:
        around = shapely.buffer(LineString(divider.line), BESIDE_M)
        along = [d for d in left if shapely.length(shapely.intersection(d.shape, around)) > ALONG * d.shape.length]
        longest = max(along, key=lambda d: d.shape.length, default=None)
        if longest is not None and longest.shape.length > ALONG * LineString(divider.line).length:
            left.remove(longest)
            lost.remove(divider.id)
            restored.append(replace(divider, line=longest.line, rooms=longest.rooms))
    meta = replace(candidate.meta, dividers=tuple(left))
    candidate = replace(candidate, dividers=(*candidate.dividers, *restored), meta=meta)
    return replace(transfer, candidate=candidate, lost_dividers=tuple(lost))


def name_corrections(candidate: SemanticMap, before: MapMeta, mission: Mission) -> SemanticMap:
    """The candidate with ids for its corrections: one that stood in its place before keeps its id, and since when it stands.

    `before` is the previous meta layer, tracked.
    """
    occupancy, ids = _named(candidate.meta.occupancy, before.occupancy, "o", mission, candidate.ids)
    dividers, ids = _named(candidate.meta.dividers, before.dividers, "m", mission, ids)
    meta = replace(candidate.meta, occupancy=occupancy, dividers=dividers)
    return replace(candidate, meta=meta, ids=ids)


def _named(
    found: Sequence[Correction], before: Sequence[Correction], kind: str, mission: Mission, ids: Ids
) -> tuple[tuple[Correction, ...], Ids]:
    fresh, ids = ids.take(kind, len(found))
    left = list(before)
    named = []
    for correction, new_id in zip(found, fresh, strict=True):
        around = shapely.buffer(correction.shape, AROUND_M)
        shares = [shapely.intersection(around, shapely.buffer(old.shape, AROUND_M)).area / around.area for old in left]
        best = int(np.argmax(shares)) if shares and max(shares) > SAME_PLACE else None
        old = correction if best is None else left.pop(best)
        named.append(
            replace(
                correction,
                id=old.id or new_id,
                since=old.since or mission.id,
                contradicted=old.contradicted + _is_contradicted(correction, mission.grid),
            )
        )
    return tuple(named), ids


def _is_contradicted(correction: MetaOccupancy | MetaDivider, grid: OccupancyGrid) -> bool:
    """Whether the robot sensed the opposite on most of it."""
    is_line = isinstance(correction, MetaDivider)
    place = shapely.buffer(correction.shape, grid.frame.resolution, cap_style="flat") if is_line else correction.shape
    cells = cells_in(polygons_in(place), grid.frame)
    opposite = grid.occupied if isinstance(correction, MetaOccupancy) and correction.cell == "free" else grid.free
    return bool(np.count_nonzero(cells & opposite) > CONTRADICTED * max(int(np.count_nonzero(cells)), 1))
