"""Effects: each is switched on by its own name, and none changes what another one draws."""

from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import shapely

from stillroom.simulator.building import home_of
from stillroom.simulator.effects import EFFECTS, Effects, Streams
from stillroom.simulator.faults import draw_gaps
from stillroom.simulator.fleet import SimulatedRobot, Sortie
from stillroom.simulator.homes import Home
from stillroom.simulator.severities import HARD, MIDDLE, MILD, SEVERITIES

STREAMS = Streams(4, 3)
MISSION = 9
LIVELY = replace(
    HARD,
    open_plan=1.0,
    windows=0.5,
    furniture_moves=0.3,
    doors_shut=0.7,
    doorways_blocked=0.4,
    rooms_skipped=0.4,
    battery_ends=1.0,
    passages=1.0,
    slam_failures=0.0,
    tracking_missing=0.0,
    other_floors=0.0,
    bumpers=0.0,
    turned_grids=0.0,
    resets=0.0,
    spread=1.0,
    resolutions=(0.05,),
)


def test_every_field_belongs_to_one_effect() -> None:
    named = [field for of_one in EFFECTS.values() for field in of_one]
    assert sorted(named) == sorted(field.name for field in fields(Effects))


def test_effects_are_picked_by_name() -> None:
    picked = HARD.only({"gaps", "drift"})
    assert picked == replace(
        Effects.NONE,
        gaps_per_10m=HARD.gaps_per_10m,
        gap_m=HARD.gap_m,
        drift_m=HARD.drift_m,
        drift_deg=HARD.drift_deg,
    )
    assert HARD.only(EFFECTS.keys()) == HARD
    assert HARD.only(()) == Effects.NONE


def test_an_effect_that_there_is_not_is_an_error() -> None:
    with pytest.raises(KeyError):
        HARD.only({"ghosts"})


def test_each_severity_has_at_least_as_much_of_everything_as_the_one_before() -> None:
    assert list(SEVERITIES.values()) == [MILD, MIDDLE, HARD]
    for field in fields(Effects):
        mild, middle, hard = (getattr(of, field.name) for of in (MILD, MIDDLE, HARD))
        if not isinstance(mild, tuple):
            assert mild <= middle <= hard, field.name


def test_robots_have_more_or_less_of_each_error_and_one_resolution() -> None:
    robots = [HARD.of_robot(Streams(1, robot).of("model")) for robot in range(40)]
    jitters = np.array([robot.jitter_m for robot in robots]) / HARD.jitter_m
    assert jitters.min() >= 1 / HARD.spread
    assert jitters.max() <= HARD.spread
    assert jitters.std() > 0.2
    assert {robot.resolutions for robot in robots} == {(resolution,) for resolution in HARD.resolutions}
    assert all(robot.doors_shut == HARD.doors_shut for robot in robots), "that is of homes, not of robots"


def test_the_errors_of_a_robot_go_up_and_down_together_within_an_effect() -> None:
    robot = HARD.of_robot(Streams(1, 2).of("model"))
    assert robot.jitter_m / HARD.jitter_m == pytest.approx(robot.jitter_deg / HARD.jitter_deg)
    assert robot.jitter_m / HARD.jitter_m != pytest.approx(robot.drift_m / HARD.drift_m)


@cache
def sortie(effects: Effects) -> tuple[SimulatedRobot, Sortie]:
    robot = SimulatedRobot(home_of(STREAMS, effects), STREAMS, effects)
    return robot, robot.sortie(MISSION)


def rounded(points: Any) -> Any:
    return np.round(points, 6).tolist()


def facets(effects: Effects) -> dict[str, Any]:
    """All that is drawn for a mission, each thing on its own."""
    robot, there = sortie(effects)
    world, rooms = there.world, there.world.home.rooms
    box = {"features": [_feature(room.name, room.polygon) for room in rooms]}
    return {
        "rooms": [room.polygon.wkt for room in rooms],
        "windows": [window.panes.wkt for window in world.home.windows],
        "doors": [door.line for door in world.home.doors],
        "furniture": {piece.id: piece.solid.wkt for piece in world.home.furniture},
        "shut": world.shut,
        "in_doorways": [thing.wkt for thing in world.in_doorways],
        "skipped": world.skipped,
        "battery": world.battery,
        "clear": world.clear,
        "jitter": (rounded(there.distortion.shifts), rounded(there.distortion.turns)),
        "drift": there.distortion.frame,
        "gaps": [gap.strip.wkt for gap in draw_gaps(world.home, MISSION, effects, STREAMS.of("gaps", MISSION))],
        "grid": there.png(),
        "tracking": robot.tracking(box | {"version": 1, "mission": "8"}, 8, MISSION),
    }


def _feature(name: str, shape: shapely.Polygon) -> dict[str, Any]:
    corners = shapely.get_coordinates(shape.exterior).tolist()
    return {"id": name, "geometry": {"coordinates": [corners]}, "properties": {"semantic": "room"}}


CHANGES: dict[str, set[str]] = {
    "windows": {"windows", "clear", "grid"},
    "furniture": {"furniture", "grid"},
    "doors": {"shut", "in_doorways", "grid"},
    "blocked_doorways": {"in_doorways", "grid"},
    "skipped_rooms": {"skipped", "grid"},
    "battery": {"battery", "grid"},
    "late_rooms": {"grid"},
    "passages": {"doors", "furniture", "skipped", "in_doorways", "grid"},
    "range_noise": {"grid"},
    "registration_noise": {"grid"},
    "gaps": {"gaps", "grid"},
    "specks": {"grid"},
    "jitter": {"jitter", "grid", "tracking"},
    "drift": {"drift", "grid", "tracking"},
    "tracking_noise": {"tracking"},
    "tracking_outliers": {"tracking"},
    "tracking_forms": {"tracking"},
    "late_uploads": set(),
    "stale_bases": set(),
}
"""What is other without the effect, at the most; and, but for what comes from chance alone, at least."""


@pytest.mark.parametrize("effect", CHANGES)
def test_an_effect_that_is_switched_off_leaves_the_draws_of_all_others_as_they_were(effect: str) -> None:
    on, off = facets(LIVELY), facets(LIVELY.only(EFFECTS.keys() - {effect}))
    changed = {name for name in on if on[name] != off[name]}
    assert changed <= CHANGES[effect]
    if effect not in ("late_rooms", "tracking_forms", "late_uploads", "stale_bases", "windows"):
        assert changed, "it does something"


@pytest.mark.parametrize(
    ("effect", "changes"),
    [
        ({"bumpers": 1.0}, {"grid"}),
        ({"turned_grids": 1.0}, {"grid"}),
        ({"slam_failures": 1.0}, {"grid"}),
        ({"other_floors": 1.0}, {"grid", "tracking"}),
        ({"tracking_missing": 1.0}, {"tracking"}),
        ({"submap_tracking": 1.0}, {"tracking"}),
        ({"resets": 1.0}, {"drift", "grid", "tracking"}),
    ],
)
def test_an_effect_that_is_switched_on_leaves_the_draws_of_all_others_as_they_were(
    effect: dict[str, float], changes: set[str]
) -> None:
    off, on = facets(LIVELY), facets(replace(LIVELY, **effect))  # type: ignore[arg-type]
    assert {name for name in on if on[name] != off[name]} == changes


def homes(**effects: float) -> tuple[Home, Home]:
    plain = replace(Effects.NONE, open_plan=0.0)
    return home_of(STREAMS, plain), home_of(STREAMS, replace(plain, **effects))  # type: ignore[arg-type]


def test_a_turned_home_is_the_same_home_at_another_angle() -> None:
    straight, turned = homes(turned=True)
    for room, other in zip(straight.rooms, turned.rooms, strict=True):
        assert room.polygon.area == pytest.approx(other.polygon.area)
        assert len(room.polygon.exterior.coords) == len(other.polygon.exterior.coords)
    assert rotated(straight) == 0.0
    assert 0.01 < rotated(turned) < np.pi / 2 - 0.01


def rotated(home: Home) -> float:
    """Of the hall's walls, from the axes."""
    ring = shapely.get_coordinates(home.room("Hall").polygon.exterior)
    return round(float(np.arctan2(*(ring[1] - ring[0])[::-1]) % (np.pi / 2)), 9) % round(np.pi / 2, 9)


def test_a_home_with_thin_walls_has_the_same_rooms_up_to_their_walls() -> None:
    thick, thin = homes(thin_walls=1.0)
    assert [room.name for room in thick.rooms] == [room.name for room in thin.rooms]
    assert all(
        thin.room(room.name).polygon.area > room.polygon.area and "thin_walls" in thin.traits for room in thick.rooms
    )
    gaps = [door.polygon.area / shapely.LineString(door.line).length for door in thin.doors]
    assert np.allclose(gaps, 0.07)


def test_diagonal_walls_cut_corners_off() -> None:
    square, cut = homes(diagonal_walls=1.0)
    corners = [sum(len(room.polygon.exterior.coords) for room in home.rooms) for home in (square, cut)]
    assert corners[1] >= corners[0] + 1
    assert cut.traits == {"diagonal_walls"}


def test_an_open_plan_has_rooms_with_no_wall_between_them() -> None:
    walled, open_plan = homes(open_plan=1.0)
    assert len(open_plan.rooms) == len(walled.rooms) + 1
    between = next(door for door in open_plan.doors if set(door.rooms) == {"Living room", "Dining room"})
    assert between.kind == "opening"
    for name in between.rooms:
        edge = shapely.intersection(
            open_plan.room(name).polygon.exterior, shapely.buffer(between.polygon, 1e-3, join_style="mitre")
        )
        assert edge.length >= 0.95 * shapely.LineString(between.line).length
    assert shapely.distance(shapely.buffer(between.polygon, 1e-6), open_plan.walls) < 1e-3, "from wall to wall"
