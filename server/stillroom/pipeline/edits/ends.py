"""Ends of dividers: those that were drawn find a wall or divider, and none that was not touched loses its own."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, MultiPolygon

from stillroom.errors import Fault
from stillroom.maps.geometry import Line, as_line, as_points
from stillroom.maps.semantics import Divider
from stillroom.pipeline.dividers import Adrift, Outline, attach
from stillroom.pipeline.edits.draft import CUT_BACK, END_M, Draft, faults
from stillroom.pipeline.edits.operations import AddDivider, Fix, MoveDivider, RemoveDivider
from stillroom.pipeline.params import Params

FARTHEST_M = 100.0
"""A wall is offered as a fix however far along the divider's own line it is, up to this."""
OVERSHOOT_M = 0.05


def attach_drawn(draft: Draft, floor: MultiPolygon, params: Params) -> Draft:
    """Gives new and moved dividers their ends. One that ends on another new one is tried again after that."""
    waiting = list(draft.drawn.items())
    settled = {d.id: d.line for d in draft.dividers if d.id not in draft.drawn}
    settled |= {d.id: d.line for d in draft.meta_dividers}
    outline = Outline(floor)
    while waiting:
        adrift: list[tuple[Divider, str, Adrift]] = []
        for divider_id, pointer in waiting:
            divider = draft.divider(pointer, divider_id)
            found = attach(divider.line, outline, list(settled.values()), params.divider_reach_m)
            if isinstance(found, Adrift):
                adrift.append((divider, pointer, found))
            else:
                settled[divider_id] = found.line
                draft = draft.put(replace(divider, line=found.line))
        stubs = {divider.id for divider, pointer, _ in adrift if pointer == CUT_BACK}
        if len(adrift) == len(waiting) and stubs:
            # what a phantom left of a divider, and nobody drew, need not be one
            draft = replace(draft, dividers=tuple(d for d in draft.dividers if d.id not in stubs))
            adrift = [entry for entry in adrift if entry[0].id not in stubs]
        elif len(adrift) == len(waiting):
            lines = list(settled.values())
            fixes = [_extended(draft, divider, pointer, floor, lines) for divider, pointer, _ in adrift]
            raise faults(
                [Fault(f"{p}/line/{found.end}", _adrift(d, found, params)) for d, p, found in adrift],
                [fix for fix in fixes if fix is not None],
            )
        waiting = [(divider.id, pointer) for divider, pointer, _ in adrift]
    return draft


def _adrift(divider: Divider, found: Adrift, params: Params) -> str:
    which = ("first", "second")[found.end]
    x, y = divider.line[found.end]
    if found.gap_m <= params.divider_reach_m:
        return f"Nothing of the divider lies on the floor between two walls (its {which} end is at ({x:.2f}, {y:.2f}))."
    return (
        f"The {which} end of the divider, at ({x:.2f}, {y:.2f}), is {found.gap_m:.2f} m from the nearest wall or divider; "
        f"{params.divider_reach_m:.2f} m is the most."
    )


def _extended(draft: Draft, divider: Divider, pointer: str, floor: MultiPolygon, others: Sequence[Line]) -> Fix | None:
    """The same divider with each loose end drawn on along its own line to the next wall or divider."""
    line = _to_walls(divider.line, floor, others)
    if line is None or isinstance(attach(line, Outline(floor), others, 2 * OVERSHOOT_M), Adrift):
        return None
    is_new = draft.previous.divider(divider.id) is None
    operation = AddDivider(line, divider.kind) if is_new else MoveDivider(divider.id, line)
    return Fix(pointer, "extend to wall", operation)


def _to_walls(line: Line, floor: MultiPolygon, others: Sequence[Line]) -> Line | None:
    ends = as_points(line)
    along = (ends[1] - ends[0]) / float(np.hypot(*(ends[1] - ends[0])))
    barriers = shapely.GeometryCollection([shapely.boundary(floor), *map(LineString, others)])
    middle = ends.mean(0)
    moved = ends.copy()
    for end, outward in enumerate((-along, along)):
        ray = LineString([middle, middle + FARTHEST_M * outward])
        met = shapely.get_coordinates(shapely.intersection(ray, barriers))
        station = (met - middle) @ outward
        ahead = station[station > OVERSHOOT_M]
        if not len(ahead):
            return None
        own = float((ends[end] - middle) @ outward)
        beyond = ahead[ahead >= own - OVERSHOOT_M]
        # an end that passed a wall goes back to it, one that falls short goes on
        chosen = float(beyond.min()) if len(beyond) else float(ahead.max())
        moved[end] = middle + chosen * outward
    return as_line(np.round(moved, 3))


def check_untouched(draft: Draft, floor: MultiPolygon, floor_before: MultiPolygon) -> None:
    """Raises where a divider or meta-divider that was not touched has lost what it ended on."""
    initial = Draft.of(draft.previous)
    before = {d.id: d.line for d in initial.dividers} | {d.id: d.line for d in initial.meta_dividers}

    def is_loose(line: Line, divider_id: str) -> bool:
        if divider_id in draft.drawn or divider_id not in before:
            return False
        held = initial.gaps(before[divider_id], divider_id, floor_before) <= END_M
        return bool((held & (draft.gaps(line, divider_id, floor) > END_M)).any())

    loose = [d.id for d in draft.dividers if is_loose(d.line, d.id)]
    loose_meta = [d.id for d in draft.meta_dividers if is_loose(d.line, d.id)]
    found = [
        Fault("/operations", f"The divider {divider_id} would end in mid-air: move or remove it too.")
        for divider_id in loose
    ]
    found += [
        Fault("/operations", f"The repaired boundary {meta_id} would end in mid-air: merge its rooms first.")
        for meta_id in loose_meta
    ]
    if found:
        raise faults(found, [Fix("/operations", "remove it too", RemoveDivider(divider_id)) for divider_id in loose])
