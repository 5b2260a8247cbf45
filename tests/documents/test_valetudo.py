"""Valetudo's map data format."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillroom.documents.valetudo import MAX_SEGMENTS, ValetudoMap, read_valetudo, write_valetudo
from stillroom.errors import InvalidGrid, TooLarge
from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Restriction, RestrictionKind
from stillroom.pipeline.adoption import RobotSemantics

Json = dict[str, Any]
UNEXPLORED, FREE, OCCUPIED = Cell.UNEXPLORED, Cell.FREE, Cell.OCCUPIED


def layer(kind: str, runs: list[Any], **meta: Any) -> Json:
    return {"__class": "MapLayer", "type": kind, "pixels": [], "compressedPixels": runs, "metaData": meta}


def document(*layers: Json, entities: tuple[Json, ...] = (), **rest: Any) -> Json:
    return {"__class": "ValetudoMap", "pixelSize": 5, "layers": list(layers), "entities": list(entities)} | rest


def entity(kind: str, *points: float) -> Json:
    return {"__class": "PolygonMapEntity", "metaData": {}, "type": kind, "points": list(points)}


FLOOR = layer("floor", [10, 20, 3, 10, 21, 3])


@st.composite
def valetudo_maps(draw: st.DrawFn) -> ValetudoMap:
    """What the format can say: whole pixels without rotation, segments on free cells, unexplored only where no layer reaches."""
    width, height = draw(st.integers(1, 12)), draw(st.integers(1, 12))
    values = draw(
        st.lists(st.sampled_from([UNEXPLORED, FREE, OCCUPIED]), min_size=width * height, max_size=width * height)
    )
    cells = np.array(values, np.uint8).reshape(height, width)
    cells[0, 0], cells[-1, -1] = FREE, OCCUPIED  # so that no row or column at the edge can be left out
    cells[0, -1], cells[-1, 0] = OCCUPIED, FREE
    count = draw(st.integers(0, 3))
    labels = np.array(draw(st.lists(st.integers(0, count), min_size=cells.size, max_size=cells.size)), np.int32)
    labels = np.where(cells == FREE, labels.reshape(cells.shape), 0).astype(np.int32)
    present = [label for label in range(1, count + 1) if (labels == label).any()]
    labels = np.searchsorted(np.array([0, *present]), np.where(np.isin(labels, present), labels, 0)).astype(np.int32)
    name = st.none() | st.text(st.sampled_from("aä é1"), min_size=1, max_size=5).map(str.strip).filter(bool)
    resolution = draw(st.sampled_from([0.05, 0.02, 0.1]))
    left, bottom = draw(st.integers(-200, 200)), draw(st.integers(-200, 200))
    frame = GridFrame(resolution, width, height, Pose(left * resolution, bottom * resolution))
    point = st.tuples(*[st.integers(-500, 500).map(lambda cm: cm / 100)] * 2)
    restrictions = draw(
        st.lists(
            st.builds(
                Restriction,
                st.just(""),
                st.sampled_from(["no_go", "no_mop"]),
                st.lists(point, min_size=3, max_size=5, unique=True).map(tuple),
            )
            | st.builds(
                Restriction,
                st.just(""),
                st.just("virtual_wall"),
                st.lists(point, min_size=2, max_size=2, unique=True).map(tuple),
            ),
            max_size=3,
        )
    )
    names = tuple(draw(name) for _ in present)
    return ValetudoMap(OccupancyGrid(frame, cells), RobotSemantics(labels, names, tuple(restrictions)))


@given(valetudo_maps())
def test_grid_segments_names_and_restrictions_come_back_as_they_were(before: ValetudoMap) -> None:
    said = before.semantics
    segments = [(str(number), name) for number, name in enumerate(said.names, 1)]
    written = json.loads(write_valetudo(before.grid, said.labels, segments, said.restrictions))
    after = read_valetudo(written)
    assert np.array_equal(after.grid.cells, before.grid.cells)
    assert after.grid.frame.resolution == pytest.approx(before.grid.frame.resolution)
    assert after.grid.frame.origin.x == pytest.approx(before.grid.frame.origin.x)
    assert after.grid.frame.origin.y == pytest.approx(before.grid.frame.origin.y)
    assert np.array_equal(after.semantics.labels, said.labels)
    assert after.semantics.names == said.names
    assert [r.kind for r in after.semantics.restrictions] == [r.kind for r in said.restrictions]
    for old, new in zip(said.restrictions, after.semantics.restrictions, strict=True):
        assert np.allclose(old.shape, new.shape)


def test_pixels_are_where_their_centimetres_are_and_y_points_down() -> None:
    grid = read_valetudo(document(FLOOR, layer("wall", [12, 22, 1]))).grid
    assert grid.cells.tolist() == [[0, 0, OCCUPIED], [FREE, FREE, FREE], [FREE, FREE, FREE]]
    assert (grid.frame.resolution, grid.frame.width, grid.frame.height) == (0.05, 3, 3)
    assert grid.frame.origin == Pose(0.5, -1.15)


def test_the_old_form_of_pixel_pairs_is_the_same() -> None:
    old = FLOOR | {"pixels": [10, 20, 11, 20, 12, 20, 12, 21, 11, 21, 10, 21], "compressedPixels": []}
    del old["compressedPixels"]
    assert np.array_equal(read_valetudo(document(old)).grid.cells, read_valetudo(document(FLOOR)).grid.cells)


def test_where_layers_overlap_a_segment_covers_floor_and_a_wall_both_in_whatever_order() -> None:
    layers = [layer("wall", [10, 20, 1]), layer("segment", [10, 20, 2], segmentId="7"), FLOOR]
    found = read_valetudo(document(*layers))
    assert found.grid.cells.tolist() == [[FREE, FREE, FREE], [OCCUPIED, FREE, FREE]]
    assert found.semantics.labels.tolist() == [[0, 0, 0], [0, 1, 0]]


def test_layers_of_one_segment_are_one_segment_and_names_are_cleaned() -> None:
    found = read_valetudo(
        document(
            layer("segment", [0, 0, 1], segmentId=16, name="  Flur\x00 "),
            layer("segment", [1, 0, 1], segmentId=17, name=" "),
            layer("segment", [2, 0, 1], segmentId=16),
            layer("segment", [3, 0, 1], segmentId="18", name="x" * 90),
        )
    )
    assert found.semantics.labels.tolist() == [[1, 2, 1, 3]]
    assert found.semantics.names == ("Flur", None, "x" * 64)


@pytest.mark.parametrize(
    ("kind", "points", "expected", "shape"),
    [
        ("no_go_area", (0, 0, 100, 0, 100, 200), "no_go", ((0, 0), (1, 0), (1, -2))),
        ("no_mop_area", (0, 0, 100, 0, 100, 200, 0, 0), "no_mop", ((0, 0), (1, 0), (1, -2))),
        ("virtual_wall", (50, 100, 150, 100), "virtual_wall", ((0.5, -1), (1.5, -1))),
    ],
)
def test_areas_and_walls_are_restrictions(
    kind: str, points: tuple[float, ...], expected: RestrictionKind, shape: tuple[tuple[float, float], ...]
) -> None:
    found = read_valetudo(document(FLOOR, entities=(entity(kind, *points), entity("path", 1, 2))))
    assert found.semantics.restrictions == (Restriction("", expected, shape),)


@pytest.mark.parametrize(
    ("broken", "pointer"),
    [
        ({"pixelSize": 0}, "/grid/pixelSize"),
        ({"pixelSize": -5}, "/grid/pixelSize"),
        ({"pixelSize": float("inf")}, "/grid/pixelSize"),
        ({"pixelSize": "5"}, "/grid/pixelSize"),
        ({"layers": None}, "/grid/layers"),
        ({"layers": []}, "/grid/layers"),
        ({"layers": [{}]}, "/grid/layers/0/type"),
        ({"layers": [FLOOR | {"compressedPixels": [1, 2]}]}, "/grid/layers/0/compressedPixels"),
        ({"layers": [FLOOR | {"pixels": [1]}]}, "/grid/layers/0/pixels"),
        ({"layers": [FLOOR | {"pixels": [1, 2.5]}]}, "/grid/layers/0/pixels"),
        ({"layers": [FLOOR | {"pixels": [1, 10**300]}]}, "/grid/layers/0/pixels"),
        ({"layers": [FLOOR | {"pixels": [1, -(2**63)]}]}, "/grid/layers/0"),
        ({"layers": [FLOOR | {"compressedPixels": [2**62, 0, 1]}]}, "/grid/layers/0"),
        ({"layers": [FLOOR | {"compressedPixels": [0, 0, 0]}]}, "/grid/layers/0"),
        ({"layers": [FLOOR | {"compressedPixels": [0, 0, -3]}]}, "/grid/layers/0"),
        ({"entities": [entity("no_go_area", 0, 0, 1, 1)]}, "/grid/entities/0/points"),
        ({"entities": [entity("no_go_area", 0, 0, 1, 1, 0, 0)]}, "/grid/entities/0/points"),
        ({"entities": [entity("virtual_wall", 0, 0)]}, "/grid/entities/0/points"),
        ({"entities": [entity("virtual_wall", 0, 0, 1, 1, 2, 2)]}, "/grid/entities/0/points"),
        ({"entities": [entity("virtual_wall", 0, 0, 1)]}, "/grid/entities/0/points"),
        ({"entities": [entity("virtual_wall", 0, 0, 1, 1e300)]}, "/grid/entities/0/points"),
        ({"entities": [entity("virtual_wall", 0, 0, 1, float("nan"))]}, "/grid/entities/0/points"),
    ],
)
def test_a_map_that_can_t_be_is_refused_with_a_pointer(broken: Json, pointer: str) -> None:
    with pytest.raises(InvalidGrid) as refused:
        read_valetudo(document(FLOOR) | broken)
    assert pointer in [fault.pointer for fault in refused.value.faults]


@pytest.mark.parametrize(
    "layers",
    [
        [layer("floor", [0, 0, 1, 10**6, 10**6, 1])],
        [layer("floor", [0, 0, 10**6] * 30)],
        [layer("segment", [0, 0, 1], segmentId=n) for n in range(MAX_SEGMENTS + 1)],
    ],
)
def test_what_is_too_large_is_refused(layers: list[Json]) -> None:
    with pytest.raises(TooLarge):
        read_valetudo(document(*layers))


def test_a_turned_grid_is_written_upright_at_most_half_a_cell_away() -> None:
    cells = np.full((6, 9), FREE, np.uint8)
    cells[:, 4] = OCCUPIED
    turned = OccupancyGrid(GridFrame(0.05, 9, 6, Pose(1.0, 2.0, np.pi / 2)), cells)
    back = read_valetudo(json.loads(write_valetudo(turned, np.zeros((6, 9), np.int32), [], []))).grid
    assert np.array_equal(back.cells, np.rot90(cells))
    assert back.frame.origin.x == pytest.approx(0.7)
    assert back.frame.origin.y == pytest.approx(2.0)
