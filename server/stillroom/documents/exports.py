"""A version of a map in the formats of others."""

import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stillroom.documents import pictures
from stillroom.documents.nav2 import write_keepout, write_nav2
from stillroom.documents.occupancy_grid import write_occupancy_grid
from stillroom.documents.valetudo import write_valetudo
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.cells import cells_in

ExportFormat = Literal["geojson", "nav2", "keepout", "occupancy_grid", "valetudo", "png"]
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can say: equal maps make equal files."""


@dataclass(frozen=True)
class Export:
    """`suffix` is that of a file's name."""

    content: bytes
    media_type: str
    suffix: str


def export(kind: ExportFormat, semantic_map: SemanticMap, grid: OccupancyGrid, geojson: bytes, name: str) -> Export:
    """`geojson` is the map as the API answers it, `name` what files inside an archive are called."""
    if kind == "geojson":
        return Export(geojson, "application/geo+json", ".geojson")
    return _WRITERS[kind](semantic_map, grid, name)


def _nav2(_semantic_map: SemanticMap, grid: OccupancyGrid, name: str) -> Export:
    return _archive(write_nav2(grid, name))


def _keepout(semantic_map: SemanticMap, _grid: OccupancyGrid, name: str) -> Export:
    return _archive(write_keepout(semantic_map, f"{name}-keepout"))


def _occupancy_grid(_semantic_map: SemanticMap, grid: OccupancyGrid, _name: str) -> Export:
    return Export(write_occupancy_grid(grid), "application/json", ".json")


def _valetudo(semantic_map: SemanticMap, grid: OccupancyGrid, _name: str) -> Export:
    """Rooms become segments of the free cells that lie in them; only names that a person gave are names."""
    labels = np.zeros(grid.cells.shape, np.int32)
    for label, room in enumerate(semantic_map.rooms, 1):
        labels[cells_in([room.polygon], grid.frame)] = label
    segments = [(str(r.segment_id), r.name if r.named_by == "user" else None) for r in semantic_map.rooms]
    return Export(write_valetudo(grid, labels, segments, semantic_map.restrictions), "application/json", ".json")


def _png(semantic_map: SemanticMap, grid: OccupancyGrid, _name: str) -> Export:
    return Export(pictures.encode(pictures.draw(grid, semantic_map)), "image/png", ".png")


_WRITERS: Mapping[str, Callable[[SemanticMap, OccupancyGrid, str], Export]] = {
    "nav2": _nav2,
    "keepout": _keepout,
    "occupancy_grid": _occupancy_grid,
    "valetudo": _valetudo,
    "png": _png,
}


def _archive(files: Mapping[str, bytes]) -> Export:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), content, zipfile.ZIP_DEFLATED)
    return Export(packed.getvalue(), "application/zip", ".zip")
