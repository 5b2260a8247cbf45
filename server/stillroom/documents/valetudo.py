"""Valetudo's map data format (https://valetudo.cloud, "Valetudo Core Concepts: Map Data Format"), read in both its forms and written.

Centimetres, y down: x = cm / 100, y = -cm / 100. A pixel (px, py) is the square [px, px + 1) x [py, py + 1) times `pixelSize`.
"""

import json
import unicodedata
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stillroom.documents.images import MAX_CELLS, check_size
from stillroom.documents.missions import FARTHEST_M, faults_of
from stillroom.errors import Fault, InvalidGrid, TooLarge
from stillroom.maps.geometry import Point, Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid, look_up
from stillroom.maps.semantics import Restriction, RestrictionKind
from stillroom.pipeline.adoption import Labels, RobotSemantics
from stillroom.pipeline.edits import LONGEST_NAME

CLASS = "ValetudoMap"
LAYERS = {"floor": Cell.FREE, "segment": Cell.FREE, "wall": Cell.OCCUPIED}
"""In this order, so that where layers overlap a segment covers floor, and a wall both."""
CORNERS: dict[str, tuple[RestrictionKind, int]] = {
    "no_go_area": ("no_go", 3),
    "no_mop_area": ("no_mop", 3),
    "virtual_wall": ("virtual_wall", 2),
}
"""Kind and least number of points of each entity that restricts the robot."""
ENTITY_OF: dict[RestrictionKind, str] = {kind: entity for entity, (kind, _) in CORNERS.items()}
MAX_SEGMENTS = 250
MAX_RESTRICTIONS = 500

Numbers = npt.NDArray[np.int64]
Centimetres = Annotated[float, Field(strict=True, ge=-100 * FARTHEST_M, le=100 * FARTHEST_M, allow_inf_nan=False)]


class _MetaData(BaseModel):
    model_config = ConfigDict(populate_by_name=True)

    segment_id: Annotated[str | int | None, Field(alias="segmentId")] = None
    name: str | None = None


class _Layer(BaseModel):
    type: str
    meta_data: Annotated[_MetaData, Field(alias="metaData")] = _MetaData()
    pixels: list[Any] = []
    compressed: Annotated[list[Any], Field(alias="compressedPixels")] = []


class _Entity(BaseModel):
    type: str
    points: list[Any] = []


class _Document(BaseModel):
    pixel_size: Annotated[float, Field(alias="pixelSize", strict=True, ge=0.1, le=100, allow_inf_nan=False)]
    layers: list[_Layer]
    entities: list[_Entity] = []


@dataclass(frozen=True, eq=False)
class ValetudoMap:
    grid: OccupancyGrid
    """As large as the pixels need."""
    semantics: RobotSemantics


def is_valetudo(document: Any) -> bool:
    return isinstance(document, dict) and document.get("__class") == CLASS


def read_valetudo(document: Any) -> ValetudoMap:
    """Raises InvalidGrid, TooLarge."""
    try:
        said = _Document.model_validate(document)
    except ValidationError as error:
        raise InvalidGrid("The Valetudo map can't be read.", faults_of(error, "/grid")) from None
    count = sum(layer.type == "segment" for layer in said.layers)
    if count > MAX_SEGMENTS:
        raise TooLarge(f"The map has {count} segments; at most {MAX_SEGMENTS} are taken.", limit_segments=MAX_SEGMENTS)
    layers = [
        (layer, _runs(layer, f"/grid/layers/{i}", said.pixel_size))
        for kind in LAYERS
        for i, layer in enumerate(said.layers)
        if layer.type == kind
    ]
    everything = np.concatenate([runs for _, runs in layers]) if layers else np.zeros((0, 3), np.int64)
    if not len(everything):
        raise InvalidGrid("The Valetudo map has no pixels.", (Fault("/grid/layers", "no pixels"),))
    left, top = everything[:, :2].min(0).tolist()
    right, bottom = int((everything[:, 0] + everything[:, 2]).max()), int(everything[:, 1].max()) + 1
    width, height = right - left, bottom - top
    check_size(width, height)
    if everything[:, 2].sum() > MAX_CELLS:
        raise TooLarge(f"The layers have more than {MAX_CELLS} pixels together.", limit_cells=MAX_CELLS)
    cells = np.full((height, width), Cell.UNEXPLORED, np.uint8)
    labels = np.zeros((height, width), np.int32)
    ids: dict[str | int | None, int] = {}
    names: dict[int, str | None] = {}
    for layer, runs in layers:
        label = 0
        if layer.type == "segment":
            label = ids.setdefault(layer.meta_data.segment_id, len(ids) + 1)
            names[label] = names.get(label) or _clean(layer.meta_data.name)
        place = _cells(runs - (left, top, 0), width)
        cells.flat[place], labels.flat[place] = LAYERS[layer.type], label
    resolution = said.pixel_size / 100
    frame = GridFrame(resolution, width, height, Pose(left * said.pixel_size / 100, -bottom * said.pixel_size / 100))
    grid = OccupancyGrid(frame, np.ascontiguousarray(cells[::-1]))
    restrictions = tuple(_restrictions(said.entities))
    return ValetudoMap(grid, RobotSemantics(np.ascontiguousarray(labels[::-1]), tuple(names.values()), restrictions))


def write_valetudo(
    grid: OccupancyGrid, labels: Labels, segments: Sequence[tuple[str, str | None]], restrictions: Sequence[Restriction]
) -> bytes:
    """The current form. `labels`: (height, width), k + 1 where `segments[k]`, an (id, name), lies and 0 elsewhere.

    The format knows only whole pixels without rotation: another grid is resampled to the nearest cell, at most half a cell away.
    """
    frame = _upright(grid.frame)
    rows, columns = np.mgrid[: frame.height, : frame.width]
    centres = frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1)) + 0.5)
    places = grid.frame.to_cells(centres)
    cells = look_up(grid.cells, places, Cell.UNEXPLORED).reshape(frame.height, frame.width)
    labels = look_up(labels, places, 0).reshape(frame.height, frame.width)
    labels = np.where(cells == Cell.FREE, labels, 0)
    left, bottom = (round(value / frame.resolution) for value in (frame.origin.x, -frame.origin.y))
    top = bottom - frame.height
    layers: list[dict[str, Any]] = []
    for label, (key, name) in enumerate(segments, 1):
        named = {} if name is None else {"name": name}
        meta = {"segmentId": key, "active": False, "source": "regular"} | named
        layers += _layer("segment", labels == label, left, top, frame.resolution, meta)
    layers += _layer("floor", (cells == Cell.FREE) & (labels == 0), left, top, frame.resolution, {})
    layers += _layer("wall", cells == Cell.OCCUPIED, left, top, frame.resolution, {})
    size = 100 * frame.resolution
    document = {
        "__class": CLASS,
        "metaData": {"version": 2, "nonce": "", "totalLayerArea": sum(layer["metaData"]["area"] for layer in layers)},
        "size": {"x": _tidy((left + frame.width) * size), "y": _tidy(bottom * size)},
        "pixelSize": _tidy(size),
        "layers": layers,
        "entities": [_entity(restriction) for restriction in restrictions],
    }
    return json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode()


# -- reading -------------------------------------------------------------------------------------------------------


def _runs(layer: _Layer, at: str, pixel_size: float) -> Numbers:
    """x, y and length of each run of pixels, shape (n, 3). Raises InvalidGrid."""
    pairs = _whole_numbers(layer.pixels, 2, f"{at}/pixels")
    triples = _whole_numbers(layer.compressed, 3, f"{at}/compressedPixels")
    runs = np.concatenate([triples, np.column_stack([pairs, np.ones(len(pairs), np.int64)])])
    farthest = int(100 * FARTHEST_M / pixel_size)
    if len(runs) and (runs.min() < -farthest or runs.max() > farthest or runs[:, 2].min() < 1):
        raise InvalidGrid("The Valetudo map has pixels that can't be.", (Fault(at, "pixels out of range"),))
    return runs


def _whole_numbers(values: list[Any], columns: int, at: str) -> Numbers:
    try:
        numbers = np.frombuffer(array("q", values), np.int64)
    except (TypeError, OverflowError):
        raise InvalidGrid("The Valetudo map can't be read.", (Fault(at, "not whole numbers"),)) from None
    if len(numbers) % columns:
        raise InvalidGrid("The Valetudo map can't be read.", (Fault(at, f"not a multiple of {columns} numbers"),))
    return numbers.reshape(-1, columns)


def _cells(runs: Numbers, width: int) -> npt.NDArray[np.int32]:
    """Indices into the flat grid of every cell in the runs, in their order."""
    x, y, length = runs.astype(np.int32).T
    ends = np.cumsum(length, dtype=np.int32)
    first = y * np.int32(width) + x - (ends - length)
    return np.repeat(first, length) + np.arange(ends[-1] if len(ends) else 0, dtype=np.int32)


def _restrictions(entities: Sequence[_Entity]) -> Iterator[Restriction]:
    """Without ids. Raises InvalidGrid, TooLarge."""
    found = [(i, entity) for i, entity in enumerate(entities) if entity.type in CORNERS]
    if len(found) > MAX_RESTRICTIONS:
        said = f"The map has {len(found)} restrictions; at most {MAX_RESTRICTIONS} are taken."
        raise TooLarge(said, limit_restrictions=MAX_RESTRICTIONS)
    for i, entity in found:
        kind, least = CORNERS[entity.type]
        at = f"/grid/entities/{i}/points"
        shape = tuple(_points(entity.points, at))
        if len(shape) > 1 and shape[0] == shape[-1]:
            shape = shape[:-1]
        if len(shape) < least or (kind == "virtual_wall" and len(shape) != least):
            raise InvalidGrid(f"A {entity.type} has {len(shape)} points.", (Fault(at, f"{least} points are needed"),))
        yield Restriction("", kind, shape)


def _points(values: list[Any], at: str) -> Iterator[Point]:
    fine = [isinstance(v, int | float) and abs(v) <= 100 * FARTHEST_M for v in values]
    if len(values) % 2 or not all(fine):
        raise InvalidGrid("The Valetudo map can't be read.", (Fault(at, "not pairs of numbers within the map"),))
    for x, y in zip(values[::2], values[1::2], strict=True):
        yield x / 100, -y / 100


def _clean(name: str | None) -> str | None:
    """A name as people may give it (`edits`); None where nothing of it is left."""
    letters = (c for c in unicodedata.normalize("NFC", name or "") if unicodedata.category(c) not in _NO_LETTERS)
    return "".join(letters).strip()[:LONGEST_NAME].strip() or None


_NO_LETTERS = ("Cc", "Cs", "Co", "Cn", "Zl", "Zp")

# -- writing -------------------------------------------------------------------------------------------------------


def _upright(frame: GridFrame) -> GridFrame:
    """The smallest frame of whole pixels without rotation that holds another; the same where that is one."""
    cell = frame.resolution
    corners = frame.to_map(as_points([(0, 0), (frame.width, 0), (frame.width, frame.height), (0, frame.height)])) / cell
    low, high = np.round(corners.min(0), 6), np.round(corners.max(0), 6)
    if frame.origin.yaw == 0:
        low = np.round(low)
        high = low + np.array([frame.width, frame.height])
    (left, bottom), (right, top) = np.floor(low).astype(int).tolist(), np.ceil(high).astype(int).tolist()
    return GridFrame(cell, right - left, top - bottom, Pose(left * cell, bottom * cell))


def _layer(
    kind: Literal["segment", "floor", "wall"],
    mask: npt.NDArray[np.bool_],
    left: int,
    top: int,
    resolution: float,
    meta: dict[str, Any],
) -> list[dict[str, Any]]:
    """One layer, or none where the mask (row 0 at the bottom) is empty."""
    if not mask.any():
        return []
    image = mask[::-1].astype(np.int8)
    steps = np.diff(np.pad(image, ((0, 0), (1, 1))), axis=1)
    (rows, starts), (_, ends) = np.nonzero(steps == 1), np.nonzero(steps == -1)
    runs = np.stack([starts + left, rows + top, ends - starts], 1)
    count = int(mask.sum())
    dimensions = {
        axis: {"min": int(low), "max": int(high), "mid": round((low + high) / 2), "avg": round(mean)}
        for axis, low, high, mean in (
            ("x", runs[:, 0].min(), (runs[:, 0] + runs[:, 2]).max() - 1, left + np.nonzero(image)[1].mean()),
            ("y", runs[:, 1].min(), runs[:, 1].max(), top + np.nonzero(image)[0].mean()),
        )
    }
    return [
        {
            "__class": "MapLayer",
            "metaData": meta | {"area": round(count * (100 * resolution) ** 2)},
            "type": kind,
            "pixels": [],
            "compressedPixels": runs.ravel().tolist(),
            "dimensions": dimensions | {"pixelCount": count},
        }
    ]


def _entity(restriction: Restriction) -> dict[str, Any]:
    line = restriction.kind == "virtual_wall"
    return {
        "__class": "LineMapEntity" if line else "PolygonMapEntity",
        "metaData": {},
        "type": ENTITY_OF[restriction.kind],
        "points": [_tidy(value) for x, y in restriction.shape for value in (100 * x, -100 * y)],
    }


def _tidy(value: float) -> float:
    """Whole numbers as such, others without what rounding left."""
    rounded = round(value, 6)
    return int(rounded) if rounded == int(rounded) else rounded
