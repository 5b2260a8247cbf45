"""Semantic map creation (paper, Figures 2 and 3): from the raw occupancy map of a home to rooms, dividers, walls and clutter."""

import pytest
import shapely

from stillroom.maps.constraints import violations
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.rooms import overlaps
from tests.drawing import Drawing, draw
from tests.golden.homes import CLOSED, CORRIDOR, DOORWAY, FURNISHED, HOMES, OPEN_PLAN


def created(home: Drawing) -> SemanticMap:
    return create_map(home.grid, "1", Ids())


@pytest.mark.parametrize("home", HOMES.values(), ids=list(HOMES))
def test_the_rooms_of_a_home_are_those_a_person_sees(home: Drawing) -> None:
    semantic_map = created(home)
    home.rooms(semantic_map)
    assert violations(semantic_map, home.grid, PARAMS.wall_reach_m) == ()
    assert all(len(room.polygon.exterior.coords) - 1 <= 20 for room in semantic_map.rooms)
    assert all(room.made_by == room.named_by == "algorithm" for room in semantic_map.rooms)


@pytest.mark.parametrize("home", HOMES.values(), ids=list(HOMES))
def test_rooms_and_every_free_cell_of_a_home_are_the_same_space(home: Drawing) -> None:
    semantic_map = created(home)
    floor = shapely.union_all([room.polygon for room in semantic_map.rooms])
    free_m2 = float(home.grid.free.sum()) * home.grid.frame.resolution**2
    objects_m2 = sum(item.polygon.area for item in semantic_map.clutter)
    assert floor.area == pytest.approx(free_m2 + objects_m2, rel=0.04)
    assert sum(room.polygon.area for room in semantic_map.rooms) == pytest.approx(floor.area, abs=0.01)


def test_a_doorway_is_one_divider_as_wide_as_itself() -> None:
    semantic_map = created(DOORWAY)
    assert len(semantic_map.dividers) == 1
    divider = DOORWAY.divider(semantic_map, "A", "B")
    assert shapely.LineString(divider.line).length == pytest.approx(0.8, abs=0.06)
    assert (divider.kind, divider.made_by) == ("open", "algorithm")
    (x0, _), (x1, _) = divider.line
    assert 3.79 < min(x0, x1) <= max(x0, x1) < 4.21


def test_neighbours_share_the_dividers_edge() -> None:
    semantic_map = created(DOORWAY)
    line = shapely.LineString(DOORWAY.divider(semantic_map, "A", "B").line)
    a, b = (DOORWAY.room(semantic_map, letter).polygon for letter in "AB")
    assert shapely.intersection(a, b).length == pytest.approx(line.length, abs=0.002)
    assert all(set(line.coords) <= set(polygon.exterior.coords) for polygon in (a, b))


def test_four_rooms_open_onto_a_corridor() -> None:
    semantic_map = created(CORRIDOR)
    assert len(semantic_map.dividers) == 4
    for letter in "ABDE":
        CORRIDOR.divider(semantic_map, "C", letter)


@pytest.mark.parametrize("home", [OPEN_PLAN, CLOSED], ids=["open plan", "closed"])
def test_space_without_doorways_has_no_dividers(home: Drawing) -> None:
    assert created(home).dividers == ()


def test_furniture_is_clutter_where_it_stands() -> None:
    semantic_map = created(FURNISHED)
    assert len(semantic_map.dividers) == 1
    table = shapely.box(1.0, 2.2, 1.6, 2.6)
    assert max(overlaps([table], [item.polygon for item in semantic_map.clutter])[0]) == pytest.approx(table.area, 0.1)


def test_a_home_looks_the_same_at_any_resolution() -> None:
    text = """
        #####################
        #..........#........#
        #..........#........#
        #....A..........B...#
        #...................#
        #..........#........#
        #..........#........#
        #..........#........#
        #####################
    """
    areas = []
    for cells, resolution in ((8, 0.05), (10, 0.04), (16, 0.025), (4, 0.1)):
        home = draw(text, cells, resolution)
        rooms = home.rooms(created(home))
        areas.append(sorted(round(room.polygon.area, 1) for room in rooms.values()))
    assert all(found == pytest.approx(areas[0], abs=0.4) for found in areas)


@pytest.mark.parametrize(
    "text",
    [".", "#", "#   ", ". . .\n     \n. . .", "#.#\n###\n#.#"],
    ids=["one free cell", "one occupied cell", "nothing explored beside it", "specks", "two specks"],
)
def test_a_grid_without_space_for_a_room_is_a_map_without_rooms(text: str) -> None:
    drawing = draw(text, cells=1)
    semantic_map = created(drawing)
    assert (semantic_map.rooms, semantic_map.dividers) == ((), ())
    assert violations(semantic_map, drawing.grid, PARAMS.wall_reach_m) == ()


def test_creation_alters_no_cell_and_gives_the_same_map_again() -> None:
    before = CORRIDOR.grid.cells.copy()
    assert created(CORRIDOR) == created(CORRIDOR)
    assert (CORRIDOR.grid.cells == before).all()


def test_ids_go_on_where_the_robots_map_left_off() -> None:
    semantic_map = create_map(DOORWAY.grid, "1", Ids("2-", (("d", 3), ("r", 7))))
    assert sorted(room.id for room in semantic_map.rooms) == ["r2-8", "r2-9"]
    assert [divider.id for divider in semantic_map.dividers] == ["d2-4"]
    assert semantic_map.ids.take("r")[0] == ("r2-10",)
