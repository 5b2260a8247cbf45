"""What went wrong with a mission, side by side: the map before, its tracked boundaries over the new grid, the meta layer, the map in force."""

from dataclasses import replace
from pathlib import Path

import shapely

from stillroom.documents.pictures import Image, contact_sheet, draw, encode
from stillroom.maps.geometry import as_line, as_points, as_tuples
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Restriction, RestrictionKind, SemanticMap
from stillroom.simulator.benchmark.judging import Record
from stillroom.simulator.benchmark.memory import Version
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Home, carried

_TILE = 560
_TRACKED: RestrictionKind = "no_mop"
_TRUE: RestrictionKind = "no_go"
"""Outlines are drawn as zones that could not be placed: nothing but a coloured ring."""


def failure(
    record: Record,
    before: Version,
    grid: OccupancyGrid,
    motion: Motion | None,
    candidate: SemanticMap | None,
    after: Version,
    home: Home,
    distortion: Distortion,
) -> Image:
    """`motion` takes the map before to the mission's frame; `distortion` is that of the map in force `after`."""
    bare = SemanticMap(grid.frame)
    meta = bare if candidate is None else replace(bare, meta=candidate.meta, dividers=candidate.dividers)
    truth = tuple(_outline(carried(room.polygon, distortion.apply), _TRUE) for room in home.rooms)
    result = replace(after.map, restrictions=truth)
    said = f"{record.mission}: {record.outcome}. {record.reason}"
    happened = f"map in force; red: truth. lost {', '.join(record.lost) or '-'}; wrong {', '.join(record.wrong) or '-'}"
    panels = [
        (f"seed {record.seed} robot {record.robot}, mission {before.mission}", draw(before.grid, before.map)),
        (said, draw(grid, bare if motion is None else _tracked(before.map, motion, bare))),
        (f"meta layer ({', '.join(record.effects)})", draw(grid, meta)),
        (happened, draw(after.grid, result)),
    ]
    return contact_sheet(panels, _TILE, columns=len(panels))


def save(picture: Image, record: Record, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    kind = "silent" if record.silent else "error" if record.error else str(record.succeeded_at)
    name = f"seed{record.seed}-robot{record.robot:02}-mission{record.mission:02}-{kind}.png"
    (folder / name).write_bytes(encode(picture))


def _tracked(before: SemanticMap, motion: Motion, bare: SemanticMap) -> SemanticMap:
    """Nothing but where the rooms' boundaries and the dividers went."""
    rooms = [carried(room.polygon, lambda points: motion.apply(as_points(points))) for room in before.rooms]
    dividers = [replace(d, line=as_line(motion.apply(as_points(d.line)))) for d in before.dividers]
    return replace(bare, restrictions=tuple(_outline(room, _TRACKED) for room in rooms), dividers=tuple(dividers))


def _outline(polygon: shapely.Polygon, kind: RestrictionKind) -> Restriction:
    return Restriction("", kind, as_tuples(shapely.get_coordinates(polygon.exterior)[:-1]), placed=False)
