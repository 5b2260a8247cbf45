"""Real maps of one home as missions of one robot that tracks nothing, one after the other: what becomes of the first map's rooms."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from stillroom.documents.pictures import Image, contact_sheet, draw, encode
from stillroom.maps.geometry import as_points, as_tuples
from stillroom.maps.grid import Mask, OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import Restriction, SemanticMap
from stillroom.pipeline.cells import cells_in
from stillroom.pipeline.update import MapUpdate, update_map
from tests.real.places import PLACES, Place
from tests.real.registering import opened

CARRIED = ("homeA", "elsabot upstairs", "rodney second floor")
AGAIN = 0.5
"""A room is found again where intersection over union with what it was is higher."""


@dataclass(frozen=True)
class Carry:
    """One mission. Of the first map's rooms, moved into this mission's frame by hand: those that the judged map has `again` under their
    id, and those that are among the rooms that a first mission of this map alone would have had (`own`). Compared where this mission
    explored: what the robot never saw, another room's floor seen through a door, is for nobody to find again."""

    file: str
    update: MapUpdate
    grid: OccupancyGrid
    expected: dict[str, Polygon]
    again: tuple[str, ...]
    own: tuple[str, ...]

    @property
    def asked(self) -> set[str]:
        """Rooms that a person is asked about."""
        return {room.id for conflict in self.update.conflicts if not conflict.resolved for room in conflict.rooms}


def carry(place: Place) -> Iterator[Carry]:
    """The missions after the first, in the order of their names."""
    first, *later = sorted(place.maps)
    _, semantic_map = opened(first)
    known = {room.id: room.polygon for room in semantic_map.rooms}
    for number, file in enumerate(later, 2):
        grid, itself = opened(file)
        update = update_map(semantic_map, Mission(str(number), grid, None))
        semantic_map = update.map
        pose = place.pose_between(first, file)
        expected = {key: shapely.transform(polygon, pose.apply) for key, polygon in known.items()}
        explored = {key: cells_in([polygon], grid.frame) & ~grid.unexplored for key, polygon in expected.items()}
        judged = {} if update.candidate is None else _cells(update.candidate, grid)
        own = _cells(itself, grid).values()
        yield Carry(
            file,
            update,
            grid,
            expected,
            again=tuple(k for k, cells in explored.items() if k in judged and iou(cells, judged[k]) > AGAIN),
            own=tuple(k for k, cells in explored.items() if any(iou(cells, room) > AGAIN for room in own)),
        )


def _cells(semantic_map: SemanticMap, grid: OccupancyGrid) -> dict[str, Mask]:
    return {room.id: cells_in([room.polygon], grid.frame) & ~grid.unexplored for room in semantic_map.rooms}


def iou(first: Mask, second: Mask) -> float:
    return int(np.count_nonzero(first & second)) / max(int(np.count_nonzero(first | second)), 1)


def tell_carried(told: Callable[[str], None], pictures: Path | None = None) -> None:
    """A line for each mission; with `pictures`, a picture of each place in that folder."""
    for place in PLACES:
        if place.name not in CARRIED:
            continue
        first = min(place.maps)
        count = len(opened(first)[1].rooms)
        told(f"\n{place.name}: {count} rooms of {Path(first).stem}, missions without tracking")
        told(f"{'mission':<42}{'outcome':<14}{'by':<16}{'again':>6}{'asked':>6}{'own':>5}  reason")
        panels = [(Path(first).stem, draw(*opened(first)))]
        for carried in carry(place):
            update = carried.update
            told(
                f"{Path(carried.file).stem:<42}{update.outcome:<14}{update.succeeded_at or '-':<16}"
                f"{len(carried.again):>6}{len(carried.asked):>6}{len(carried.own):>5}  {update.reason}"
            )
            panels.append(
                (f"{Path(carried.file).stem}: {update.outcome}, {len(carried.again)} of {count}", _drawn(carried))
            )
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            (pictures / f"{place.name}.png").write_bytes(encode(contact_sheet(panels, tile=480)))


def _drawn(carried: Carry) -> Image:
    """The judged map, and over it the outlines of the first map's rooms."""
    judged = carried.update.candidate or SemanticMap(carried.grid.frame)
    outlines = tuple(
        Restriction(key, "no_go", as_tuples(as_points(shapely.get_coordinates(polygon.exterior)[:-1])), placed=False)
        for key, polygon in carried.expected.items()
    )
    return draw(carried.grid, replace(judged, restrictions=outlines))
