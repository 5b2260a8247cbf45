"""`make bench-segmentation`: how well and how fast rooms are found on the real maps of ../shared/data, beside the published methods.

The table of plans has the ten buildings of Bormann et al. (ICRA 2016) as they are and furnished; free cells alone count, so that nothing can
have the places of the furniture. The table of homes counts rooms on which robot and owner settled.
"""

import sys
from collections.abc import Callable
from dataclasses import astuple
from itertools import permutations
from pathlib import Path
from time import process_time

import cv2
import numpy as np
import numpy.typing as npt
import shapely

from stillroom.documents.files import ASSUMED, open_map
from stillroom.maps.geometry import Points, as_points
from stillroom.maps.grid import Cell, Cells, GridFrame, OccupancyGrid, look_up
from stillroom.maps.semantics import Ids
from stillroom.pipeline.adoption import RobotSemantics, adopt_map
from stillroom.pipeline.creation import create_map, room_cells
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.registration import register
from stillroom.segmenting import WHITE
from tests.real.room_scores import Labels, Scores, drawn_rooms, matched, mean, score
from tests.real.shared import DATA

Shapes = npt.NDArray[np.object_]
"""Shape (n,), polygons."""
Numbers = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Change = Callable[[OccupancyGrid, Shapes], Flags]
"""Which of a grid's rooms stay when it is changed."""

PLANS = DATA / "ipa_room_segmentation"
HOMES = DATA / "valetudo"
REPEATS = 5
VARIANTS = {"as they are": "", "furnished": "_furnitures"}
PEERS = {
    "as they are": {
        "morphological": "98.83 89.40 72.1 80.6    -  0.297",
        "distance": "97.92 90.32 79.3 87.3    -  0.264",
        "Voronoi": "95.49 94.84 87.1 76.0    -  6.5",
        "semantic": "89.24 89.04 66.3 62.0    -  46",
    },
    "furnished": {
        "morphological": "84.78 91.61 60.7 61.7    -  0.173",
        "distance": "79.31 91.10 60.2 56.8    -  0.204",
        "Voronoi": "87.65 94.52 79.8 68.2    -  6.0",
        "semantic": "87.89 83.59 58.5 61.5    -  42",
    },
}
"""The implementations of Bormann et al. in C++, measured on a machine of this kind."""
HEAD = f"{'':32}{'recall':>9}{'prec.':>8}{'IoU':>8}{'F1@.5':>8}{'P,R>.5':>8}{'seconds':>9}"


def plan(name: str, variant: str) -> tuple[OccupancyGrid, Labels]:
    """The grid of a plan and the rooms drawn on it, both with row 0 at the bottom."""
    grid, _ = open_map(PLANS / f"{name}{variant}.png").read(ASSUMED | WHITE)
    drawn = cv2.imread(str(PLANS / f"{name}_gt_segmentation.png"), cv2.IMREAD_GRAYSCALE)
    return grid, drawn_rooms(np.asarray(drawn, np.uint8))[::-1]


def plan_names() -> list[str]:
    return sorted(path.name.removesuffix("_gt_segmentation.png") for path in PLANS.glob("*_gt_segmentation.png"))


def found_rooms(grid: OccupancyGrid, repeats: int = REPEATS) -> tuple[Labels, float]:
    """The found room of each free cell, and the seconds of one core that it took to make the map (the best of some runs)."""
    seconds = []
    for _ in range(repeats):
        fresh = OccupancyGrid(grid.frame, grid.cells)
        started = process_time()
        made = create_map(fresh, "1", Ids())
        seconds.append(process_time() - started)
    return np.asarray(room_cells(made, grid), np.int64), min(seconds)


def plans_table(variant: str) -> list[str]:
    lines = [f"Plans {variant}", HEAD]
    scores, times = [], []
    for name in plan_names():
        grid, drawn = plan(name, VARIANTS[variant])
        found, seconds = found_rooms(grid)
        scores.append(score(found, drawn))
        times.append(seconds)
        lines.append(_row(name, scores[-1], seconds))
    lines.append(_row("stillroom, mean", mean(scores), float(np.mean(times))))
    lines += [f"{name:32}   {figures}" for name, figures in PEERS[variant].items()]
    return lines


def _row(name: str, found: Scores, seconds: float) -> str:
    return f"{name:32} " + "".join(f"{value:8.2f}" for value in astuple(found)) + f"{seconds:9.3f}"


def homes_table() -> list[str]:
    """Each home counts once: several maps of one home are averaged."""
    lines = ["Homes: rooms of robot and owner that a found room matches with an IoU over 0.5"]
    matched_rooms, all_rooms = 0.0, 0.0
    for folder in sorted(path for path in HOMES.iterdir() if path.is_dir() and path.name != "homeA"):
        files = sorted(folder.glob("*.json"))
        for home in [[file] for file in files] if folder.name == "single" else [files]:
            counts = [count for count in map(_agreement, home) if count[1]]
            if counts:
                good, rooms = np.mean(counts, axis=0).tolist()
                matched_rooms, all_rooms = matched_rooms + good, all_rooms + rooms
                name = home[0].stem if folder.name == "single" else folder.name
                lines.append(f"{name[:48]:48}{good:8.2f} of {rooms:.0f}")
    share = matched_rooms / max(all_rooms, 1)
    lines.append(f"{'all of these':48}{matched_rooms:8.2f} of {all_rooms:.0f}, {share:.1%}")
    ours, robots = home_a()
    lines.append(f"homeA: {ours:.1%}; its robots among themselves {robots:.1%}; {ours / max(robots, 1e-9):.1%} of that")
    return lines


def _agreement(file: Path) -> tuple[int, int]:
    """Rooms of the robot that are found, and all of them."""
    grid, semantics = open_map(file).read({})
    if semantics is None or not semantics.has_rooms:
        return 0, 0
    return matched(found_rooms(grid)[0], _drawn(grid, semantics))


def _drawn(grid: OccupancyGrid, semantics: RobotSemantics) -> Labels:
    return np.where(grid.free, semantics.labels, 0).astype(np.int64)


def home_a() -> tuple[float, float]:
    """Mean share of the rooms of each of homeA's maps that are found, and that each other robot's map of it has."""
    maps = [open_map(file).read({}) for file in sorted((HOMES / "homeA").glob("*.json"))]
    known = [(grid, semantics) for grid, semantics in maps if semantics is not None and semantics.has_rooms]
    ours = [matched(found_rooms(grid)[0], _drawn(grid, semantics)) for grid, semantics in known]
    others = []
    for (grid, semantics), (other, its) in permutations(known, 2):
        motion = register(adopt_map(grid, semantics, "1", Ids()), other, PARAMS).motion
        rows, columns = np.nonzero(grid.free)
        places = other.frame.to_cells(motion.apply(grid.frame.to_map(as_points(np.stack([columns, rows], 1)) + 0.5)))
        carried = np.zeros(grid.cells.shape, np.int64)
        carried[rows, columns] = np.where(
            look_up(other.cells, places, 0) == Cell.FREE, look_up(its.labels, places, 0), 0
        )
        others.append(matched(carried, _drawn(grid, semantics)))
    return _share(ours), _share(others)


def _share(counts: list[tuple[int, int]]) -> float:
    return float(np.mean([good / rooms for good, rooms in counts])) if counts else 0.0


def stability_table() -> list[str]:
    """Of the rooms of all plans and homes, how many stay where a map is turned, mirrored, shifted, padded, sampled twice as finely: to 2 % of
    their area; and where 1 % of the known cells are wrong: with precision and recall over 90 %."""
    lines = ["Rooms that stay the same", f"{'':32}{'plans':>9}{'homes':>9}{'all':>9}"]
    plans = [plan(name, variant)[0] for variant in VARIANTS.values() for name in plan_names()]
    homes = [open_map(file).read({})[0] for file in sorted(HOMES.glob("**/*.json"))]
    known = [[_rooms(grid.cells, grid.frame.resolution) for grid in maps] for maps in (plans, homes)]
    for name, change in CHANGES.items():
        kept = [
            np.concatenate([change(grid, rooms) for grid, rooms in zip(maps, found, strict=True)])
            for maps, found in zip((plans, homes), known, strict=True)
        ]
        shares = [100 * float(part.mean()) for part in (*kept, np.concatenate(kept))]
        lines.append(f"{name:32}" + "".join(f"{share:9.1f}" for share in shares))
    lines.append(f"{'rooms':32}" + "".join(f"{sum(map(len, found)):9}" for found in known))
    return lines


def _rooms(cells: Cells, resolution: float) -> Shapes:
    """Rooms of a grid whose corner is the origin, in cells."""
    grid = OccupancyGrid(GridFrame(resolution, cells.shape[1], cells.shape[0]), np.ascontiguousarray(cells))
    rooms = [room.polygon for room in create_map(grid, "1", Ids()).rooms]
    return np.asarray(shapely.transform(rooms, lambda points: points / resolution), np.object_)


def _pairs(first: Shapes, second: Shapes) -> tuple[Numbers, Numbers, Numbers]:
    """Each first room with the second one that it has most in common with: common area, and both areas."""
    common = shapely.area(shapely.intersection(first[:, None], second[None]))
    best = common.argmax(1)
    return common.max(1), shapely.area(first), shapely.area(second)[best]


def _moved(change: Callable[[Cells], Cells], motion: Callable[[Points, float, float], Points]) -> Change:
    """`motion`: of places (n, 2) in cells, on a map so wide and so high."""

    def stays(grid: OccupancyGrid, rooms: Shapes) -> Flags:
        height, width = grid.cells.shape
        there = shapely.transform(rooms, lambda places: motion(as_points(places), width, height))
        common, own, other = _pairs(there, _rooms(change(grid.cells), grid.frame.resolution))
        return np.asarray(own + other - 2 * common < 0.02 * own)

    return stays


def _finer(grid: OccupancyGrid, rooms: Shapes) -> Flags:
    found = _rooms(np.kron(grid.cells, np.ones((2, 2), np.uint8)), grid.frame.resolution / 2)
    common, own, other = _pairs(shapely.transform(rooms, lambda places: 2 * places), found)
    return np.asarray(own + other - 2 * common < 0.02 * own)


def _wrong(grid: OccupancyGrid, rooms: Shapes) -> Flags:
    """Half of the wrong cells become occupied, half free."""
    drawn = np.random.default_rng(1).random(grid.cells.shape)
    known = np.not_equal(grid.cells, Cell.UNEXPLORED)
    cells = np.where(known & (drawn < 0.01), np.uint8(Cell.OCCUPIED), grid.cells)
    cells = np.where(known & (drawn < 0.005), np.uint8(Cell.FREE), cells)
    common, own, other = _pairs(rooms, _rooms(cells, grid.frame.resolution))
    return np.asarray((common > 0.9 * own) & (common > 0.9 * other))


CHANGES: dict[str, Change] = {
    "turned by 90 degrees": _moved(np.rot90, lambda p, width, _: np.stack([p[:, 1], width - p[:, 0]], 1)),
    "turned by 180 degrees": _moved(lambda c: np.rot90(c, 2), lambda p, width, height: (width, height) - p),
    "mirrored": _moved(np.fliplr, lambda p, width, _: np.stack([width - p[:, 0], p[:, 1]], 1)),
    "shifted": _moved(lambda c: np.pad(c, ((13, 0), (7, 0))), lambda p, _w, _h: p + np.array([7, 13])),
    "padded": _moved(lambda c: np.pad(c, 40), lambda p, _w, _h: p + 40),
    "cells divided in four": _finer,
    "1 % of the known cells wrong": _wrong,
}


def main() -> int:
    cv2.setNumThreads(1)
    if not DATA.is_dir():
        sys.stderr.write(f"There are no real maps in {DATA}.\n")
        return 1
    for variant in VARIANTS:
        sys.stdout.write("\n".join(plans_table(variant)) + "\n\n")
        sys.stdout.flush()
    sys.stdout.write("\n".join(homes_table()) + "\n\n")
    sys.stdout.write("\n".join(stability_table()) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
