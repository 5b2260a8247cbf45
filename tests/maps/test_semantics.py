import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import GridFrame
from stillroom.maps.semantics import Divider, Ids, Restriction, Room, SemanticMap, Wall
from tests.drawing import rectangle

takes = st.lists(st.tuples(st.sampled_from(["r", "d", "v", "m"]), st.integers(0, 5)), max_size=20)


@given(takes, st.sampled_from(["", "2-", "17-"]))
def test_an_id_is_never_given_twice(orders: list[tuple[str, int]], prefix: str) -> None:
    ids = Ids(prefix)
    given_out: list[str] = []
    for kind, count in orders:
        fresh, ids = ids.take(kind, count)
        assert len(fresh) == count
        given_out += fresh
    assert len(set(given_out)) == len(given_out)


def test_ids_are_numbered_by_kind_and_carry_the_maps_prefix() -> None:
    rooms, ids = Ids("2-").take("r", 2)
    (divider,), ids = ids.take("d")
    (third,), _ = ids.take("r")
    assert (*rooms, divider, third) == ("r2-1", "r2-2", "d2-1", "r2-3")


@given(takes)
def test_maps_of_one_robot_have_no_id_in_common(orders: list[tuple[str, int]]) -> None:
    first, second = Ids(), Ids("2-")
    for kind, count in orders:
        a, first = first.take(kind, count)
        b, second = second.take(kind, count)
        assert not set(a) & set(b)


def test_taking_ids_leaves_the_counter_it_was_asked_for_unchanged() -> None:
    ids = Ids()
    assert ids.take("r") == ids.take("r")


def test_rooms_and_dividers_are_found_by_id() -> None:
    room = Room("r1", "Kitchen", 1, rectangle(0, 0, 1, 1))
    divider = Divider("d1", ((0.0, 0.0), (1.0, 0.0)))
    found = SemanticMap(GridFrame(0.05, 20, 20), rooms=(room,), dividers=(divider,))
    assert (found.room("r1"), found.room("r2")) == (room, None)
    assert (found.divider("d1"), found.divider("d2")) == (divider, None)


def test_vertices_are_those_of_all_semantics_and_the_grids_corners_once_each() -> None:
    hole = rectangle(0, 0, 4, 4).difference(rectangle(1, 1, 2, 2))
    semantic_map = SemanticMap(
        GridFrame(0.1, 50, 60, Pose(-1, -2)),
        rooms=(Room("r1", "Hall", 1, hole),),
        dividers=(Divider("d1", ((0.0, 4.0), (4.0, 4.0))),),
        walls=(Wall("w1", ((0.0, 0.0), (0.0, 3.0), (0.0, 4.0))),),
        restrictions=(Restriction("z1", "no_go", ((3.0, 3.0), (3.5, 3.0), (3.0, 3.5))),),
    )
    vertices = semantic_map.vertices()
    corners = {(-1, -2), (4, -2), (4, 4), (-1, 4)}
    room = {(0, 0), (4, 0), (4, 4), (0, 4), (1, 1), (2, 1), (2, 2), (1, 2)}
    assert {tuple(v) for v in vertices.tolist()} == corners | room | {(0, 3), (3, 3), (3.5, 3), (3, 3.5)}
    assert len(np.unique(vertices, axis=0)) == len(vertices)
