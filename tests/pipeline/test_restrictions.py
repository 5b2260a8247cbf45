import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon, box

from stillroom.errors import InvalidEdit
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import GridFrame
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Ids, Restriction, Room, SemanticMap
from stillroom.pipeline.edits import AddRestriction, RemoveRestriction, apply_edits
from stillroom.pipeline.restrictions import carry_restrictions

FRAME = GridFrame(0.05, 200, 120, Pose(-1.0, -1.0))
KITCHEN = Room("r1", "Kitchen", 1, box(0, 0, 4, 4))
HALL = Room("r2", "Hall", 2, box(4, 0, 8, 4))
ZONE = Restriction("z1", "no_go", ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)))
WALL = Restriction("z2", "virtual_wall", ((1.0, 3.0), (3.0, 3.0)))
MAP = SemanticMap(FRAME, rooms=(KITCHEN, HALL), restrictions=(ZONE,), ids=Ids(used=(("z", 1),)))


def moved(rooms: tuple[Room, ...], pose: Pose) -> tuple[Room, ...]:
    return tuple(
        Room(r.id, r.name, r.segment_id, Polygon(pose.apply(as_points(r.polygon.exterior.coords)))) for r in rooms
    )


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.1, 0.1))
def test_a_restriction_moves_with_the_map_and_keeps_its_shape(x: float, y: float, yaw: float) -> None:
    pose = Pose(x, y, yaw)
    zone, wall = carry_restrictions(
        (ZONE, WALL), Motion.rigid(pose), (KITCHEN, HALL), moved((KITCHEN, HALL), pose), FRAME
    )
    assert zone.placed
    assert wall.placed
    assert np.allclose(zone.shape, pose.apply(as_points(ZONE.shape)), atol=1e-3)
    assert Polygon(zone.shape).area == pytest.approx(1.0, abs=1e-3)


def test_a_restriction_whose_room_went_elsewhere_is_kept_and_says_that_it_is_not_placed() -> None:
    elsewhere = (Room("r1", "Kitchen", 1, box(4, 0, 8, 4)), Room("r2", "Hall", 2, box(0, 0, 4, 4)))
    (zone,) = carry_restrictions((ZONE,), Motion.rigid(Pose()), (KITCHEN, HALL), elsewhere, FRAME)
    assert not zone.placed
    assert zone.shape == ZONE.shape


def test_a_restriction_on_ground_that_moved_apart_is_not_placed_and_not_weakened() -> None:
    torn = Motion(as_points(ZONE.shape), as_points([(1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)]))
    (zone,) = carry_restrictions((ZONE,), torn, (KITCHEN, HALL), (KITCHEN, HALL), FRAME)
    assert not zone.placed
    assert Polygon(zone.shape).area == pytest.approx(1.0, abs=1e-3)


def test_a_lost_restriction_stays_lost_until_a_person_draws_it_again() -> None:
    lost = Restriction("z1", "no_go", ZONE.shape, placed=False)
    (zone,) = carry_restrictions((lost,), Motion.rigid(Pose()), (KITCHEN, HALL), (KITCHEN, HALL), FRAME)
    assert not zone.placed


def test_people_add_and_remove_restrictions() -> None:
    added = apply_edits(MAP, [AddRestriction("no_mop", ((5.0, 1.0), (6.0, 1.0), (6.0, 2.0), (5.0, 1.0)))]).map
    assert [(r.kind, len(r.shape)) for r in added.restrictions] == [("no_go", 4), ("no_mop", 3)]
    assert len({r.id for r in added.restrictions}) == 2
    assert apply_edits(added, [RemoveRestriction("z1")]).map.restrictions == added.restrictions[1:]


@pytest.mark.parametrize(
    ("kind", "shape"),
    [
        ("no_go", ((0.0, 0.0), (1.0, 0.0))),
        ("no_go", ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))),
        ("virtual_wall", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))),
        ("virtual_wall", ((0.0, 0.0), (0.0, 0.0))),
        ("no_go", ((100.0, 0.0), (101.0, 0.0), (101.0, 1.0))),
        ("no_go", ((float("nan"), 0.0), (101.0, 0.0), (101.0, 1.0))),
    ],
)
def test_a_restriction_that_makes_no_sense_is_refused_where_it_is_wrong(
    kind: str, shape: tuple[tuple[float, float], ...]
) -> None:
    with pytest.raises(InvalidEdit) as refused:
        apply_edits(MAP, [AddRestriction(kind, shape)])  # type: ignore[arg-type]
    assert refused.value.faults[0].pointer == "/operations/0/shape"


def test_removing_a_restriction_that_is_not_there_is_refused() -> None:
    with pytest.raises(InvalidEdit):
        apply_edits(MAP, [RemoveRestriction("z9")])
