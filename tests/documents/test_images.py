"""Images as occupancy grids, with map_server's meaning of grey."""

import struct
import zlib
from contextlib import suppress

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from stillroom.documents.images import (
    MAX_CELLS,
    Mode,
    Reading,
    as_png,
    classify,
    decode_image,
    encode_png,
    read_grid,
)
from stillroom.errors import InvalidGrid, InvalidInput, TooLarge
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell

READING = Reading(0.05, Pose(1.0, 2.0, 0.5))
GREYS = arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=12))


def cells(*greys: int, **how: object) -> list[int]:
    reading = Reading(0.05, **how)  # type: ignore[arg-type]
    return [int(cell) for cell in classify(np.array([greys], np.uint8), None, reading)[0]]


def test_trinary_divides_by_the_thresholds_and_205_is_always_unexplored() -> None:
    # occupancy = (255 - grey) / 255: 0.65 lies between 89 and 90, 0.196 between 205 and 206.
    assert cells(0, 89, 90, 204, 205, 206, 254, 255) == [
        Cell.OCCUPIED,
        Cell.OCCUPIED,
        Cell.UNEXPLORED,
        Cell.UNEXPLORED,
        Cell.UNEXPLORED,
        Cell.FREE,
        Cell.FREE,
        Cell.FREE,
    ]
    assert cells(205, free_thresh=0.3) == [Cell.UNEXPLORED]
    assert cells(205, negate=True) == [Cell.UNEXPLORED]


def test_negate_turns_black_and_white_round() -> None:
    assert cells(0, 255, negate=True) == [Cell.FREE, Cell.OCCUPIED]


def test_scale_takes_205_by_the_thresholds() -> None:
    assert cells(205, mode="scale", free_thresh=0.3) == [Cell.FREE]
    assert cells(0, 130, 255, mode="scale") == [Cell.OCCUPIED, Cell.UNEXPLORED, Cell.FREE]


def test_raw_takes_the_value_itself_in_percent_and_over_100_as_unexplored() -> None:
    values = cells(0, 19, 20, 65, 66, 100, 101, 255, mode="raw")
    free, unexplored, occupied = Cell.FREE, Cell.UNEXPLORED, Cell.OCCUPIED
    assert values == [free, free, unexplored, unexplored, occupied, occupied, unexplored, unexplored]


def test_the_top_row_of_an_image_has_the_highest_y() -> None:
    image = np.full((3, 2), 254, np.uint8)
    image[0] = 0
    grid = read_grid(encode_png(image), READING)
    assert grid.cells.tolist() == [[1, 1], [1, 1], [2, 2]]
    assert (grid.frame.width, grid.frame.height, grid.frame.resolution) == (2, 3, 0.05)
    assert grid.frame.origin == Pose(1.0, 2.0, 0.5)


@given(GREYS)
def test_every_grey_comes_back_from_a_png(grey: np.ndarray) -> None:
    decoded, transparent = decode_image(encode_png(grey))
    assert np.array_equal(decoded, grey)
    assert transparent is None


@given(GREYS)
def test_every_grey_comes_back_from_a_pgm_in_both_its_forms(grey: np.ndarray) -> None:
    height, width = grey.shape
    header = f"{width} {height}\n# a comment\n255\n".encode()
    binary = b"P5 " + header + grey.tobytes()
    text = b"P2\n" + header + b"\n".join(b" ".join(b"%d" % level for level in row) for row in grey)
    for content in (binary, text):
        assert np.array_equal(decode_image(content)[0], grey)
        assert np.array_equal(decode_image(as_png(content))[0], grey)


@given(GREYS, st.data())
def test_an_image_that_is_cut_off_anywhere_is_refused_and_never_read_in_part(
    grey: np.ndarray, data: st.DataObject
) -> None:
    height, width = grey.shape
    for content in (encode_png(grey), f"P5\n{width} {height}\n255\n".encode() + grey.tobytes()):
        with pytest.raises(InvalidGrid):
            decode_image(content[: data.draw(st.integers(0, len(content) - 1))])


@given(GREYS, st.data())
def test_a_damaged_image_is_refused_or_read_but_nothing_else_happens(grey: np.ndarray, data: st.DataObject) -> None:
    content = bytearray(encode_png(grey))
    content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    with suppress(InvalidGrid, TooLarge):
        decode_image(bytes(content))


def test_a_png_without_its_end_is_refused() -> None:
    whole = encode_png(np.full((8, 8), 254, np.uint8))
    with pytest.raises(InvalidGrid):
        decode_image(whole[:-12])


def test_colours_that_are_greys_are_greys_and_others_are_refused() -> None:
    grey = np.array([[0, 205, 254]], np.uint8)
    coloured = cv2.merge([grey, grey, grey])
    assert np.array_equal(decode_image(cv2.imencode(".png", coloured)[1].tobytes())[0], grey)
    coloured[0, 1] = (1, 2, 3)
    with pytest.raises(InvalidGrid, match="colours"):
        decode_image(cv2.imencode(".png", coloured)[1].tobytes())


def test_where_an_image_is_transparent_nothing_is_known() -> None:
    grey = np.array([[0, 254, 254]], np.uint8)
    alpha = np.array([[0, 0, 255]], np.uint8)
    content = cv2.imencode(".png", cv2.merge([grey, grey, grey, alpha]))[1].tobytes()
    assert read_grid(content, READING).cells.tolist() == [[Cell.UNEXPLORED, Cell.UNEXPLORED, Cell.FREE]]


def test_colours_of_pixels_that_are_transparent_don_t_count() -> None:
    pixels = np.array([[[9, 8, 7, 0], [254, 254, 254, 255]]], np.uint8)
    assert read_grid(cv2.imencode(".png", pixels)[1].tobytes(), READING).cells.tolist() == [[0, 1]]


def test_sixteen_bits_are_refused() -> None:
    wide = np.full((2, 2), 60000, np.uint16)
    for content in (cv2.imencode(".png", wide)[1].tobytes(), b"P5\n2 2\n65535\n" + wide.tobytes()):
        with pytest.raises(InvalidGrid, match="16 bits"):
            decode_image(content)


def test_a_pgm_of_fewer_levels_is_stretched() -> None:
    assert decode_image(b"P5\n3 1\n100\n" + bytes([0, 50, 100]))[0].tolist() == [[0, 128, 255]]
    with pytest.raises(InvalidGrid, match="outside"):
        decode_image(b"P5\n3 1\n100\n" + bytes([0, 50, 101]))


@pytest.mark.parametrize("body", [b"1 2", b"1 2 x", b"1 2 -3", b"1 2 99999999999999999999", b""])
def test_a_pgm_in_text_that_is_broken_is_refused(body: bytes) -> None:
    with pytest.raises(InvalidGrid):
        decode_image(b"P2\n3 1\n255\n" + body)


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def test_an_image_that_is_too_large_is_refused_by_its_header_before_it_is_unpacked() -> None:
    header = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0)
    bomb = (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(10))) + chunk(b"IEND", b"")
    )
    with pytest.raises(TooLarge) as refused:
        decode_image(bomb)
    assert refused.value.extra["limit_cells"] == MAX_CELLS
    with pytest.raises(TooLarge):
        decode_image(b"P2\n60000 60000\n255\n")


@pytest.mark.parametrize("size", ["0 5", "5 0"])
def test_an_image_without_cells_is_refused(size: str) -> None:
    with pytest.raises(InvalidGrid):
        decode_image(f"P5\n{size}\n255\n".encode())


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_a_grid_without_a_free_cell_is_refused(mode: Mode) -> None:
    with pytest.raises(InvalidGrid, match="no free cell"):
        read_grid(encode_png(np.full((3, 3), 150, np.uint8)), Reading(0.05, Pose(), mode=mode))


def test_an_image_does_not_say_where_it_lies_so_the_meta_must() -> None:
    with pytest.raises(InvalidInput) as refused:
        read_grid(encode_png(np.full((3, 3), 254, np.uint8)), Reading())
    assert [fault.pointer for fault in refused.value.faults] == ["/meta/resolution", "/meta/origin"]
