"""Rooms parted anew: what an edit would have to do for a map to have the dividers that are found at another sensitivity."""

from dataclasses import replace

import numpy as np

from stillroom.maps.geometry import Line, as_points
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.edits.operations import AddDivider, Operation, RemoveDivider
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.rooms import floor_of
from stillroom.pipeline.segmentation import propose_dividers

SAME_M = 0.3
"""Dividers whose ends lie as near to each other as this part the same rooms."""


def suggest_dividers(of: SemanticMap, sensitivity: float, params: Params = PARAMS) -> tuple[Operation, ...]:
    """Operations that take away automatic dividers not found at `sensitivity` (0: as for a first map; higher: more rooms) and draw those that are.

    What people drew stays, and so does what is found again; ids stay with it.
    """
    if not of.rooms:
        return ()
    floor = floor_of(of.rooms)
    mask = cells_in(floor.geoms, of.frame)
    found = propose_dividers(floor, mask, of.frame, replace(params, divider_sensitivity=sensitivity))
    gone = [d.id for d in of.dividers if d.made_by == "algorithm" and not any(_same(d.line, line) for line in found)]
    new = [line for line in found if not any(_same(line, d.line) for d in of.dividers)]
    return (*map(RemoveDivider, gone), *map(AddDivider, new))


def _same(first: Line, second: Line) -> bool:
    a, b = as_points(first), as_points(second)
    return bool(min(np.hypot(*(a - other).T).max() for other in (b, b[::-1])) <= SAME_M)
