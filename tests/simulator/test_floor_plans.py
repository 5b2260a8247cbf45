"""Homes from floor plans: of a small one written here, and of real ones where they are at hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot
from stillroom.simulator.floor_plans import UnusablePlan, homes_in, planned_home, read_home
from stillroom.simulator.homes import Home, unreachable_rooms
from tests.real.shared import DATA

PLANS = DATA / "sweethome3d"
DOOR = '<doorOrWindow name="Door" x="{x}" y="{y}" angle="{angle}" width="90" depth="{depth}" height="208"/>'
WINDOW = '<doorOrWindow name="Window" x="200" y="0" elevation="90" width="90" depth="20" height="100"/>'


def wall(x0: int, y0: int, x1: int, y1: int) -> str:
    return f'<wall xStart="{x0}" yStart="{y0}" xEnd="{x1}" yEnd="{y1}" thickness="10"/>'


def room(name: str, x0: int, y0: int, x1: int, y1: int) -> str:
    corners = "".join(f'<point x="{x}" y="{y}"/>' for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
    return f'<room name="{name}">{corners}</room>'


WALLS = [wall(0, 0, 900, 0), wall(900, 0, 900, 500), wall(900, 500, 0, 500), wall(0, 500, 0, 0)]
WALLS += [wall(400, 0, 400, 500), wall(400, 200, 900, 200)]
ROOMS = [room("Living room", 0, 0, 400, 500), room("Kitchen", 400, 0, 650, 200), room("Larder", 650, 0, 900, 200)]
ROOMS += [room("", 400, 200, 900, 500), room("Balcony", 900, 0, 1000, 500)]
DOORS = [
    DOOR.format(x=430, y=100, angle="1.5707964", depth=70),  # with its leaf open: its middle lies before the wall
    DOOR.format(x=400, y=350, angle="1.5707964", depth=10),
    WINDOW,
]
TABLE = '<pieceOfFurniture name="Table" x="650" y="350" width="120" depth="80" height="74"/>'
FURNITURE = [
    '<pieceOfFurniture name="Sofa" x="60" y="250" angle="1.5707964" width="200" depth="90" height="80"/>',
    '<pieceOfFurniture name="Lamp" x="200" y="250" elevation="200" width="40" depth="40" height="30"/>',
    f"<furnitureGroup>{TABLE}</furnitureGroup>",
]


def plan(folder: Path, *elements: str) -> Path:
    file = folder / "plan.xml"
    file.write_text(f"<home>{''.join(elements)}</home>")
    return file


@pytest.fixture
def home(tmp_path: Path) -> Home:
    return read_home(plan(tmp_path, *WALLS, *ROOMS, *DOORS, *FURNITURE), None, np.random.default_rng(1), 0.0)


def test_rooms_go_from_wall_to_wall_in_metres(home: Home) -> None:
    areas = {room.name: room.polygon.area for room in home.rooms}
    assert areas == pytest.approx(
        {"Living room": 3.9 * 4.9, "Kitchen": 2.45 * 1.9, "Larder": 2.45 * 1.9, "Room": 14.21}
    )


def test_doors_lie_in_their_walls_and_where_there_is_no_wall_rooms_are_open_to_each_other(home: Home) -> None:
    joined = {frozenset(door.rooms): door.kind for door in home.doors}
    assert joined == {
        frozenset({"Living room", "Kitchen"}): "door",
        frozenset({"Living room", "Room"}): "door",
        frozenset({"Kitchen", "Larder"}): "opening",
    }
    for door in home.doors:
        assert all(
            shapely.distance(home.room(name).polygon, shapely.LineString(door.line)) < 0.2 for name in door.rooms
        )


def test_only_what_stands_on_the_floor_is_in_the_way_and_tables_stand_on_legs(home: Home) -> None:
    standing = {piece.id.split("/")[1].rpartition(" ")[0]: piece for piece in home.furniture}
    assert set(standing) <= {"Sofa", "Table"}
    assert "Table" in standing
    assert len(standing["Table"].solid.geoms) == 4


def test_the_dock_stands_in_the_largest_room_and_every_room_is_reached(home: Home) -> None:
    assert shapely.contains(home.room("Living room").polygon, shapely.Point(home.dock))
    assert unreachable_rooms(home, 0.2) == ()


def test_one_home_in_two_is_mirrored_and_all_are_turned(tmp_path: Path) -> None:
    file = plan(tmp_path, *WALLS, *ROOMS, *DOORS)
    signs = set()
    for seed in range(8):
        home = read_home(file, None, np.random.default_rng(seed), 0.3)
        larder, living = (home.room(name).polygon.centroid for name in ("Larder", "Living room"))
        other = home.room("Room").polygon.centroid
        along, aside = (np.array([p.x - living.x, p.y - living.y]) for p in (larder, other))
        signs.add(bool(along[0] * aside[1] - along[1] * aside[0] > 0))
    assert signs == {True, False}


def test_rooms_that_the_robot_cannot_get_to_are_left_out(tmp_path: Path) -> None:
    file = plan(tmp_path, *WALLS, *ROOMS[:4], room("Shed", 1200, 0, 1500, 300), *DOORS)
    names = {room.name for room in read_home(file, None, np.random.default_rng(1), 0.0).rooms}
    assert names == {"Living room", "Kitchen", "Larder", "Room"}


@pytest.mark.parametrize("text", ["<home>", "no plan at all", ""])
def test_a_file_that_is_no_plan_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "broken.xml").write_text(text)
    with pytest.raises(UnusablePlan, match=r"broken\.xml"):
        homes_in(tmp_path)


def test_a_plan_without_doors_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusablePlan, match="gets to 1"):
        read_home(plan(tmp_path, *WALLS, ROOMS[0], ROOMS[1], ROOMS[3]), None, np.random.default_rng(1), 0.0)


def test_a_folder_without_plans_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusablePlan, match="no plan"):
        planned_home(tmp_path, Streams(1), Effects.NONE)


@pytest.mark.skipif(not PLANS.is_dir(), reason=f"there are no floor plans in {PLANS}")
def test_real_floor_plans_are_homes_that_robots_map() -> None:
    count = len(homes_in(PLANS))
    assert count >= 5
    for robot in range(count):
        streams = Streams(1, robot)
        home = planned_home(PLANS, streams, replace(Effects.NONE, turned=True, windows=0.2))
        assert len(home.rooms) >= 3
        assert unreachable_rooms(home, 0.2) == ()
        sortie = SimulatedRobot(home, streams, Effects.NONE).sortie(0)
        free = sortie.sensed.grid.free.sum() * 0.05**2
        assert free > 0.3 * sum(room.polygon.area for room in home.rooms)
