"""A grid in whichever format a robot sends it."""

import json
from typing import Any

import cv2
import numpy as np
import pytest

from stillroom.documents.grids import as_png, cells_as_png, check_type, read_grid, read_mission_map
from stillroom.documents.images import Reading
from stillroom.errors import InvalidGrid, InvalidInput, UnsupportedFormat
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell
from tests.documents.test_valetudo import FLOOR, document, layer
from tests.homes import home, png

VALETUDO = json.dumps(document(FLOOR, layer("wall", [13, 20, 2]))).encode()
MESSAGE = json.dumps(
    {
        "info": {"resolution": 0.05, "width": 4, "height": 1, "origin": {"position": {"x": 1, "y": 2}}},
        "data": [0, 70, 100, -1],
    }
).encode()


@pytest.mark.parametrize(
    ("media_type", "content"),
    [
        ("image/png", png(home())),
        ("image/x-portable-graymap", b"P5 1 1 255\n\xfe"),
        ("application/json", VALETUDO),
        ("application/json", MESSAGE),
    ],
)
def test_every_format_is_what_its_media_type_says(media_type: str, content: bytes) -> None:
    check_type(media_type, content)
    for other in {"image/png", "image/x-portable-graymap", "application/json"} - {media_type}:
        with pytest.raises(InvalidGrid):
            check_type(other, content)


@pytest.mark.parametrize("media_type", ["", "image/jpeg", "text/plain", "application/geo+json"])
def test_another_media_type_is_refused(media_type: str) -> None:
    with pytest.raises(UnsupportedFormat):
        check_type(media_type, VALETUDO)


@pytest.mark.parametrize(
    "content", [b"{}", b"[]", b"null", b'{"__class": "OtherMap"}', b'{"data": []}', b"GIF89a", b""]
)
def test_json_of_an_unknown_kind_is_refused(content: bytes) -> None:
    with pytest.raises(InvalidInput):
        read_grid(content, Reading())


def test_only_a_valetudo_map_says_more_than_a_grid() -> None:
    assert read_mission_map(VALETUDO, Reading())[1] is not None
    assert read_mission_map(MESSAGE, Reading())[1] is None
    assert read_mission_map(png(home()), Reading(0.05, Pose()))[1] is None


def test_a_json_grid_without_a_free_cell_is_refused() -> None:
    for content in (json.dumps(document(layer("wall", [0, 0, 5]))).encode(), MESSAGE.replace(b"[0,", b"[50,")):
        with pytest.raises(InvalidGrid, match="no free cell"):
            read_grid(content, Reading())


@pytest.mark.parametrize(
    ("reading", "pointers"),
    [
        (Reading(), []),
        (Reading(0.05, Pose(0.5, -1.1)), []),
        (Reading(0.0500001, Pose(0.5004, -1.1, 2 * np.pi)), []),
        (Reading(0.1), ["/meta/resolution"]),
        (Reading(0.05, Pose(0.5, -1.0)), ["/meta/origin"]),
        (Reading(0.1, Pose(0.5, -1.1, 0.1)), ["/meta/resolution", "/meta/origin"]),
    ],
)
def test_meta_may_repeat_what_the_grid_says_and_not_contradict_it(reading: Reading, pointers: list[str]) -> None:
    if not pointers:
        assert read_grid(VALETUDO, reading).frame.origin == Pose(0.5, -1.1)
        return
    with pytest.raises(InvalidInput, match="contradicts") as refused:
        read_grid(VALETUDO, reading)
    assert [fault.pointer for fault in refused.value.faults] == pointers


def decoded(content: bytes) -> list[list[Any]]:
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return [list(map(int, row)) for row in image]


def test_the_picture_of_a_json_grid_has_three_greys_and_its_top_row_first() -> None:
    assert decoded(as_png(VALETUDO, Reading())) == [[254, 254, 254, 0, 0], [254, 254, 254, 205, 205]]
    assert decoded(cells_as_png(MESSAGE, Reading())) == [[254, 0, 0, 205]]
    assert decoded(as_png(MESSAGE, Reading(occupied_thresh=0.8))) == [[254, 205, 0, 205]]


def test_the_picture_of_a_picture_is_that_picture() -> None:
    assert as_png(png(home()), Reading()) == png(home())


def test_thresholds_of_the_meta_decide_how_an_occupancy_grid_is_read() -> None:
    assert read_grid(MESSAGE, Reading(occupied_thresh=0.8)).cells.tolist() == [
        [Cell.FREE, Cell.UNEXPLORED, Cell.OCCUPIED, Cell.UNEXPLORED]
    ]
