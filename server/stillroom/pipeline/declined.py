"""Places where a person does not want a correction."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
import shapely

from stillroom.maps.geometry import as_points, fit_pose
from stillroom.maps.meta import Declined, MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.motion import Motion

AROUND_M = 0.15
"""A correction this near to a declined place is made there."""
SAME_PLACE = 0.5
"""So is one of which more than this share lies there."""
Correction = TypeVar("Correction", MetaOccupancy, MetaDivider)


def carry_declined(declined: Sequence[Declined], motion: Motion) -> tuple[Declined, ...]:
    """Each moved as one rigid shape with the ground around it."""
    return tuple(_carry(place, motion) for place in declined)


def permitted(meta: MapMeta, declined: Sequence[Declined]) -> MapMeta:
    """Without the corrections that a person declined, of whatever kind they are: what is open stays open."""
    if not declined:
        return meta
    return replace(meta, occupancy=_elsewhere(meta.occupancy, declined), dividers=_elsewhere(meta.dividers, declined))


def _carry(place: Declined, motion: Motion) -> Declined:
    points = as_points(shapely.get_coordinates(place.shape))
    pose = fit_pose(points, motion.apply(points))
    return replace(place, shape=shapely.transform(place.shape, lambda p: np.round(pose.apply(as_points(p)), 4)))


def _elsewhere(corrections: Sequence[Correction], declined: Sequence[Declined]) -> tuple[Correction, ...]:
    places = shapely.union_all([shapely.buffer(place.shape, 2 * AROUND_M) for place in declined])
    around = [shapely.buffer(correction.shape, AROUND_M) for correction in corrections]
    return tuple(
        correction
        for correction, area in zip(corrections, around, strict=True)
        if shapely.intersection(area, places).area <= SAME_PLACE * area.area
    )
