"""Semantic map creation (paper, Figures 2 and 3): from the raw occupancy map of a home to rooms, dividers, walls and clutter."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid, look_up
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.rooms import overlaps
from tests.drawing import Drawing, draw, iou, paint, rectangle
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


HOUSE = """
    ########################################################
    #..........#..............................#............#
    #..........#..............................#............#
    #..........#..............................#............#
    #....A.....#...............B..............#.....D......#
    #..........#..............................#............#
    #..........#..............................#............#
    #..........#..............................#............#
    #..........#..............................#............#
    ####....#########....#########################....######
    #......................................................#
    #...........................C..........................#
    #......................................................#
    ####....#############################....###############
    #..............#.......................................#
    #..............#.......................................#
    #......E.......#...................F...................#
    #..............#.......................................#
    #..............#.......................................#
    #..............#.......................................#
    #..............#.......................................#
    ########################################################
"""
"""Five rooms on both sides of a hallway of 0.6 m a doorway's width, drawn with characters of 0.2 m."""


def shapes_of(home: Drawing) -> dict[str, shapely.Polygon]:
    return {letter: room.polygon for letter, room in home.rooms(created(home)).items()}


def test_a_long_narrow_room_with_many_doors_is_proposed_as_the_hallway() -> None:
    home = draw(HOUSE)
    names = {letter: room.name for letter, room in home.rooms(created(home)).items()}
    assert names.pop("C") == "Hallway"
    assert all(name.startswith("Room ") for name in names.values())


@pytest.mark.parametrize("resolution", [0.02, 0.025, 0.04, 0.1])
def test_rooms_are_the_same_at_any_resolution(resolution: float) -> None:
    expected = shapes_of(draw(HOUSE))
    found = shapes_of(draw(HOUSE, cells=round(0.2 / resolution), resolution=resolution))
    assert all(iou(found[letter], expected[letter]) > 0.98 for letter in expected)


@pytest.mark.parametrize("yaw", [0.0, 0.4, 2.0])
def test_rooms_are_the_same_wherever_the_grid_lies_and_however_much_around_it_is_unexplored(yaw: float) -> None:
    place = Pose(12.345, -6.789, yaw)
    expected = shapes_of(draw(HOUSE))
    found = shapes_of(draw(HOUSE, origin=place, margin=7))
    for letter, polygon in expected.items():
        assert iou(found[letter], shapely.transform(polygon, lambda p: place.apply(as_points(p)))) > 0.995


@pytest.mark.parametrize("quarters", [1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_turned_or_mirrored_home_has_the_same_rooms(quarters: int, mirrored: bool) -> None:
    home = draw(HOUSE)
    cells = np.rot90(home.grid.cells[:, ::-1] if mirrored else home.grid.cells, quarters)
    frame = GridFrame(home.grid.frame.resolution, cells.shape[1], cells.shape[0])
    other = create_map(OccupancyGrid(frame, np.ascontiguousarray(cells)), "1", Ids())
    areas = [sorted(room.polygon.area for room in made.rooms) for made in (created(home), other)]
    assert areas[0] == pytest.approx(areas[1], rel=0.02)


@pytest.mark.parametrize("degrees", [7, 30, 45])
def test_a_home_askew_to_its_grid_has_the_same_rooms(degrees: float) -> None:
    home = draw(HOUSE)
    turn = Pose(4.0, 6.0, np.radians(degrees))
    frame = GridFrame(0.05, 340, 340, Pose(-1.0, 4.0))
    columns, rows = np.meshgrid(np.arange(340) + 0.5, np.arange(340) + 0.5)
    places = turn.inverse().apply(frame.to_map(np.stack([columns.ravel(), rows.ravel()], 1)))
    cells = look_up(home.grid.cells, home.grid.frame.to_cells(places), Cell.UNEXPLORED).reshape(340, 340)
    found = [room.polygon for room in create_map(OccupancyGrid(frame, cells), "1", Ids()).rooms]
    for polygon in shapes_of(home).values():
        moved = shapely.transform(polygon, lambda p: turn.apply(as_points(p)))
        assert max(iou(moved, other) for other in found) > 0.9
    assert len(found) == 6


@pytest.mark.parametrize("seed", range(5))
def test_one_percent_of_specks_leaves_every_room(seed: int) -> None:
    home = draw(HOUSE)
    rng = np.random.default_rng(seed)
    cells = home.grid.cells.copy()
    wrong = rng.random(cells.shape) < 0.01
    cells[wrong] = np.where(rng.random(cells.shape) < 0.5, Cell.OCCUPIED, Cell.FREE)[wrong]
    found = [room.polygon for room in create_map(OccupancyGrid(home.grid.frame, cells), "1", Ids()).rooms]
    for polygon in shapes_of(home).values():
        assert max(iou(polygon, other) for other in found) > 0.9


def test_more_and_less_sensitive_maps_have_more_and_fewer_rooms() -> None:
    grid = draw(HOUSE).grid
    counts = [
        len(create_map(grid, "1", Ids(), replace(PARAMS, divider_sensitivity=sensitivity)).rooms)
        for sensitivity in (-30, -8, 0, 3)
    ]
    assert counts == sorted(counts)
    assert counts[0] == 1
    assert counts[2] == 6


def test_what_was_only_seen_through_panes_is_no_room() -> None:
    home = draw(HOUSE, margin=30)
    beams = [
        rectangle(11.1, 3.0, 16.0, 3.4),
        shapely.Polygon([(11.1, 1.0), (16.0, 0.2), (16.0, 0.9), (11.1, 1.5)]),
    ]
    made = create_map(paint(home.grid, Cell.FREE, *beams), "1", Ids())
    rooms = shapely.union_all([room.polygon for room in made.rooms])
    assert len(made.rooms) == 6
    assert all(shapely.intersection(beam, rooms).area < 0.35 * beam.area for beam in beams)
    assert violations(made, paint(home.grid, Cell.FREE, *beams), PARAMS.wall_reach_m) == ()
