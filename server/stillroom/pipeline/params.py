"""Every threshold of the pipeline, in the paper's words. Metres, so that any resolution works without retuning."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Params:
    # -- constraints (paper, Tables I and II) --
    wall_reach_m: float = 0.20
    """A wall lies within this distance of an occupied pixel; 95 % of outline length does on real maps at 0.20 m."""
    divider_reach_m: float = 0.50
    """A divider's end is moved at most this far to the wall or divider that it ends on."""
    room_overlap: float = 0.5
    """A room is transferred where precision and recall are both higher than this (paper, section V)."""

    # -- transfer (Algorithm 1) --
    wall_classification_m: float = 0.25
    """Obstacles this near to a tracked room boundary are wall (step 2); three times the residual error of tracking."""


PARAMS = Params()
