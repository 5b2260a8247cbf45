"""Doors that nobody has called so: dividers that obstacles closed in one mission and that are open in a later one."""

from dataclasses import replace

from stillroom.maps.semantics import Divider
from stillroom.pipeline.obstacles import covered
from stillroom.pipeline.params import Params
from stillroom.pipeline.transfer import Transfer


def remember_doors(transfer: Transfer, params: Params) -> Transfer:
    """With what each divider has been seen to be. One that was shut and is open again is asked about, once for ever."""

    def seen(divider: Divider) -> Divider:
        if divider.kind == "door" or divider.shut == "asked":
            return divider
        if divider.id in transfer.shut_dividers:
            return replace(divider, shut="once")
        if divider.shut == "never":
            return divider
        there = len(divider.rooms) > 1 and set(divider.rooms) <= transfer.visited
        open_ = there and covered([divider.line], transfer.grid, params)[0] < params.door_open
        return replace(divider, shut="asked") if open_ else divider

    candidate = transfer.candidate
    return replace(transfer, candidate=replace(candidate, dividers=tuple(seen(d) for d in candidate.dividers)))
