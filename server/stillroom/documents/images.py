"""Occupancy grids as images, with map_server's meaning of grey (http://wiki.ros.org/map_server, nav2_map_server)."""

import re
import struct
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from stillroom.errors import Fault, InvalidGrid, InvalidInput, TooLarge
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import LARGEST, Cell, Cells, GridFrame, OccupancyGrid

# A broken image is told to the one who sent it, not to our log.
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

MAX_CELLS = LARGEST
UNKNOWN_GREY = 205
"""In trinary mode always unexplored, whatever the thresholds."""
PNG_TYPE, PGM_TYPE = "image/png", "image/x-portable-graymap"
MARKED_SHARE = 5e-4
"""No more of a picture than this may be coloured: somebody marked places on it, of whose cells nothing is known then."""
IMAGE_TYPES = {PNG_TYPE: b"\x89PNG\r\n\x1a\n", PGM_TYPE: b"P"}
GREY_OF = {Cell.UNEXPLORED: UNKNOWN_GREY, Cell.FREE: 254, Cell.OCCUPIED: 0}

Grey = npt.NDArray[np.uint8]
"""Shape (height, width); row 0 is the highest y, as in the file."""
Mode = Literal["trinary", "scale", "raw"]


@dataclass(frozen=True)
class Reading:
    """How a grid is to be understood; `resolution` (metres a cell) and `origin` are None where the grid has to say them itself."""

    resolution: float | None = None
    origin: Pose | None = None
    mode: Mode = "trinary"
    negate: bool = False
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196


def read_grid(content: bytes, reading: Reading) -> OccupancyGrid:
    """Raises InvalidInput where the reading leaves the frame open, InvalidGrid where the image can't be read or holds no free
    cell, TooLarge over 20 million cells."""
    if reading.resolution is None or reading.origin is None:
        missing = [name for name in ("resolution", "origin") if getattr(reading, name) is None]
        faults = tuple(Fault(f"/meta/{name}", f"{name} is required: an image does not carry it") for name in missing)
        raise InvalidInput("The meta does not say how to read the grid.", faults)
    grey, transparent = decode_image(content)
    cells = np.ascontiguousarray(classify(grey, transparent, reading)[::-1])
    height, width = cells.shape
    return with_floor(OccupancyGrid(GridFrame(reading.resolution, width, height, reading.origin), cells))


def with_floor(grid: OccupancyGrid) -> OccupancyGrid:
    """The same grid. Raises InvalidGrid where it has no free cell."""
    if not grid.free.any():
        raise InvalidGrid("The grid has no free cell at all.", (Fault("/grid", "no free cell"),))
    return grid


def classify(grey: Grey, transparent: npt.NDArray[np.bool_] | None, reading: Reading) -> Cells:
    """Grey levels as values of `Cell`, in the rows' order of the image."""
    value = np.arange(256)
    occupancy = value / 255 if reading.negate else (255 - value) / 255
    table = np.full(256, Cell.UNEXPLORED, np.uint8)
    if reading.mode == "raw":
        # The value itself is the occupancy in percent; above 100 nothing is known.
        known = value <= 100
        occupancy = value / 100
    elif reading.mode == "trinary":
        known = value != UNKNOWN_GREY
    else:
        known = np.full(256, True)
    table[known & (occupancy > reading.occupied_thresh)] = Cell.OCCUPIED
    table[known & (occupancy < reading.free_thresh)] = Cell.FREE
    cells = np.asarray(cv2.LUT(grey, table), np.uint8)
    if transparent is not None:
        cells[transparent] = Cell.UNEXPLORED
    return cells


def decode_image(content: bytes) -> tuple[Grey, npt.NDArray[np.bool_] | None]:
    """The grey levels of a PNG or PGM, and where a PNG is transparent or marked in colour (None: nowhere)."""
    if content.startswith(IMAGE_TYPES["image/png"]):
        return _decode_png(content)
    if content[:2] in (b"P2", b"P5"):
        return _decode_pgm(content), None
    raise InvalidGrid("The grid is neither a PNG nor a PGM image.", (Fault("/grid", "not an image"),))


def as_png(content: bytes) -> bytes:
    """A stored image as PNG: a PNG as it was sent, a PGM with the same pixels."""
    if content.startswith(IMAGE_TYPES["image/png"]):
        return content
    return encode_png(_decode_pgm(content))


def cells_as_png(content: bytes, reading: Reading) -> bytes:
    """What a stored image means: 254 free, 0 occupied, 205 unexplored, in the rows' order of the image."""
    return encode_png(as_grey(classify(*decode_image(content), reading)))


def as_grey(cells: Cells) -> Grey:
    """Values of `Cell` as 254 free, 0 occupied, 205 unexplored; rows stay in their order."""
    table = np.zeros(len(GREY_OF), np.uint8)
    table[list(GREY_OF)] = list(GREY_OF.values())
    return np.asarray(table[cells])


def encode_pgm(grey: Grey) -> bytes:
    height, width = grey.shape
    return f"P5\n{width} {height}\n255\n".encode() + grey.tobytes()


def encode_png(grey: Grey) -> bytes:
    options = [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]
    return cv2.imencode(".png", grey, options)[1].tobytes()


def _decode_png(content: bytes) -> tuple[Grey, npt.NDArray[np.bool_] | None]:
    if len(content) < 33 or content[12:16] != b"IHDR":
        raise _cut_off("PNG")
    width, height, depth = struct.unpack(">IIB", content[16:25])
    check_size(width, height)
    if depth == 16:
        raise _sixteen_bit()
    try:
        pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None or pixels.shape[:2] != (height, width) or pixels.dtype != np.uint8:
        raise _cut_off("PNG")
    if pixels.ndim == 2:
        return np.asarray(pixels, np.uint8), None
    colours, alpha = pixels[..., :3], pixels[..., 3] if pixels.shape[2] == 4 else None
    blank = np.zeros((height, width), np.bool_) if alpha is None else np.equal(alpha, 0)
    coloured = ((colours[..., 0] != colours[..., 1]) | (colours[..., 1] != colours[..., 2])) & ~blank
    if np.count_nonzero(coloured) > MARKED_SHARE * coloured.size:
        raise InvalidGrid("The grid has colours; send grey levels.", (Fault("/grid", "colours"),))
    return np.ascontiguousarray(colours[..., 0], np.uint8), blank | coloured


_PGM_HEADER = re.compile(rb"P([25])(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})\s")


def _decode_pgm(content: bytes) -> Grey:
    header = _PGM_HEADER.match(content)
    if header is None:
        raise _cut_off("PGM")
    kind, width, height, greatest = header[1], int(header[2]), int(header[3]), int(header[4])
    check_size(width, height)
    if greatest > 255:
        raise _sixteen_bit()
    body = content[header.end() :]
    if kind == b"5":
        levels = np.frombuffer(body, np.uint8)
    else:
        try:
            levels = np.array(re.sub(rb"#[^\n]*", b"", body).split()[: width * height], np.int64)
        except (ValueError, OverflowError):
            raise _cut_off("PGM") from None
    if greatest == 0 or len(levels) < width * height:
        raise _cut_off("PGM")
    levels = levels[: width * height]
    if levels.min() < 0 or levels.max() > greatest:
        raise InvalidGrid(f"The PGM has a level outside of 0 to {greatest}.", (Fault("/grid", "level out of range"),))
    stretched = (levels.astype(np.int64) * 255 + greatest // 2) // greatest if greatest < 255 else levels
    return stretched.astype(np.uint8).reshape(height, width)


def check_size(width: int, height: int) -> None:
    if width == 0 or height == 0:
        raise InvalidGrid("The grid has no cells.", (Fault("/grid", "no cells"),))
    if width * height > MAX_CELLS:
        raise TooLarge(f"The grid has {width} x {height} cells; at most {MAX_CELLS} are taken.", limit_cells=MAX_CELLS)


def _cut_off(kind: str) -> InvalidGrid:
    return InvalidGrid(f"The {kind} is cut off or damaged.", (Fault("/grid", "cut off or damaged"),))


def _sixteen_bit() -> InvalidGrid:
    return InvalidGrid("The grid has 16 bits a cell; send 8.", (Fault("/grid", "16 bits a cell"),))
