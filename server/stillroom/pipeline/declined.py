"""Places where a person does not want a correction."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from stillroom.maps.geometry import as_points, fit_pose
from stillroom.maps.meta import Declined, MapMeta
from stillroom.maps.motion import Motion

AROUND_M = 0.15
"""A correction this near to a declined place is made there."""
SAME_PLACE = 0.5
"""So is one of which more than this share lies there."""


def carry_declined(declined: Sequence[Declined], motion: Motion) -> tuple[Declined, ...]:
    """Each moved as one rigid shape with the ground around it."""
    return tuple(_carry(place, motion) for place in declined)


def permitted(meta: MapMeta, declined: Sequence[Declined]) -> MapMeta:
    """Without the corrections that a person declined, of whatever kind they are: what is open stays open."""
    if not declined:
        return meta
    occupancy = elsewhere([o.polygon for o in meta.occupancy], declined)
    dividers = elsewhere([d.shape for d in meta.dividers], declined)
    return replace(
        meta,
        occupancy=tuple(o for o, keep in zip(meta.occupancy, occupancy, strict=True) if keep),
        dividers=tuple(d for d, keep in zip(meta.dividers, dividers, strict=True) if keep),
    )


def elsewhere(shapes: Sequence[shapely.Geometry], declined: Sequence[Declined]) -> list[bool]:
    """Which of the shapes lie in no declined place."""
    places = shapely.union_all([shapely.buffer(place.shape, 2 * AROUND_M) for place in declined])
    around = shapely.buffer(list(shapes), AROUND_M)
    shares = shapely.area(shapely.intersection(around, places)) / shapely.area(around)
    return [bool(share <= SAME_PLACE) for share in shares]


def _carry(place: Declined, motion: Motion) -> Declined:
    points = as_points(shapely.get_coordinates(place.shape))
    pose = fit_pose(points, motion.apply(points))
    return replace(place, shape=shapely.transform(place.shape, lambda p: np.round(pose.apply(as_points(p)), 4)))
