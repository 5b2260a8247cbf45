"""How registration does on real maps: found, honestly parked, or wrong, by pairs of maps of which the truth is known."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import shapely

from stillroom.documents.files import ASSUMED, open_map
from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.adoption import adopt_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.registration import register
from stillroom.pipeline.transfer import track
from tests.real.places import PLACES, different
from tests.real.shared import DATA

RIGHT_M = 0.5
"""A pose is right where it puts the walls this near to where they are, in the median: one map is bent against the other."""
OVERLAP = 0.7
"""Common floor, of all floor that either map has."""
DIFFERENT = 200


@dataclass(frozen=True)
class Try:
    """One map registered on another; `right`: the pose is, whether it was accepted or not (None: there is no right one)."""

    previous: str
    mission: str
    accepted: bool
    right: bool | None
    overlap: float
    fit: float
    rival: float
    ms: float

    @property
    def found(self) -> bool:
        return self.accepted and bool(self.right) and self.overlap > OVERLAP

    @property
    def found_in_part(self) -> bool:
        """As for `found`, but the maps have too little floor in common for that."""
        return self.accepted and bool(self.right) and self.overlap <= OVERLAP

    @property
    def wrong(self) -> bool:
        return self.accepted and not self.right


@cache
def opened(file: str) -> tuple[OccupancyGrid, SemanticMap]:
    """A file's grid, and what it would be as the first mission of a map."""
    found = open_map(DATA / file)
    grid, semantics = found.read(ASSUMED | found.meta if found.is_image else {})
    return grid, adopt_map(grid, semantics, "1", Ids())


def attempt(previous: str, mission: str, truth: Pose | None) -> Try:
    _, known = opened(previous)
    grid, itself = opened(mission)
    began = time.thread_time()
    found = register(known, grid, PARAMS)
    spent = time.thread_time() - began
    walls = walls_of(known)
    right = None
    if truth is not None:
        gaps = np.linalg.norm(found.motion.apply(walls) - truth.apply(walls), axis=1)
        right = bool(np.median(gaps) < RIGHT_M)
    return Try(
        previous,
        mission,
        accepted=found.found(PARAMS),
        right=right,
        overlap=common_floor(track(known, found.motion, grid.frame), itself),
        fit=found.fit,
        rival=found.rival,
        ms=1000 * spent,
    )


def walls_of(semantic_map: SemanticMap) -> Points:
    return np.concatenate([np.zeros((0, 2)), *(as_points(wall.line) for wall in semantic_map.walls)])


def common_floor(first: SemanticMap, second: SemanticMap) -> float:
    one, other = (shapely.union_all([shapely.make_valid(r.polygon) for r in m.rooms]) for m in (first, second))
    return float(shapely.intersection(one, other).area / max(shapely.union(one, other).area, 1e-9))


def of_places(names: Iterable[str] = ()) -> dict[str, list[Try]]:
    """All pairs of maps of the places of these names, or of all places."""
    chosen = [place for place in PLACES if not names or place.name in names]
    tries = {place.name: [attempt(a, b, place.pose_between(a, b)) for a, b in place.pairs()] for place in chosen}
    tries |= {
        f"{place.name}, parts": [attempt(a, b, place.pose_between(a, b)) for a, b in place.pairs_with_parts()]
        for place in chosen
        if place.parts
    }
    return tries


def of_different_places() -> list[Try]:
    return [attempt(a, b, None) for a, b in different(DIFFERENT)]


def tell(tries: dict[str, Sequence[Try]], told: Callable[[str], None]) -> None:
    """The table, and every pair that was not found."""
    told(f"{'place':<26}{'pairs':>6}{'found':>7}{'in part':>9}{'parked':>8}{'wrong':>7}{'CPU ms':>8}")
    for name, row in tries.items():
        counts = [len(row), sum(t.found for t in row), sum(t.found_in_part for t in row)]
        counts += [sum(not t.accepted for t in row), sum(t.wrong for t in row)]
        a, b, c, d, e = counts
        told(f"{name:<26}{a:6d}{b:7d}{c:9d}{d:8d}{e:7d}{np.median([t.ms for t in row]):8.0f}")
    told("")
    for name, row in tries.items():
        for t in row:
            if t.wrong or (t.right is not None and not t.accepted):
                verdict = "wrong" if t.wrong else "parked, and right" if t.right else "parked"
                told(
                    f"{verdict:<18} {name}: {_stem(t.previous)} -> {_stem(t.mission)}: fit {t.fit:.2f}, rival {t.rival:.2f}"
                )


def _stem(file: str) -> str:
    return file.rpartition("/")[2].rpartition(".")[0]
