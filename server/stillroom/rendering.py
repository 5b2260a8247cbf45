"""`stillroom render`: pictures of map files."""

from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Any

from stillroom.documents.files import ASSUMED, open_map
from stillroom.documents.pictures import Image, contact_sheet, draw, encode
from stillroom.maps.semantics import Ids
from stillroom.pipeline.adoption import adopt_map


def render_file(file: Path, given: dict[str, Any], rooms: bool) -> tuple[str, Image]:
    """A caption and the picture; with `rooms` as a first mission would make them. Raises InvalidInput, TooLarge."""
    opened = open_map(file)
    grid, semantics = opened.read(ASSUMED | given | opened.meta if opened.is_image else {})
    semantic_map = adopt_map(grid, semantics, file.stem, Ids()) if rooms else None
    size = f"{file.stem}, {grid.frame.width} x {grid.frame.height}"
    caption = size if semantic_map is None else f"{size}, {len(semantic_map.rooms)} rooms"
    return caption, draw(grid, semantic_map)


def save(folder: Path, file: Path, picture: Image) -> Path:
    """The picture in `folder`, named after the file; with a number where there is one of that name, which stays."""
    folder.mkdir(parents=True, exist_ok=True)
    numbered = (folder / f"{file.stem}{'' if n == 1 else f'-{n}'}.png" for n in count(1))
    target = next(path for path in numbered if not path.exists())
    target.write_bytes(encode(picture))
    return target


def save_sheet(file: Path, pictures: Sequence[tuple[str, Image]]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(encode(contact_sheet(pictures)))
