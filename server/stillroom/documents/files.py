"""Map files of any readable format on disk, as a robot would send them."""

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillroom.documents.grids import JSON_TYPE, read_mission_map
from stillroom.documents.images import PGM_TYPE, PNG_TYPE
from stillroom.documents.json_text import load_json
from stillroom.documents.missions import parse_meta
from stillroom.documents.nav2 import read_yaml
from stillroom.documents.umf import is_umf, read_umf
from stillroom.documents.valetudo import write_valetudo
from stillroom.errors import InvalidInput, StillroomError
from stillroom.maps.grid import OccupancyGrid
from stillroom.pipeline.adoption import RobotSemantics

IMAGE_SUFFIXES = {".png": PNG_TYPE, ".pgm": PGM_TYPE}
YAML_SUFFIXES = (".yaml", ".yml")
JSON_SUFFIX = ".json"
ASSUMED: dict[str, Any] = {"resolution": 0.05, "origin": [0.0, 0.0, 0.0]}
"""Where nothing says how large an image is and nobody needs to know exactly."""


@dataclass(frozen=True)
class MapFile:
    """`meta`: what the file, or the YAML file beside it, says of how to read it."""

    path: Path
    media_type: str
    content: bytes
    meta: dict[str, Any]

    @property
    def is_image(self) -> bool:
        return self.media_type != JSON_TYPE

    def read(self, given: dict[str, Any]) -> tuple[OccupancyGrid, RobotSemantics | None]:
        """The grid, and what the robot's app says about it; `given` wins over the file's own meta. Raises InvalidInput, TooLarge."""
        meta, _ = parse_meta(json.dumps({"sequence": 0} | self.meta | given, default=str).encode())
        return read_mission_map(self.content, meta.reading())


def in_words(error: StillroomError) -> str:
    """The whole of an error on one line."""
    return ": ".join([error.detail, *(f"{fault.pointer} {fault.detail}".strip() for fault in error.faults)])


def open_map(path: Path) -> MapFile:
    """A PNG or PGM (with a map_server YAML file of its name beside it, where there is one), such a YAML file, a Valetudo map, an
    OccupancyGrid as JSON, or iRobot's UMF, which becomes a Valetudo map. Raises InvalidInput."""
    suffix = path.suffix.lower()
    if suffix in YAML_SUFFIXES:
        name, meta = read_yaml(_read(path))
        return _image(_find_image(path, name), meta)
    if suffix in IMAGE_SUFFIXES:
        return _image(path, _said_beside(path))
    if suffix == JSON_SUFFIX:
        return MapFile(path, JSON_TYPE, _as_sent(_read(path)), {})
    raise InvalidInput("only PNG and PGM images, map_server YAML and JSON maps are read")


def _as_sent(content: bytes) -> bytes:
    document = load_json(content, "")
    if not is_umf(document):
        return content
    found = read_umf(document)
    segments = [(str(number), name) for number, name in enumerate(found.semantics.names, 1)]
    return write_valetudo(found.grid, found.semantics.labels, segments, found.semantics.restrictions)


def _said_beside(image: Path) -> dict[str, Any]:
    """What a map_server file of the image's name says; nothing where there is none, or one of another kind."""
    for suffix in YAML_SUFFIXES:
        with suppress(InvalidInput):
            return read_yaml(_read(image.with_suffix(suffix)))[1]
    return {}


def _find_image(described: Path, name: str) -> Path:
    """The image a YAML file names; where that was made on another machine, the one of its own name beside it."""
    named = described.parent / name
    beside = (described.with_suffix(suffix) for suffix in IMAGE_SUFFIXES)
    return named if named.is_file() else next((path for path in beside if path.is_file()), named)


def _image(path: Path, meta: dict[str, Any]) -> MapFile:
    media_type = IMAGE_SUFFIXES.get(path.suffix.lower())
    if media_type is None:
        raise InvalidInput(f"only PNG and PGM images are read, and {path} is neither")
    return MapFile(path, media_type, _read(path), meta)


def _read(path: Path) -> bytes:
    if not path.is_file():
        raise InvalidInput(f"there is no such file as {path}")
    return path.read_bytes()
