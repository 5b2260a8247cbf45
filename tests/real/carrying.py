"""Real maps of one home as missions of one robot that tracks nothing, one after the other: what becomes of the first map's rooms."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import shapely
from shapely import Polygon

from stillroom.documents.pictures import Image, contact_sheet, draw, encode
from stillroom.maps.geometry import as_points, as_tuples
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.mission import Mission
from stillroom.maps.semantics import Restriction, SemanticMap
from stillroom.pipeline.update import MapUpdate, update_map
from tests.real.places import PLACES, Place
from tests.real.registering import opened

CARRIED = ("homeA", "elsabot upstairs", "rodney second floor")
AGAIN = 0.5
"""A room is found again where intersection over union with what it was is higher."""


@dataclass(frozen=True)
class Carry:
    """One mission. Of the first map's rooms, moved into this mission's frame by hand: those that the judged map has `again` under their
    id, and those that are among the rooms that a first mission of this map alone would have had (`own`)."""

    file: str
    update: MapUpdate
    grid: OccupancyGrid
    expected: dict[str, Polygon]
    again: tuple[str, ...]
    own: tuple[str, ...]


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
        judged = {} if update.candidate is None else {room.id: room.polygon for room in update.candidate.rooms}
        own = [room.polygon for room in itself.rooms]
        yield Carry(
            file,
            update,
            grid,
            expected,
            again=tuple(k for k, polygon in expected.items() if k in judged and iou(polygon, judged[k]) > AGAIN),
            own=tuple(k for k, polygon in expected.items() if any(iou(polygon, room) > AGAIN for room in own)),
        )


def iou(first: Polygon, second: Polygon) -> float:
    return float(shapely.intersection(first, second).area / max(shapely.union(first, second).area, 1e-9))


def tell_carried(told: Callable[[str], None], pictures: Path | None = None) -> None:
    """A line for each mission; with `pictures`, a picture of each place in that folder."""
    for place in PLACES:
        if place.name not in CARRIED:
            continue
        first = min(place.maps)
        count = len(opened(first)[1].rooms)
        told(f"\n{place.name}: {count} rooms of {Path(first).stem}, missions without tracking")
        told(f"{'mission':<42}{'outcome':<14}{'by':<16}{'again':>6}{'own':>5}  reason")
        panels = [(Path(first).stem, draw(*opened(first)))]
        for carried in carry(place):
            update = carried.update
            told(
                f"{Path(carried.file).stem:<42}{update.outcome:<14}{update.succeeded_at or '-':<16}"
                f"{len(carried.again):>6}{len(carried.own):>5}  {update.reason}"
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
