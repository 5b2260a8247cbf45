"""Pictures of maps: the grid, its rooms in colours with names and areas, walls, dividers, clutter, restrictions; and contact sheets."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from stillroom.maps.geometry import Points, Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Restriction, Room, SemanticMap

Image = npt.NDArray[np.uint8]
"""Shape (height, width, 3), blue, green, red; row 0 is the highest y."""
Colour = tuple[int, int, int]

LONGEST_SIDE = 1200
MARGIN_CELLS = 8
SUBPIXEL = 4
PAPER: Colour = (255, 255, 255)
INK: Colour = (40, 34, 30)
CELLS: dict[Cell, Colour] = {Cell.UNEXPLORED: (219, 221, 222), Cell.FREE: (250, 251, 252), Cell.OCCUPIED: INK}
WALL: Colour = (96, 60, 36)
EDGE_OF_KNOWN: Colour = (190, 160, 130)
DIVIDER: Colour = (40, 110, 20)
META: Colour = (200, 60, 170)
CLUTTER: Colour = (95, 125, 150)
EMPHASIS: Colour = (20, 90, 240)
RESTRICTION: dict[str, Colour] = {"no_go": (40, 40, 215), "virtual_wall": (40, 40, 215), "no_mop": (215, 130, 30)}
ROOMS: tuple[Colour, ...] = (
    (169, 218, 202),
    (113, 162, 222),
    (254, 210, 189),
    (150, 230, 244),
    (204, 192, 242),
    (149, 173, 115),
    (222, 161, 151),
    (186, 159, 168),
)
"""The web app's colours of rooms."""
# OpenCV remembers glyphs by font and not by weight, so that each weight needs a font of its own.
FONTS = {weight: cv2.FontFace("sans") for weight in (400, 600)}
REGULAR, BOLD = FONTS


@dataclass(frozen=True)
class _Canvas:
    image: Image
    frame: GridFrame
    scale: float

    def pixels(self, points: Points) -> npt.NDArray[np.int32]:
        """Points (n, 2) of the map frame in fixed-point pixels, as OpenCV's shapes take them."""
        x, y = (self.frame.to_cells(points) * self.scale).T
        placed = (np.stack([x, self.image.shape[0] - y], 1) - 0.5) * 2**SUBPIXEL
        return np.asarray(np.round(placed), np.int32)

    def line(self, points: Points, colour: Colour, thickness: int) -> None:
        cv2.polylines(self.image, [self.pixels(points)], False, colour, thickness, cv2.LINE_AA, SUBPIXEL)

    def fill(self, polygons: Iterable[Polygon], colour: Colour) -> None:
        for polygon in polygons:
            rings = [self.pixels(shapely.get_coordinates(ring)) for ring in (polygon.exterior, *polygon.interiors)]
            cv2.fillPoly(self.image, rings, colour, cv2.LINE_AA, SUBPIXEL)

    def blend(self, below: Image, share: float) -> None:
        """What was drawn since `below`, as if it covered only `share`."""
        cv2.addWeighted(self.image, share, below, 1 - share, 0, dst=self.image)


def draw(
    grid: OccupancyGrid, semantic_map: SemanticMap | None = None, emphasised: Collection[str] = frozenset()
) -> Image:
    """What is known of the grid, and over it the map's rooms and features; at most 1200 pixels on the longer side.

    `emphasised`: ids of rooms that have a bold outline.
    """
    grid = _known_part(grid)
    frame = grid.frame
    fits = LONGEST_SIDE / max(frame.width, frame.height)
    scale = float(min(int(fits), 16)) if fits >= 1 else fits
    canvas = _Canvas(_cells(grid, scale), frame, scale)
    if semantic_map is not None:
        _draw_rooms(canvas, semantic_map, grid)
        _draw_features(canvas, semantic_map)
        for restriction in semantic_map.restrictions:
            _draw_restriction(canvas, restriction)
        for room in semantic_map.rooms:
            if room.id in emphasised:
                canvas.line(shapely.get_coordinates(room.polygon.exterior), EMPHASIS, 5)
        for room in semantic_map.rooms:
            _label(canvas, room)
    return canvas.image


def encode(image: Image) -> bytes:
    """As PNG."""
    return cv2.imencode(".png", image)[1].tobytes()


def contact_sheet(pictures: Sequence[tuple[str, Image]], tile: int = 360, columns: int | None = None) -> Image:
    """Many pictures on one, each `tile` pixels wide and high at most, over its caption."""
    columns = columns or max(1, ceil(sqrt(len(pictures) * 1.5)))
    margin, line = 12, 26
    rows = ceil(len(pictures) / columns)
    width, height = columns * (tile + margin) + margin, rows * (tile + line + margin) + margin
    sheet = np.full((height, width, 3), PAPER, np.uint8)
    for index, (caption, picture) in enumerate(pictures):
        row, column = divmod(index, columns)
        x, y = margin + column * (tile + margin), margin + row * (tile + line + margin)
        small = _shrunk(picture, tile)
        dy, dx = (tile - small.shape[0]) // 2, (tile - small.shape[1]) // 2
        sheet[y + dy : y + dy + small.shape[0], x + dx : x + dx + small.shape[1]] = small
        _write(sheet, _shortened(caption, tile, 14), (x, y + tile + 18), 14)
    return sheet


def _known_part(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid without what is unexplored around it, but for a margin."""
    known = ~grid.unexplored
    rows, columns = np.flatnonzero(known.any(1)), np.flatnonzero(known.any(0))
    if not len(rows):
        return grid
    bottom, left = max(0, rows[0] - MARGIN_CELLS), max(0, columns[0] - MARGIN_CELLS)
    cells = grid.cells[bottom : rows[-1] + MARGIN_CELLS + 1, left : columns[-1] + MARGIN_CELLS + 1]
    height, width = cells.shape
    x, y = grid.frame.to_map(as_points([(left, bottom)]))[0].tolist()
    return OccupancyGrid(GridFrame(grid.frame.resolution, width, height, Pose(x, y, grid.frame.origin.yaw)), cells)


def _cells(grid: OccupancyGrid, scale: float) -> Image:
    table = np.array([CELLS[cell] for cell in sorted(CELLS)], np.uint8)
    image = table[grid.cells[::-1]]
    size = max(1, round(grid.frame.width * scale)), max(1, round(grid.frame.height * scale))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST if scale >= 1 else cv2.INTER_AREA))


def _draw_rooms(canvas: _Canvas, semantic_map: SemanticMap, grid: OccupancyGrid) -> None:
    """Rooms under the occupied cells, so that what the robot sensed stays in sight."""
    sensed = canvas.image.copy()
    slots = _slots(semantic_map)
    for room in semantic_map.rooms:
        canvas.fill([room.polygon], ROOMS[slots[room.id]])
    canvas.blend(sensed, 0.85)
    size = canvas.image.shape[1::-1]
    occupied = cv2.resize(grid.occupied[::-1].astype(np.float32), size, interpolation=cv2.INTER_AREA)[..., None]
    canvas.image[:] = np.round(canvas.image * (1 - 0.8 * occupied) + np.array(INK) * 0.8 * occupied).astype(np.uint8)


def _draw_features(canvas: _Canvas, semantic_map: SemanticMap) -> None:
    thin = 1 if canvas.scale < 2 else 2
    for clutter in semantic_map.clutter:
        canvas.line(shapely.get_coordinates(clutter.polygon.exterior), CLUTTER, thin)
    for correction in semantic_map.meta.occupancy:
        canvas.line(shapely.get_coordinates(correction.polygon.exterior), META, thin)
    for wall in semantic_map.walls:
        canvas.line(as_points(wall.line), WALL if wall.kind == "wall" else EDGE_OF_KNOWN, thin)
    for divider in semantic_map.dividers:
        canvas.line(as_points(divider.line), DIVIDER, thin + 1)
    for meta_divider in semantic_map.meta.dividers:
        canvas.line(as_points(meta_divider.line), META, thin + 1)


def _draw_restriction(canvas: _Canvas, restriction: Restriction) -> None:
    """Filled where it is placed, an outline alone where it is not."""
    points, colour = as_points(restriction.shape), RESTRICTION[restriction.kind]
    if restriction.kind == "virtual_wall":
        canvas.line(points, colour, 3)
        return
    if restriction.placed:
        below = canvas.image.copy()
        canvas.fill([Polygon(points)], colour)
        canvas.blend(below, 0.35)
    canvas.line(np.concatenate([points, points[:1]]), colour, 2)


def _slots(semantic_map: SemanticMap) -> dict[str, int]:
    """A colour for each room: that of its segment id, or the next one that no neighbour has."""
    beside: dict[str, set[str]] = {room.id: set() for room in semantic_map.rooms}
    sides = [d.rooms for d in semantic_map.dividers] + [d.rooms for d in semantic_map.meta.dividers]
    for rooms in sides:
        for room_id in rooms:
            beside.get(room_id, set()).update(rooms)
    slots: dict[str, int] = {}
    for room in sorted(semantic_map.rooms, key=lambda r: (r.segment_id, r.id)):
        wish = (room.segment_id - 1) % len(ROOMS)
        taken = {slots[other] for other in beside[room.id] if other in slots}
        free = ((wish + step) % len(ROOMS) for step in range(len(ROOMS)))
        slots[room.id] = next((slot for slot in free if slot not in taken), wish)
    return slots


def _label(canvas: _Canvas, room: Room) -> None:
    """Name and area in the widest place of the room, as large as fits; too small a room has none."""
    circle = shapely.maximum_inscribed_circle(room.polygon, tolerance=0.1)
    middle = canvas.pixels(shapely.get_coordinates(circle)[:1])[0] / 2**SUBPIXEL
    radius = circle.length / canvas.frame.resolution * canvas.scale
    area = f"{room.polygon.area:.1f} m²"
    widest = max(_width(room.name, 20, BOLD), _width(area, 20)) / 20
    size = int(min(18, 1.8 * radius / max(widest, 1)))
    if size < 7:
        return
    for text, lift, weight in ((room.name, -0.15, BOLD), (area, 1.05, REGULAR)):
        x, y = middle[0] - _width(text, size, weight) / 2, middle[1] + lift * size
        _write(canvas.image, text, (round(x), round(y)), size, weight)


def _write(image: Image, text: str, at: tuple[int, int], size: int, weight: int = REGULAR) -> None:
    cv2.putText(image, text, at, INK, FONTS[weight], size, weight)


def _width(text: str, size: int, weight: int = REGULAR) -> int:
    return int(cv2.getTextSize((0, 0), text, (0, 0), FONTS[weight], size, weight)[2])


def _shortened(text: str, width: int, size: int) -> str:
    while len(text) > 1 and _width(text, size) > width:
        text = text[:-2] + "…"
    return text


def _shrunk(image: Image, side: int) -> Image:
    share = side / max(image.shape[:2])
    size = max(1, round(image.shape[1] * share)), max(1, round(image.shape[0] * share))
    how = cv2.INTER_AREA if share < 1 else cv2.INTER_NEAREST
    return np.asarray(cv2.resize(image, size, interpolation=how))
