"""Nav2's map files and keep-out masks."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Polygon

from stillroom.documents.files import MapFile
from stillroom.documents.images import decode_image
from stillroom.documents.nav2 import read_yaml, write_keepout, write_nav2
from stillroom.errors import InvalidInput
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.semantics import Restriction, SemanticMap
from tests.grids import any_grid


def read_back(files: dict[str, bytes], tmp_name: str) -> MapFile:
    image, fields = read_yaml(files[f"{tmp_name}.yaml"])
    return MapFile(Path(image), "image/x-portable-graymap", files[image], fields)


@given(any_grid(largest=20))
def test_a_grid_comes_back_as_it_was_with_its_frame(grid: OccupancyGrid) -> None:
    cells = grid.cells.copy()
    cells[0, 0] = Cell.FREE
    grid = OccupancyGrid(grid.frame, cells)
    back, _ = read_back(write_nav2(grid, "home"), "home").read({})
    assert np.array_equal(back.cells, grid.cells)
    assert back.frame == grid.frame


@pytest.mark.parametrize(
    "content", [b"", b"a: [", b"- 1", b"image: 5", b"\xff\xfe\x00", b"[" * 5000, b"resolution: 0.05"]
)
def test_what_is_no_map_server_file_is_refused(content: bytes) -> None:
    with pytest.raises(InvalidInput):
        read_yaml(content)


coordinate = st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5))
restrictions = st.lists(
    st.builds(
        Restriction,
        st.just("z"),
        st.just("no_go"),
        st.lists(coordinate, min_size=3, max_size=5, unique=True).map(tuple),
    )
    | st.builds(
        Restriction,
        st.just("z"),
        st.just("virtual_wall"),
        st.lists(coordinate, min_size=2, max_size=2, unique=True).map(tuple),
    ),
    max_size=2,
)


@given(restrictions, st.sampled_from([0.0, 0.4, -2.0]))
def test_the_mask_blocks_every_cell_that_a_restriction_touches_and_none_far_from_one(
    keep_out: list[Restriction], yaw: float
) -> None:
    frame = GridFrame(0.05, 24, 18, Pose(0.1, -0.1, yaw))
    files = write_keepout(SemanticMap(frame, restrictions=tuple(keep_out)), "mask")
    blocked = decode_image(files["mask.pgm"])[0][::-1] == 0
    shapes = [
        LineString(frame.to_cells(as_points(r.shape)))
        if r.kind == "virtual_wall"
        else shapely.make_valid(Polygon(frame.to_cells(as_points(r.shape))))
        for r in keep_out
    ]
    everything = shapely.union_all(shapes)
    rows, columns = np.mgrid[:18, :24]
    cells = shapely.box(columns, rows, columns + 1, rows + 1)
    assert blocked[shapely.intersects(everything, shapely.buffer(cells, -1e-3))].all()
    assert not blocked[~(shapely.distance(everything, cells) <= 1.0)].any()


def test_what_only_forbids_mopping_or_has_lost_its_place_is_not_in_the_mask_and_the_file_says_so() -> None:
    square = ((0.1, 0.1), (0.5, 0.1), (0.5, 0.5))
    lost = Restriction("z7", "no_go", square, placed=False)
    files = write_keepout(
        SemanticMap(GridFrame(0.05, 20, 20), restrictions=(lost, Restriction("z8", "no_mop", square))), "m"
    )
    assert (decode_image(files["m.pgm"])[0] == 254).all()
    assert files["m.yaml"].startswith(b"# not in the mask, because there is no telling where they belong now: z7\n")
    assert read_yaml(files["m.yaml"])[0] == "m.pgm"
