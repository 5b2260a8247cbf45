"""iRobot's map documents."""

from typing import Any

import pytest

from stillroom.documents.umf import is_umf, read_umf
from stillroom.errors import InvalidGrid, InvalidInput, TooLarge
from stillroom.maps.geometry import as_points
from stillroom.maps.grid import Cell
from stillroom.maps.semantics import Ids, Restriction
from stillroom.pipeline.adoption import adopt_map

Json = dict[str, Any]
PLACES = {
    "a": [0.0, 0.0], "b": [3.0, 0.0], "c": [3.0, 2.0], "d": [0.0, 2.0], "e": [5.0, 0.0], "f": [5.0, 2.0],
    "g": [1.0, 0.5], "h": [1.5, 0.5], "i": [1.5, 1.0], "j": [4.0, 2.0], "k": [4.6, 2.0],
}  # fmt: skip


def shape(*ids: str, name: str = "", key: str = "0") -> Json:
    return {"id": key, "name": name, "geometry": {"type": "polygon", "ids": [[*ids, ids[0]]]}}


def umf(**changed: Any) -> Json:
    """Two rooms side by side, the right one open to the unknown at its upper wall; one keep-out zone."""
    inner = {
        "points2d": [{"id": key, "coordinates": place} for key, place in PLACES.items()],
        "regions": [shape(*"abcd", name="Kitchen"), shape(*"befc", key="1")],
        "borders": [shape(*"aefd") | {"free_type": "free"}],
        "doors": [{"id": "0", "geometry": {"type": "linestring", "ids": ["b", "c"]}}],
        "layers": [
            {"layer_type": "frontiers", "geometry": {"type": "multilinestring", "ids": [["j", "k"]]}},
            {"layer_type": "deltas", "changelog": {}},
        ],
        "keepoutzones": [shape(*"ghi")],
    }
    return {"format_version": "4.8.1", "maps": [inner | changed]}


def test_regions_become_rooms_doors_dividers_and_keep_out_zones_restrictions() -> None:
    found = read_umf(umf())
    made = adopt_map(found.grid, found.semantics, "1", Ids())
    assert [(room.name, room.named_by, round(room.polygon.area, 1)) for room in made.rooms] == [
        ("Kitchen", "user", 6.0),
        ("Room 2", "algorithm", 4.0),
    ]
    assert [sorted(divider.line) for divider in made.dividers] == [[(3.0, 0.0), (3.0, 2.0)]]
    assert made.restrictions == (Restriction("z1", "no_go", ((1.0, 0.5), (1.5, 0.5), (1.5, 1.0))),)


def test_a_wall_is_around_what_is_free_but_for_its_frontiers() -> None:
    grid = read_umf(umf()).grid

    def cell(x: float, y: float) -> int:
        column, row = grid.frame.to_cells(as_points([(x, y)]))[0].astype(int)
        return int(grid.cells[row, column])

    assert cell(1.0, 1.0) == Cell.FREE
    assert cell(1.0, 2.02) == Cell.OCCUPIED
    assert cell(4.3, 2.02) == Cell.UNEXPLORED
    assert cell(1.0, 2.08) == Cell.UNEXPLORED


def test_a_document_may_be_wrapped_and_others_are_not_taken_for_one() -> None:
    assert is_umf({"umf": umf()})
    assert read_umf({"umf": umf()}).grid.frame == read_umf(umf()).grid.frame
    others: list[Any] = [{}, [], None, {"maps": []}, {"umf": None}, {"__class": "ValetudoMap"}]
    for other in others:
        assert not is_umf(other)


@pytest.mark.parametrize(
    "changed",
    [
        {"points2d": None},
        {"points2d": []},
        {"regions": [], "borders": []},
        {"regions": [shape("a", "b")]},
        {"regions": [shape("a", "b", "zz")]},
        {"keepoutzones": [shape("a", "zz", "b")]},
        {"points2d": [{"id": "a", "coordinates": [0, float("nan")]}]},
    ],
)
def test_a_document_that_can_t_be_drawn_is_refused(changed: Json) -> None:
    with pytest.raises(InvalidGrid):
        read_umf(umf(**changed))


def test_a_document_of_no_map_or_of_many_is_refused() -> None:
    for maps in ([], [umf()["maps"][0]] * 2):
        with pytest.raises(InvalidInput):
            read_umf(umf() | {"maps": maps})


def test_a_home_as_large_as_a_town_is_refused() -> None:
    far = [{"id": key, "coordinates": [1000 * x, 1000 * y]} for key, (x, y) in PLACES.items()]
    with pytest.raises(TooLarge):
        read_umf(umf(points2d=far))
