"""A grid in whichever format a robot sends it: PNG, PGM, a Valetudo map, a nav_msgs/OccupancyGrid as JSON."""

from math import isclose, remainder, tau
from threading import BoundedSemaphore

from stillroom.documents import images
from stillroom.documents.images import IMAGE_TYPES, Reading, as_grey, encode_png, with_floor
from stillroom.documents.json_text import load_json
from stillroom.documents.occupancy_grid import is_occupancy_grid, read_occupancy_grid
from stillroom.documents.valetudo import is_valetudo, read_valetudo
from stillroom.errors import Fault, InvalidGrid, InvalidInput, UnsupportedFormat
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import GridFrame, OccupancyGrid
from stillroom.pipeline.adoption import RobotSemantics

_READERS = BoundedSemaphore(4)
"""So many grids are read at once in a process: the worst may take hundreds of megabytes while it is looked at."""
JSON_TYPE = "application/json"
SAME_RESOLUTION = 1e-4
SAME_PLACE_M, SAME_TURN = 1e-3, 1e-3
"""The meta and a grid that carries its own frame say the same within this."""


def check_type(content_type: str, content: bytes) -> None:
    """Raises UnsupportedFormat for a media type that is not read here, InvalidGrid where the bytes are of another."""
    known = [*IMAGE_TYPES, JSON_TYPE]
    if content_type not in known:
        said = content_type or "(none given)"
        raise UnsupportedFormat(f"A grid of type {said} is not read here; send {', '.join(known[:-1])} or {known[-1]}.")
    is_image = content.startswith(tuple(IMAGE_TYPES.values()))
    if is_image if content_type == JSON_TYPE else not content.startswith(IMAGE_TYPES[content_type]):
        raise InvalidGrid(f"The grid is not {content_type}.", (Fault("/grid", "another format than its type says"),))


def read_grid(content: bytes, reading: Reading) -> OccupancyGrid:
    """Raises InvalidGrid where the grid can't be read or holds no free cell, InvalidInput where `reading` leaves the frame open or
    contradicts the grid, TooLarge over 20 million cells."""
    return read_mission_map(content, reading)[0]


def read_mission_map(content: bytes, reading: Reading) -> tuple[OccupancyGrid, RobotSemantics | None]:
    """The same, with what the robot's app says about its map; None where the format has no place for that."""
    with _READERS:
        return _read(content, reading)


def _read(content: bytes, reading: Reading) -> tuple[OccupancyGrid, RobotSemantics | None]:
    if content.startswith(tuple(IMAGE_TYPES.values())):
        return images.read_grid(content, reading), None
    document = load_json(content, "/grid")
    if is_valetudo(document):
        found = read_valetudo(document)
        grid, semantics = found.grid, found.semantics
    elif is_occupancy_grid(document):
        grid, semantics = read_occupancy_grid(document, reading), None
    else:
        raise InvalidGrid(
            "The grid is neither a Valetudo map nor an OccupancyGrid.", (Fault("/grid", "an unknown kind of JSON"),)
        )
    _check_same(reading, grid.frame)
    return with_floor(grid), semantics


def as_png(content: bytes, reading: Reading) -> bytes:
    """The pixels that the robot sent, as PNG; 254 free, 0 occupied, 205 unexplored where it sent no picture."""
    if content.startswith(tuple(IMAGE_TYPES.values())):
        return images.as_png(content)
    return cells_as_png(content, reading)


def cells_as_png(content: bytes, reading: Reading) -> bytes:
    """What a stored grid means: 254 free, 0 occupied, 205 unexplored, top row first."""
    if content.startswith(tuple(IMAGE_TYPES.values())):
        return images.cells_as_png(content, reading)
    return encode_png(as_grey(read_grid(content, reading).cells[::-1]))


def _check_same(reading: Reading, frame: GridFrame) -> None:
    """Raises InvalidInput where the meta says another frame than the grid."""
    faults = []
    if reading.resolution is not None and not isclose(reading.resolution, frame.resolution, rel_tol=SAME_RESOLUTION):
        faults.append(Fault("/meta/resolution", f"the grid says {frame.resolution:g}"))
    if reading.origin is not None and not _is_same(reading.origin, frame.origin):
        o = frame.origin
        faults.append(Fault("/meta/origin", f"the grid says [{o.x:g}, {o.y:g}, {o.yaw:g}]"))
    if faults:
        raise InvalidInput("The meta contradicts the grid.", tuple(faults))


def _is_same(a: Pose, b: Pose) -> bool:
    apart = max(abs(a.x - b.x), abs(a.y - b.y))
    return apart <= SAME_PLACE_M and abs(remainder(a.yaw - b.yaw, tau)) <= SAME_TURN
