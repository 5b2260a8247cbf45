"""`make fit-cuts`: fits the weights of `pipeline/cuts.py` and `pipeline/segmentation.py` to rooms that people drew, or live in.

Three kinds of buildings: the ten plans, bare and furnished; homes whose rooms robot and owner settled on; simulated homes, of seeds that no
benchmark uses. Prints the scores of each real building with weights from all others (both variants of a plan and all maps of a home are
left out together), then the weights from all. `l10su_3031_giant` is left out: its segments are strips across open halls.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from itertools import product

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from stillroom.documents.files import open_map
from stillroom.maps.geometry import as_points
from stillroom.maps.grid import GridFrame, OccupancyGrid, look_up
from stillroom.pipeline import cuts, segmentation
from stillroom.pipeline.creation import explored_part, without_slots, without_specks
from stillroom.pipeline.cuts import Cuts, Outline, cells_at, outline_of, possible_cuts
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.pieces import Pieces, clearance_of, part_floor
from stillroom.pipeline.walls import outline, separate_clutter
from stillroom.simulator.benchmark.trial import Household, Trial
from stillroom.simulator.severities import SEVERITIES
from stillroom.simulator.truth import numbered
from tests.real.bench_segmentation import HOMES, VARIANTS, found_rooms, plan, plan_names
from tests.real.room_scores import Labels, Scores, matched, mean, score
from tests.real.shared import DATA

Numbers = npt.NDArray[np.float64]
Examples = tuple[Numbers, Numbers]
"""Rows of features, and the outcome of each, 0 or 1."""

ROUNDS = 3
"""Which pieces are joined first depends on the weights: decisions are collected anew with those just fitted."""
SHRINKAGE = 1.0
SMALLEST_M2 = 0.5
"""Pieces smaller than this are not asked which room they are in."""
PLAN, HOME, SIMULATED = 200.0, 50.0, 10.0
"""What a building weighs. People drew the rooms of plans; of homes robots proposed most; simulated ones are many."""
SEEDS, ROBOTS = range(1001, 1009), range(8)
MORE_ROOMS = 0.15
"""The constant is so much lower than fitted: a room too many is joined with one tap, a missing divider must be drawn."""
STRIPS = "l10su_3031_giant"
PURE = 0.9


@dataclass(frozen=True, eq=False)
class Sample:
    """A map with rooms that people `drew`: (height, width) as its `grid`, and on the explored part alone `rooms`."""

    building: str
    variant: str
    grid: OccupancyGrid
    drawn: Labels
    frame: GridFrame
    rooms: Labels
    outline: Outline
    clearance: npt.NDArray[np.float32]
    possible: Cuts
    borders: Examples

    @property
    def weight(self) -> float:
        return PLAN if self.variant in VARIANTS else SIMULATED if self.variant == "simulated" else HOME


def samples() -> Iterator[Sample]:
    for variant, suffix in VARIANTS.items():
        for name in plan_names():
            yield _sample(name, variant, *plan(name, suffix))
    for file in sorted(HOMES.glob("**/*.json")):
        grid, semantics = open_map(file).read({})
        if semantics is not None and semantics.has_rooms and file.stem != STRIPS:
            building = file.stem if file.parent.name == "single" else file.parent.name
            yield _sample(building, file.stem, grid, np.where(grid.free, semantics.labels, 0).astype(np.int64))


def simulated() -> Iterator[Sample]:
    for seed, number in product(SEEDS, ROBOTS):
        robot = Household(Trial(seed, number, 0, SEVERITIES["middle"], None)).robot
        sortie = robot.sortie(0)
        grid, straight = sortie.sensed.grid, sortie.sensed.floor.frame
        true = numbered(straight, [room.polygon for room in robot.home.rooms]).astype(np.int64)
        rows, columns = np.nonzero(grid.free)
        bent = grid.frame.to_map(as_points(np.stack([columns, rows], 1) + 0.5))
        drawn = np.zeros(grid.cells.shape, np.int64)
        drawn[rows, columns] = look_up(true, straight.to_cells(robot.distortion(0).undo(bent)), 0)
        yield _sample(f"{seed}-{number}", "simulated", grid, drawn)


def _sample(building: str, variant: str, grid: OccupancyGrid, drawn: Labels) -> Sample:
    seen = without_specks(explored_part(grid, PARAMS), PARAMS)
    mask = without_slots(separate_clutter(seen, PARAMS).floor, seen.frame.resolution, PARAMS)
    floor = outline(mask, seen.frame, PARAMS, smallest_m2=PARAMS.pocket_area_m2)
    around = outline_of(shapely.orient_polygons(floor), seen.frame, PARAMS)
    clearance = clearance_of(mask, seen.frame)
    possible = possible_cuts(around, clearance, seen.frame, PARAMS)
    rows, columns = np.nonzero(seen.free)
    column, row = (
        np.floor(grid.frame.to_cells(seen.frame.to_map(as_points(np.stack([columns, rows], 1) + 0.5)))).astype(int).T
    )
    rooms = np.zeros(seen.cells.shape, np.int64)
    rooms[rows, columns] = drawn[row, column]
    borders = _borders(possible, rooms, seen.frame)
    return Sample(building, variant, grid, drawn, seen.frame, rooms, around, clearance, possible, borders)


# -- examples ------------------------------------------------------------------------------------------------------


def _borders(possible: Cuts, rooms: Labels, frame: GridFrame) -> Examples:
    """Of each cut with rooms on both sides whether one is on its left and another on its right."""
    on = possible.a[:, None] + np.linspace(0.15, 0.85, 9)[:, None] * (possible.b - possible.a)[:, None]
    sides, pure = [], np.ones(len(on), np.bool_)
    for sign in (1.0, -1.0):
        places = np.concatenate([on + off * sign * possible.left[:, None] for off in (0.12, 0.25)], 1)
        beside = cells_at(rooms, places, frame)
        votes = ((beside[:, :, None] == beside[:, None]) & (beside > 0)[:, :, None]).sum(2)
        known = (beside > 0).sum(1)
        sides.append(np.where(known > 3, np.take_along_axis(beside, votes.argmax(1)[:, None], 1)[:, 0], 0))
        pure &= votes.max(1) > PURE * known
    clear = (sides[0] > 0) & (sides[1] > 0)
    return cuts.properties(possible)[clear], ((sides[0] != sides[1]) & pure)[clear].astype(np.float64)


def _decisions(pieces: Pieces, overlap: Numbers) -> Examples:
    """Of every cut that decided whether two groups of pieces are joined whether they are of one room.

    `overlap`: (pieces, rooms), the cells that each piece has of each room.
    """
    values = np.array(list(segmentation.WEIGHTS.values()))
    groups = np.arange(len(pieces.area))
    rows: list[Numbers] = []
    same: list[bool] = []
    while True:
        pair = np.sort(groups[pieces.sides], axis=1)
        apart = np.flatnonzero(pair[:, 0] != pair[:, 1])
        if not len(apart):
            break
        features = pieces.features(groups, apart, PARAMS)
        evidence = features @ values
        rooms = np.zeros_like(overlap)
        np.add.at(rooms, groups, overlap)
        area = np.bincount(groups, weights=pieces.area, minlength=len(groups))
        order = np.argsort(-evidence)
        _, first = np.unique(pair[apart][order], axis=0, return_index=True)
        for k in order[first].tolist():
            i, j = pair[apart[k]]
            if rooms[i].any() and rooms[j].any() and min(area[i], area[j]) > SMALLEST_M2:
                rows.append(features[k])
                same.append(bool(rooms[i].argmax() == rooms[j].argmax()))
        joined = segmentation.join_best(groups, apart, evidence, pieces, PARAMS)
        if joined is None:
            break
        groups = joined
    return np.array(rows).reshape(len(rows), len(values)), np.array(same, np.float64)


# -- fitting -------------------------------------------------------------------------------------------------------


def fit(among: list[Sample]) -> None:
    """Puts the fitted weights in the place of those in force."""
    count = Counter(one.building for one in among)
    weights = [one.weight / count[one.building] for one in among]
    cuts.WEIGHTS.update(zip(cuts.WEIGHTS, logistic([one.borders for one in among], weights).tolist(), strict=True))
    parted = [part_floor(one.outline, one.possible, one.clearance, one.frame) for one in among]
    overlaps = []
    for one, pieces in zip(among, parted, strict=True):
        overlap = np.zeros((len(pieces.area), int(one.rooms.max()) + 1))
        np.add.at(overlap, (pieces.labels.ravel(), one.rooms.ravel()), 1)
        overlap[:, 0] = 0
        overlaps.append(overlap)
    examples: list[Examples] = []
    segmentation.WEIGHTS.update(dict.fromkeys(segmentation.WEIGHTS, 0.0))
    for _ in range(ROUNDS):
        examples += map(_decisions, parted, overlaps)
        found = logistic(examples, weights * (len(examples) // len(weights)))
        segmentation.WEIGHTS.update(zip(segmentation.WEIGHTS, found.tolist(), strict=True))
    segmentation.WEIGHTS["constant"] -= MORE_ROOMS


def logistic(examples: list[Examples], weights: list[float]) -> Numbers:
    """Logistic regression on examples of such weights in all; the first column is the constant, which alone is not shrunk."""
    rows = np.concatenate([x for x, y in examples])
    outcomes = np.concatenate([y for _, y in examples])
    share = np.concatenate(
        [np.full(len(y), weight / max(len(y), 1)) for (_, y), weight in zip(examples, weights, strict=True)]
    )
    shrink = np.diag([1e-6] + [SHRINKAGE] * (rows.shape[1] - 1))
    found = np.zeros(rows.shape[1])
    for _ in range(50):
        chance = 1 / (1 + np.exp(-np.clip(rows @ found, -30, 30)))
        slope = rows.T @ (share * (outcomes - chance)) - shrink @ found
        curve = (rows * (share * chance * (1 - chance))[:, None]).T @ rows + shrink
        step = np.linalg.solve(curve, slope)
        found = found + step
        if np.abs(step).max() < 1e-6:
            break
    return np.asarray(found)


def main() -> int:
    cv2.setNumThreads(1)
    if not DATA.is_dir():
        sys.stderr.write(f"There are no real maps in {DATA}.\n")
        return 1
    real, others = list(samples()), list(simulated())
    scores: dict[str, list[Scores]] = {variant: [] for variant in VARIANTS}
    homes: dict[str, list[tuple[int, int]]] = {}
    for building in dict.fromkeys(one.building for one in real):
        fit([one for one in real + others if one.building != building])
        for one in real:
            if one.building == building:
                found = found_rooms(one.grid, repeats=1)[0]
                if one.variant in VARIANTS:
                    scores[one.variant].append(score(found, one.drawn))
                else:
                    homes.setdefault(building, []).append(matched(found, one.drawn))
    sys.stdout.write("Each building with weights from all others: recall, precision, IoU, F1, P and R over a half\n")
    for variant, found_scores in scores.items():
        sys.stdout.write(f"{variant:24}" + "".join(f"{value:8.2f}" for value in astuple(mean(found_scores))) + "\n")
    for home, counts in homes.items():
        good, rooms = np.mean(counts, axis=0).tolist()
        sys.stdout.write(f"{home[:24]:24}{good:8.2f} of {rooms:.2f} rooms\n")
    fit(real + others)
    for name, weights in (("cuts", cuts.WEIGHTS), ("segmentation", segmentation.WEIGHTS)):
        in_words = ", ".join(f'"{key}": {value:.2f}' for key, value in weights.items())
        sys.stdout.write(f"{name}.WEIGHTS = {{{in_words}}}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
