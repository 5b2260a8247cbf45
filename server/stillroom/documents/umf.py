"""iRobot's map documents (UMF, format 4), as far as they say what a map is: regions with names, borders, frontiers, keep-out zones.

Metres, y up. The document has polygons and no grid; one is drawn from them.
"""

from typing import Annotated, Any

import cv2
import numpy as np
import shapely
from pydantic import BaseModel, Field, ValidationError
from shapely import LineString, Polygon

from stillroom.documents.images import check_size
from stillroom.documents.missions import Metres, faults_of
from stillroom.documents.valetudo import ValetudoMap
from stillroom.errors import Fault, InvalidGrid
from stillroom.maps.geometry import Points, Pose, as_points, as_tuples, polygons_in
from stillroom.maps.grid import Cell, GridFrame, Mask, OccupancyGrid
from stillroom.maps.semantics import Restriction
from stillroom.pipeline.adoption import RobotSemantics
from stillroom.pipeline.cells import cells_in

RESOLUTION = 0.05
MARGIN_CELLS = 2
FRONTIER_REACH_M = 0.15
"""Where the free area ends this near to a frontier, nothing is known beyond; elsewhere there is a wall."""

Ids = list[list[str]]


class _Geometry(BaseModel):
    ids: Ids = []


class _Shape(BaseModel):
    id: str = ""
    name: str = ""
    geometry: _Geometry = _Geometry()


class _Border(_Shape):
    free_type: str = "free"


class _Layer(BaseModel):
    layer_type: str
    geometry: Any = None


class _Point(BaseModel):
    id: str
    coordinates: tuple[Metres, Metres]


class _Map(BaseModel):
    points2d: list[_Point]
    regions: list[_Shape] = []
    borders: list[_Border] = []
    layers: list[_Layer] = []
    keepoutzones: list[_Shape] = []


class _Document(BaseModel):
    maps: Annotated[list[_Map], Field(min_length=1, max_length=1)]


def is_umf(document: Any) -> bool:
    inner = document.get("umf", document) if isinstance(document, dict) else None
    return isinstance(inner, dict) and "maps" in inner and "format_version" in inner


def read_umf(document: Any) -> ValetudoMap:
    """A grid of 5 cm drawn from the document, its regions as segments. Raises InvalidGrid, TooLarge."""
    try:
        said = _Document.model_validate(document.get("umf", document)).maps[0]
    except ValidationError as error:
        raise InvalidGrid("The UMF document can't be read.", faults_of(error)) from None
    places = {point.id: point.coordinates for point in said.points2d}
    regions = [_polygon(shape, places, "regions") for shape in said.regions]
    free = [_polygon(shape, places, "borders") for shape in said.borders if shape.free_type == "free"]
    everything = shapely.union_all([shapely.make_valid(shape) for shape in (*regions, *free)])
    if everything.is_empty:
        raise InvalidGrid("The UMF document has no regions and no borders.", (Fault("/maps/0/regions", "empty"),))
    frame = _frame(everything)
    floor = cells_in(polygons_in(everything), frame)
    labels = np.zeros(floor.shape, np.int32)
    for label, region in enumerate(regions, 1):
        labels[cells_in(polygons_in(shapely.make_valid(region)), frame)] = label
    frontiers = [
        as_points([places[key] for key in line if key in places])
        for layer in said.layers
        if layer.layer_type == "frontiers"
        for line in _Geometry.model_validate(layer.geometry or {}).ids
    ]
    cells = _with_walls(floor, [line for line in frontiers if len(line) > 1], frame)
    zones = [_polygon(shape, places, "keepoutzones") for shape in said.keepoutzones]
    restrictions = tuple(
        Restriction("", "no_go", as_tuples(shapely.get_coordinates(zone.exterior)[:-1])) for zone in zones
    )
    names = tuple(shape.name.strip() or None for shape in said.regions)
    return ValetudoMap(OccupancyGrid(frame, cells), RobotSemantics(labels, names, restrictions))


def _polygon(shape: _Shape, places: dict[str, tuple[float, float]], kind: str) -> Polygon:
    """Raises InvalidGrid."""
    missing = [key for ring in shape.geometry.ids for key in ring if key not in places]
    rings = [[places[key] for key in ring if key in places] for ring in shape.geometry.ids]
    if missing or not rings or min(len(set(ring)) for ring in rings) < 3:
        detail = f"point {missing[0]} is missing" if missing else "fewer than three points"
        raise InvalidGrid(f"A polygon of {kind} can't be drawn.", (Fault(f"/maps/0/{kind}/{shape.id}", detail),))
    return Polygon(rings[0], rings[1:])


def _frame(shape: shapely.Geometry) -> GridFrame:
    """Whole cells of 5 cm around the shape, with a margin for its walls."""
    left, bottom = np.floor(np.array(shape.bounds[:2]) / RESOLUTION).astype(int) - MARGIN_CELLS
    right, top = np.ceil(np.array(shape.bounds[2:]) / RESOLUTION).astype(int) + MARGIN_CELLS
    width, height = int(right - left), int(top - bottom)
    check_size(width, height)
    return GridFrame(RESOLUTION, width, height, Pose(float(left * RESOLUTION), float(bottom * RESOLUTION)))


def _with_walls(floor: Mask, frontiers: list[Points], frame: GridFrame) -> np.ndarray:
    """A wall of one cell around the floor, open at the frontiers."""
    around = cv2.dilate(floor.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    cells = np.where(floor, Cell.FREE, np.where(around, Cell.OCCUPIED, Cell.UNEXPLORED)).astype(np.uint8)
    reach = shapely.buffer([LineString(line) for line in frontiers], FRONTIER_REACH_M)
    cells[cells_in(polygons_in(shapely.union_all(reach)), frame) & ~floor] = Cell.UNEXPLORED
    return cells
