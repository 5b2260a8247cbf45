"""How registration does on real maps: found, honestly parked, or wrong, by pairs of maps of which the truth is known."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import chain

import numpy as np
import shapely

from stillroom.documents.files import ASSUMED, open_map
from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.adoption import adopt_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.plausibility import plausibility
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
    """One map registered on another; `right`: the pose is, whether it was accepted or not (None: there is no right one); `plausible`: the
    grid at that pose is neither another floor nor a wreck, as is asked of tracked missions too."""

    previous: str
    mission: str
    accepted: bool
    plausible: bool
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
    tracked = track(known, found.motion, grid.frame)
    shown = plausibility(tracked, grid, PARAMS)
    return Try(
        previous,
        mission,
        accepted=found.found(PARAMS),
        plausible=not (shown.other_floor(PARAMS) or shown.wrecked(PARAMS)),
        right=right,
        overlap=common_floor(tracked, itself),
        fit=found.fit,
        rival=found.rival,
        ms=1000 * spent,
    )


def walls_of(semantic_map: SemanticMap) -> Points:
    return np.concatenate([np.zeros((0, 2)), *(as_points(wall.line) for wall in semantic_map.walls)])


def common_floor(first: SemanticMap, second: SemanticMap) -> float:
    one, other = (shapely.union_all([shapely.make_valid(r.polygon) for r in m.rooms]) for m in (first, second))
    return float(shapely.intersection(one, other).area / max(shapely.union(one, other).area, 1e-9))


def of_places() -> Iterator[tuple[str, list[Try]]]:
    """All pairs of maps of each place, those of whole maps first."""
    for place in PLACES:
        yield place.name, [attempt(a, b, place.pose_between(a, b)) for a, b in place.pairs()]
        if place.parts:
            parts = [attempt(a, b, place.pose_between(a, b)) for a, b in place.pairs_with_parts()]
            yield f"{place.name}, parts", parts


def of_different_places() -> Iterator[tuple[str, list[Try]]]:
    yield "different places", [attempt(a, b, None) for a, b in different(DIFFERENT)]


def tell(told: Callable[[str], None]) -> None:
    """The table, and every pair of a place that was not found."""
    told(
        f"{'place':<26}{'pairs':>6}{'found':>7}{'in part':>9}{'parked':>8}{'wrong':>7}{'implausible':>13}{'CPU ms':>8}"
    )
    missed: list[str] = []
    for name, row in chain(of_places(), of_different_places()):
        counts = [len(row), sum(t.found for t in row), sum(t.found_in_part for t in row)]
        counts += [sum(not t.accepted for t in row), sum(t.wrong for t in row), sum(not t.plausible for t in row)]
        a, b, c, d, e, f = counts
        told(f"{name:<26}{a:6d}{b:7d}{c:9d}{d:8d}{e:7d}{f:13d}{np.median([t.ms for t in row]):8.0f}")
        missed += [_missed(name, t) for t in row if t.wrong or (t.right is not None and not t.accepted)]
    told("\n" + "\n".join(missed))


def _missed(place: str, tried: Try) -> str:
    verdict = "wrong" if tried.wrong else "parked, and right" if tried.right else "parked"
    pair = f"{_stem(tried.previous)} -> {_stem(tried.mission)}"
    return f"{verdict:<18} {place}: {pair}: fit {tried.fit:.2f}, rival {tried.rival:.2f}"


def _stem(file: str) -> str:
    return file.rpartition("/")[2].rpartition(".")[0]
