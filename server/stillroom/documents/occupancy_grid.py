"""nav_msgs/OccupancyGrid as JSON, as rosbridge and `ros2 topic echo` tools write it (https://docs.ros2.org, nav_msgs/msg/OccupancyGrid)."""

import json
from array import array
from math import atan2, cos, hypot, sin
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stillroom.documents.images import Reading, check_size
from stillroom.documents.missions import Metres, Resolution, faults_of
from stillroom.errors import Fault, InvalidGrid
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, Cells, GridFrame, OccupancyGrid

UPRIGHT = 0.01
"""How far a quaternion may be from a unit turn about the vertical axis."""
PERCENT = {Cell.UNEXPLORED: -1, Cell.FREE: 0, Cell.OCCUPIED: 100}
Percent = npt.NDArray[np.int16]
Share = Annotated[float, Field(strict=True, ge=-2, le=2, allow_inf_nan=False)]
Length = Annotated[int, Field(strict=True, ge=0, le=2**31 - 1)]


class _Position(BaseModel):
    x: Metres = 0.0
    y: Metres = 0.0


class _Quaternion(BaseModel):
    x: Share = 0.0
    y: Share = 0.0
    z: Share = 0.0
    w: Share = 1.0


class _Pose(BaseModel):
    position: _Position = _Position()
    orientation: _Quaternion = _Quaternion()


class _Info(BaseModel):
    resolution: Resolution
    width: Length
    height: Length
    origin: _Pose = _Pose()


class _Message(BaseModel):
    model_config = ConfigDict(strict=True)

    info: _Info
    data: list[Any]


def is_occupancy_grid(document: Any) -> bool:
    return isinstance(document, dict) and "info" in document and "data" in document


def read_occupancy_grid(document: Any, reading: Reading) -> OccupancyGrid:
    """The grid in its own frame; probabilities between 0 and 100 by the thresholds of `reading`, all else unexplored.

    Raises InvalidGrid, TooLarge.
    """
    try:
        message = _Message.model_validate(document)
    except ValidationError as error:
        raise InvalidGrid("The OccupancyGrid can't be read.", faults_of(error, "/grid")) from None
    width, height = message.info.width, message.info.height
    check_size(width, height)
    if len(message.data) != width * height:
        said = f"{len(message.data)} values for {width} x {height} cells"
        raise InvalidGrid("The OccupancyGrid has another number of cells than it says.", (Fault("/grid/data", said),))
    cells = classify_percent(_bytes_of(message.data), reading).reshape(height, width)
    frame = GridFrame(message.info.resolution, width, height, _origin(message.info.origin))
    return OccupancyGrid(frame, cells)


def classify_percent(percent: Percent, reading: Reading) -> Cells:
    """Occupancy in percent as values of `Cell`, in the same shape; outside of 0 to 100 nothing is known."""
    table = np.full(101, Cell.UNEXPLORED, np.uint8)
    share = np.arange(101) / 100
    table[share > reading.occupied_thresh] = Cell.OCCUPIED
    table[share < reading.free_thresh] = Cell.FREE
    known = (percent >= 0) & (percent <= 100)
    return np.where(known, table[np.where(known, percent, 0)], np.uint8(Cell.UNEXPLORED))


def write_occupancy_grid(grid: OccupancyGrid) -> bytes:
    """The message as JSON: -1, 0 and 100."""
    frame = grid.frame
    o = frame.origin
    percent = np.zeros(len(PERCENT), np.int8)
    percent[list(PERCENT)] = list(PERCENT.values())
    message = {
        "header": {"frame_id": "map"},
        "info": {
            "resolution": frame.resolution,
            "width": frame.width,
            "height": frame.height,
            "origin": {
                "position": {"x": o.x, "y": o.y, "z": 0.0},
                "orientation": {"x": 0.0, "y": 0.0, "z": sin(o.yaw / 2), "w": cos(o.yaw / 2)},
            },
        },
        "data": percent[grid.cells].ravel().tolist(),
    }
    return json.dumps(message, separators=(",", ":")).encode()


def _bytes_of(data: list[Any]) -> Percent:
    """Raises InvalidGrid for anything but whole numbers of one byte, signed or not."""
    try:
        values = np.frombuffer(array("h", data), np.int16)
    except (TypeError, OverflowError):
        values = None
    if values is None or values.min(initial=0) < -128 or values.max(initial=0) > 255:
        fault = Fault("/grid/data", "not whole numbers of one byte")
        raise InvalidGrid("The OccupancyGrid has values that are no percentages.", (fault,))
    return values


def _origin(pose: _Pose) -> Pose:
    q = pose.orientation
    if hypot(q.x, q.y) > UPRIGHT or abs(hypot(q.z, q.w) - 1) > UPRIGHT:
        fault = Fault("/grid/info/origin/orientation", "not a unit quaternion about the vertical axis")
        raise InvalidGrid("The OccupancyGrid does not lie flat.", (fault,))
    return Pose(pose.position.x, pose.position.y, 2 * atan2(q.z, q.w))
