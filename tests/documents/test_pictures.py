"""Pictures of maps."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given

from stillroom.documents.pictures import CELLS, EMPHASIS, LONGEST_SIDE, ROOMS, Image, contact_sheet, draw, encode
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.meta import MapMeta, MetaDivider
from stillroom.maps.semantics import Ids, Restriction, SemanticMap
from stillroom.pipeline.creation import create_map
from tests import drawing
from tests.grids import any_grid

FLAT = drawing.draw(
    """
    #####################
    #.........#.........#
    #.........#.........#
    #...................#
    #...................#
    #...................#
    #.........#.........#
    #.........#.........#
    #####################
    """,
    margin=30,
)
FLAT_MAP = create_map(FLAT.grid, "1", Ids())


def at(image: Image, x: float, y: float, grid: OccupancyGrid = FLAT.grid) -> tuple[int, ...]:
    """The colour at a point of the map frame in a picture of all that is known."""
    known = np.argwhere(~grid.unexplored)
    left, (top, right) = known.min(0)[1] - 8, known.max(0) + 9
    column, row = grid.frame.to_cells(np.array([[x, y]]))[0]
    scale = image.shape[1] / (right - left)
    return tuple(image[int((top - row) * scale), int((column - left) * scale)].tolist())


def near(colour: tuple[int, ...], other: tuple[int, ...], by: int = 45) -> bool:
    return max(abs(a - b) for a, b in zip(colour, other, strict=True)) <= by


def test_a_grid_has_a_colour_for_free_occupied_and_unexplored_and_only_what_is_known_is_shown() -> None:
    image = draw(FLAT.grid)
    assert at(image, 1.0, 1.0) == CELLS[Cell.FREE]
    assert at(image, 2.1, 0.1) == CELLS[Cell.OCCUPIED]
    assert tuple(image[2, 2].tolist()) == CELLS[Cell.UNEXPLORED]
    assert max(image.shape) <= LONGEST_SIDE


def test_rooms_have_colours_that_differ_between_neighbours_and_walls_stay_in_sight() -> None:
    image = draw(FLAT.grid, FLAT_MAP)
    left, right = at(image, 0.5, 0.4), at(image, 3.5, 0.4)
    assert near(left, ROOMS[0]) or near(left, ROOMS[1])
    assert not near(left, right, 10)
    assert near(at(image, 2.1, 0.4), CELLS[Cell.OCCUPIED], 80)


@pytest.mark.parametrize("kind", ["no_go", "no_mop", "virtual_wall"])
def test_every_feature_is_drawn(kind: str) -> None:
    shape = ((0.4, 0.3), (1.2, 0.3)) if kind == "virtual_wall" else ((0.4, 0.3), (1.2, 0.3), (1.2, 0.6), (0.4, 0.6))
    restricted = replace(FLAT_MAP, restrictions=(Restriction("z1", kind, shape),))  # type: ignore[arg-type]
    meta = replace(FLAT_MAP, meta=MapMeta(dividers=(MetaDivider("m1", ((0.3, 0.3), (0.3, 1.3)), (), "1"),)))
    plain = draw(FLAT.grid, FLAT_MAP)
    for changed in (restricted, meta, replace(FLAT_MAP, dividers=()), replace(FLAT_MAP, walls=())):
        assert not np.array_equal(draw(FLAT.grid, changed), plain)


def test_names_in_any_script_are_drawn() -> None:
    def named(name: str) -> Image:
        return draw(FLAT.grid, replace(FLAT_MAP, rooms=tuple(replace(room, name=name) for room in FLAT_MAP.rooms)))

    assert not np.array_equal(named("Küche"), named("Kuche"))
    assert not np.array_equal(named("台所"), named("所台"))


@given(any_grid(60))
def test_any_map_can_be_drawn(grid: OccupancyGrid) -> None:
    image = draw(grid, create_map(grid, "1", Ids()))
    assert image.dtype == np.uint8
    assert image.ndim == 3


def test_a_large_map_is_drawn_smaller() -> None:
    grid = OccupancyGrid(GridFrame(0.05, 3000, 10), np.full((10, 3000), Cell.FREE, np.uint8))
    assert draw(grid, SemanticMap(grid.frame)).shape == (4, LONGEST_SIDE, 3)


def test_a_contact_sheet_has_every_picture_and_its_caption() -> None:
    pictures = [
        (f"{n}: a caption that is far too long for its picture and has to be cut", draw(FLAT.grid)) for n in range(5)
    ]
    sheet = contact_sheet(pictures, tile=120)
    assert sheet.shape == (2 * (120 + 26 + 12) + 12, 3 * (120 + 12) + 12, 3)
    for n in range(5):
        row, column = divmod(n, 3)
        y, x = 12 + row * 158, 12 + column * 132
        assert (sheet[y : y + 120, x : x + 120] != 255).any()
        assert (sheet[y + 122 : y + 144, x : x + 120] < 128).any()
    decoded = cv2.imdecode(np.frombuffer(encode(sheet), np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert np.array_equal(decoded, sheet)


def test_a_room_that_a_picture_is_about_has_a_bold_outline_and_no_other_has() -> None:
    first, second = (room.id for room in FLAT_MAP.rooms)
    images = {about: draw(FLAT.grid, FLAT_MAP, about) for about in ((), (first,), (second,), (first, second))}

    def bold(image: Image) -> int:
        return int((image == np.array(EMPHASIS, np.uint8)).all(-1).sum())

    counts = [bold(image) for image in images.values()]
    assert counts[0] == 0
    assert min(counts[1:3]) > 100
    assert counts[3] > max(counts[1:3])
