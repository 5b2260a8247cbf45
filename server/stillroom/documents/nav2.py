"""Nav2's map files: a picture and a YAML file that says how to read it (nav2_map_server), and keep-out masks (nav2_costmap_2d)."""

from typing import Any

import numpy as np
import shapely
import yaml
from shapely import LineString, Polygon

from stillroom.documents.images import Reading, as_grey, encode_pgm
from stillroom.errors import Fault, InvalidInput
from stillroom.maps.geometry import as_points
from stillroom.maps.grid import Cell, Cells, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Restriction, SemanticMap

FIELDS = ("resolution", "origin", "mode", "negate", "occupied_thresh", "free_thresh")
"""Those that `meta` of an upload has too."""
KEEP_OUT = ("no_go", "virtual_wall")


def read_yaml(content: bytes) -> tuple[str, dict[str, Any]]:
    """The name of the image and the fields that `meta` has. Raises InvalidInput."""
    try:
        document = yaml.safe_load(content.decode())
    except (UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise InvalidInput(f"This is no YAML: {error}") from None
    if not isinstance(document, dict) or not isinstance(document.get("image"), str):
        raise InvalidInput("This is not a map_server file: it names no image.", (Fault("/image", "missing"),))
    return document["image"], {name: document[name] for name in FIELDS if name in document}


def write_nav2(grid: OccupancyGrid, name: str) -> dict[str, bytes]:
    """File name -> content. Read in trinary mode with the usual thresholds, the files give the same cells and frame."""
    return _files(name, grid.frame, grid.cells)


def write_keepout(semantic_map: SemanticMap, name: str) -> dict[str, bytes]:
    """File name -> content of a mask that is occupied wherever a no-go zone or a virtual wall touches a cell, free elsewhere."""
    cells = np.full((semantic_map.frame.height, semantic_map.frame.width), Cell.FREE, np.uint8)
    keep_out = [r for r in semantic_map.restrictions if r.kind in KEEP_OUT]
    for restriction in keep_out:
        if restriction.placed:
            _block(cells, restriction, semantic_map.frame)
    unplaced = [r.id for r in keep_out if not r.placed]
    said = f"not in the mask, because there is no telling where they belong now: {', '.join(unplaced)}"
    return _files(name, semantic_map.frame, cells, said if unplaced else None)


def _files(name: str, frame: GridFrame, cells: Cells, comment: str | None = None) -> dict[str, bytes]:
    usual = Reading()
    o = frame.origin
    document = {
        "image": f"{name}.pgm",
        "mode": usual.mode,
        "resolution": frame.resolution,
        "origin": [o.x, o.y, o.yaw],
        "negate": int(usual.negate),
        "occupied_thresh": usual.occupied_thresh,
        "free_thresh": usual.free_thresh,
    }
    text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, allow_unicode=True)
    head = "" if comment is None else f"# {comment}\n"
    return {f"{name}.yaml": (head + text).encode(), f"{name}.pgm": encode_pgm(as_grey(cells[::-1]))}


def _block(cells: Cells, restriction: Restriction, frame: GridFrame) -> None:
    """Row by row, so that memory stays small however large the zone is."""
    points = frame.to_cells(as_points(restriction.shape))
    shape = LineString(points) if restriction.kind == "virtual_wall" else shapely.make_valid(Polygon(points))
    shapely.prepare(shape)
    low, high = np.floor(points.min(0)).astype(int), np.floor(points.max(0)).astype(int)
    columns = np.arange(max(low[0], 0), min(high[0] + 1, frame.width))
    for row in range(max(int(low[1]), 0), min(int(high[1]) + 1, frame.height)):
        touched = shapely.intersects(shape, shapely.box(columns, row, columns + 1, row + 1))
        cells[row, columns[touched]] = Cell.OCCUPIED
