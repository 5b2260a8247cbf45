"""`stillroom segment`: the rooms of map files, made as if each were the first of its home, whatever the robot's own app calls a room."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.documents.features import features, frame
from stillroom.documents.files import ASSUMED, open_map
from stillroom.documents.pictures import draw, encode
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map, room_cells
from stillroom.pipeline.params import PARAMS

WHITE = {"free_thresh": 0.0197}
"""Images that nothing describes are plans as well as scans, with furniture in light grey: only grey levels from 250 up are free."""


@dataclass(frozen=True, eq=False)
class Segmented:
    """`labels`: (height, width), row 0 on top as in the file, 0 where there is no room, else the room's segment id; free cells alone."""

    semantic_map: SemanticMap
    grid: OccupancyGrid
    labels: npt.NDArray[np.uint16]


def segment_file(file: Path, given: dict[str, Any], sensitivity: float | None = None) -> Segmented:
    """Raises InvalidInput, TooLarge."""
    opened = open_map(file)
    grid, _ = opened.read(ASSUMED | WHITE | given | opened.meta if opened.is_image else {})
    params = PARAMS if sensitivity is None else replace(PARAMS, divider_sensitivity=sensitivity)
    semantic_map = create_map(grid, file.stem, Ids(), params)
    table = np.array([0, *(room.segment_id for room in semantic_map.rooms)], np.uint16)
    return Segmented(semantic_map, grid, table[room_cells(semantic_map, grid, params)[::-1]])


def save(folder: Path, stem: str, found: Segmented) -> None:
    """`STEM_rooms.png` (16 bits a cell), `STEM_rooms.geojson` and `STEM_picture.png`; files of these names are replaced."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{stem}_rooms.png").write_bytes(cv2.imencode(".png", found.labels)[1].tobytes())
    collection = {
        "type": "FeatureCollection",
        "frame": frame(found.semantic_map.frame).model_dump(),
        "features": [feature.model_dump() for feature in features(found.semantic_map)],
    }
    (folder / f"{stem}_rooms.geojson").write_text(json.dumps(collection, indent=1) + "\n")
    (folder / f"{stem}_picture.png").write_bytes(encode(draw(found.grid, found.semantic_map)))
