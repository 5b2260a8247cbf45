"""What owners of simulated homes do in the app."""

from typing import Any

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon

from stillroom.maps.geometry import as_points
from stillroom.simulator.client import Refused
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.homes import Door, Home, TrueRoom, box
from stillroom.simulator.owner import drop_scraps, join, name_rooms, not_a_place, part, tidy_up
from stillroom.simulator.plans import thick_line

STRAIGHT = Distortion(np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1))
SHAPES = {"Kitchen": box(0, 0, 4, 4), "Office": box(4.1, 0, 8.1, 4)}
LINE = ((4.05, 1.0), (4.05, 2.0))
DOOR = Door("door-0", "door", ("Kitchen", "Office"), LINE, thick_line(LINE, 0.1))


def document(*features: tuple[str, str, shapely.Geometry, dict[str, Any]]) -> dict[str, Any]:
    def coordinates(of: shapely.Geometry) -> list[Any]:
        if isinstance(of, Polygon):
            return [as_points(ring.coords).tolist() for ring in (of.exterior, *of.interiors)]
        line: list[Any] = as_points(shapely.get_coordinates(of)).tolist()
        return line

    return {
        "features": [
            {"id": key, "geometry": {"coordinates": coordinates(shape)}, "properties": {"semantic": semantic} | more}
            for key, semantic, shape, more in features
        ]
    }


def room(key: str, shape: Polygon, name: str = "Room 1") -> tuple[str, str, shapely.Geometry, dict[str, Any]]:
    return key, "room", shape, {"name": name}


def test_a_doorway_that_nothing_divides_gets_a_divider() -> None:
    (operation,) = part(DOOR, STRAIGHT, SHAPES, 0.0, document(room("r1", box(0, 0, 8.1, 4))))
    assert operation == {"op": "add_divider", "line": [[4.05, 1.0], [4.05, 2.0]], "kind": "door"}


def test_a_divider_that_lies_askew_in_a_doorway_is_moved() -> None:
    askew = ("d1", "divider", LineString([(4.2, 0.8), (4.0, 2.2)]), {"rooms": ["r1", "r2"]})
    (operation,) = part(DOOR, STRAIGHT, SHAPES, 0.0, document(room("r1", box(0, 0, 8.1, 4)), askew))
    assert operation == {"op": "move_divider", "id": "d1", "line": [[4.05, 1.0], [4.05, 2.0]]}


def test_a_divider_that_only_ends_beside_a_doorway_stays_where_it_is() -> None:
    other = ("d1", "divider", LineString([(4.05, 2.1), (8.1, 2.1)]), {"rooms": ["r1", "r2"]})
    (operation,) = part(DOOR, STRAIGHT, SHAPES, 0.0, document(room("r1", box(0, 0, 8.1, 4)), other))
    assert operation == {"op": "add_divider", "line": [[4.05, 1.0], [4.05, 2.0]], "kind": "door"}


def test_what_a_room_has_of_the_outside_behind_a_window_is_no_real_place() -> None:
    view = MultiPolygon([box(2, 4, 3, 9)])
    reaches_out = shapely.union(SHAPES["Kitchen"], box(2, 4, 3, 6))
    (operation,) = not_a_place(view, document(room("r1", reaches_out), room("r2", SHAPES["Office"])))
    assert operation["op"] == "mark_phantom"
    assert shapely.symmetric_difference(Polygon(operation["shape"]), box(2, 4, 3, 6)).area < 0.01
    assert not_a_place(view, document(room("r1", SHAPES["Kitchen"]))) == []


def test_a_divider_is_drawn_longer_where_the_walls_beside_the_doorway_are_missing() -> None:
    merged = document(room("r1", box(0, 0, 8.1, 4)))
    tried: list[Any] = []

    def edit(step: Any) -> None:
        operations = step(merged)
        tried.extend(operations)
        if operations and operations[0]["op"] == "add_divider" and operations[0]["line"][0][1] > 0.4:
            raise Refused(422, "no wall there")

    home = Home(
        tuple(TrueRoom(name, "bed", shape) for name, shape in SHAPES.items()), MultiPolygon(), (DOOR,), (), (1, 1)
    )
    assert tidy_up(edit, home, STRAIGHT) == ()
    lines = [operation["line"] for operation in tried if operation["op"] == "add_divider"]
    assert lines == [[[4.05, 1.0], [4.05, 2.0]], [[4.05, 0.5], [4.05, 2.5]], [[4.05, 0.0], [4.05, 3.0]]]


def test_what_is_refused_at_last_is_told() -> None:
    def edit(step: Any) -> None:
        if step(document(room("r1", box(0, 0, 8.1, 4)))):
            raise Refused(422, "not today")

    home = Home(
        tuple(TrueRoom(name, "bed", shape) for name, shape in SHAPES.items()), MultiPolygon(), (DOOR,), (), (1, 1)
    )
    assert tidy_up(edit, home, STRAIGHT) == ("422: not today",)


def test_a_doorway_that_is_divided_is_left_alone() -> None:
    served = document(room("r1", box(0, 0, 4.1, 4)), room("r2", box(4.1, 0, 8.1, 4)))
    assert part(DOOR, STRAIGHT, SHAPES, 0.0, served) == []


def test_a_room_that_fell_into_parts_is_joined() -> None:
    served = document(room("r1", box(0, 0, 4, 2)), room("r2", box(0, 2, 4, 4)), room("r3", SHAPES["Office"]))
    assert join("Kitchen", SHAPES, served) == [{"op": "merge_rooms", "ids": ["r1", "r2"]}]
    assert join("Office", SHAPES, served) == []


def test_scraps_are_dropped_by_way_of_their_divider() -> None:
    served = document(
        room("r1", SHAPES["Kitchen"]),
        room("r2", box(4.0, 1.0, 4.1, 2.0)),
        ("d1", "divider", LineString(LINE), {"rooms": ["r1", "r2"]}),
    )
    assert drop_scraps(served) == [{"op": "remove_divider", "id": "d1"}]
    assert drop_scraps(document(room("r1", SHAPES["Kitchen"]))) == []


def test_rooms_get_the_names_of_the_true_ones_that_they_cover() -> None:
    served = document(
        room("r1", SHAPES["Office"]), room("r2", SHAPES["Kitchen"], "Kitchen"), room("r3", box(20, 0, 24, 4))
    )
    assert name_rooms(SHAPES, served) == [{"op": "rename_room", "id": "r1", "name": "Office"}]


def test_a_true_room_that_nothing_covers_names_nobody() -> None:
    assert name_rooms(SHAPES, document(room("r1", box(20, 0, 24, 4)))) == []
    assert name_rooms(SHAPES, document()) == []
