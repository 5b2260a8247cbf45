"""Simulated robots: what they upload, and that nobody's answer changes it."""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from stillroom.maps.geometry import Points, as_points
from stillroom.maps.grid import Cell
from stillroom.simulator.building import draw_home
from stillroom.simulator.distortion import Distortion
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot
from stillroom.simulator.homes import Home

STREAMS = Streams(6)
BENT = replace(Effects.NONE, jitter_m=0.05, jitter_deg=0.5, drift_m=0.2, drift_deg=5.0)
LIVELY = replace(Effects.DEMO, furniture_moves=0.3, tracking_outliers=0.1, tracking_missing=0.3, drift_m=0.05)


@pytest.fixture(scope="module")
def home() -> Home:
    return draw_home(STREAMS.of("home"), 6)


def document(home: Home, bent: Distortion) -> dict[str, Any]:
    """A map document with the true rooms and doors, as a mission's map bends them."""

    def feature(key: str, semantic: str, kind: str, coordinates: object) -> dict[str, Any]:
        return {"id": key, "geometry": {"type": kind, "coordinates": coordinates}, "properties": {"semantic": semantic}}

    rooms = [bent.apply(as_points(room.polygon.exterior.coords)).tolist() for room in home.rooms]
    doors = [bent.apply(as_points(door.line)).tolist() for door in home.doors]
    return {
        "version": 7,
        "mission": "2",
        "features": [feature(f"r{i}", "room", "Polygon", [ring]) for i, ring in enumerate(rooms)]
        + [feature(f"d{i}", "divider", "LineString", line) for i, line in enumerate(doors)]
        + [feature("w1", "wall", "LineString", rooms[0])],
    }


def corners(home: Home) -> list[Points]:
    return [as_points(room.polygon.exterior.coords)[:-1] for room in home.rooms]


def test_tracked_vertices_move_as_the_map_does(home: Home) -> None:
    robot = SimulatedRobot(home, STREAMS, BENT)
    tracking = robot.tracking(document(home, robot.distortion(2)), base_mission=2, number=5)
    assert tracking is not None
    after = robot.distortion(5)
    assert list(tracking["rooms"]) == [f"r{i}" for i in range(6)]
    for tracked, true in zip(tracking["rooms"].values(), corners(home), strict=True):
        assert np.abs(as_points(tracked) - after.apply(true)).max() < 1e-4
        assert np.abs(as_points(tracked) - true).max() > 0.05
    for tracked, door in zip(tracking["dividers"].values(), home.doors, strict=True):
        assert np.abs(as_points(tracked) - after.apply(as_points(door.line))).max() < 1e-4


def errors(home: Home, effects: Effects) -> Points:
    robot = SimulatedRobot(home, STREAMS, effects)
    tracking = robot.tracking(document(home, robot.distortion(2)), 2, 5)
    assert tracking is not None
    tracked = np.concatenate([as_points(ring) for ring in tracking["rooms"].values()])
    return np.asarray(tracked - robot.distortion(5).apply(np.concatenate(corners(home))))


def test_tracking_noise_is_on_every_vertex_and_outliers_on_some(home: Home) -> None:
    noise = errors(home, replace(BENT, tracking_noise_m=0.02))
    assert noise.std() == pytest.approx(0.02, rel=0.35)
    gross = np.linalg.norm(errors(home, replace(BENT, tracking_outliers=0.2)), axis=1)
    assert 0 < (gross > 0.1).sum() < 0.5 * len(gross)
    assert (gross[gross <= 0.1] < 1e-3).all()


def test_a_mission_may_come_without_tracking(home: Home) -> None:
    silent = SimulatedRobot(home, STREAMS, replace(BENT, tracking_missing=1.0))
    base = document(home, silent.distortion(2))
    assert silent.tracking(base, 2, 5) is None
    meta = silent.meta(silent.sortie(5), base)
    assert "tracking" not in meta
    assert meta["base_version"] == 7


def test_the_first_mission_has_nothing_to_track(home: Home) -> None:
    robot = SimulatedRobot(home, STREAMS, BENT)
    meta = robot.meta(robot.sortie(0), None)
    assert {"base_version", "tracking"}.isdisjoint(meta)
    assert meta["sequence"] == 0


def test_what_is_uploaded_is_the_grid_with_the_highest_row_first(home: Home) -> None:
    robot = SimulatedRobot(home, STREAMS, Effects.DEMO)
    sortie = robot.sortie(0)
    grey = cv2.imdecode(np.frombuffer(sortie.png(), np.uint8), cv2.IMREAD_UNCHANGED)
    assert grey is not None
    cells = sortie.sensed.grid.cells
    for value, cell in ((254, Cell.FREE), (0, Cell.OCCUPIED), (205, Cell.UNEXPLORED)):
        assert np.array_equal(grey[::-1] == value, cells == cell)
    meta = robot.meta(sortie, None)
    assert meta["origin"] == pytest.approx([sortie.sensed.grid.frame.origin.x, sortie.sensed.grid.frame.origin.y, 0.0])


def test_what_a_service_answers_never_changes_what_the_robot_does_next(home: Home) -> None:
    undisturbed, asked = SimulatedRobot(home, STREAMS, LIVELY), SimulatedRobot(home, STREAMS, LIVELY)
    for number in range(4):
        expected, sortie = undisturbed.sortie(number), asked.sortie(number)
        many = document(home, asked.distortion(2))
        many["features"] *= number + 1
        asked.meta(sortie, many)
        asked.tracking(many, 0, number)
        assert sortie.png() == expected.png()
        assert sortie.world == expected.world


def test_a_robot_that_starts_again_goes_on_where_it_was(home: Home) -> None:
    going = SimulatedRobot(home, STREAMS, LIVELY)
    missions = [going.sortie(number).png() for number in range(4)]
    again = SimulatedRobot(home, STREAMS, LIVELY)
    assert again.sortie(3).png() == missions[3]
    assert again.sortie(1).png() == missions[1]


@pytest.mark.parametrize("effect", ["furniture_moves", "jitter_m", "gaps_per_10m", "tracking_noise_m", "specks"])
def test_an_effect_that_is_switched_off_leaves_the_others_as_they_were(home: Home, effect: str) -> None:
    on, off = (SimulatedRobot(home, STREAMS, e) for e in (LIVELY, replace(LIVELY, **{effect: 0.0})))  # type: ignore[arg-type]
    one, other = on.sortie(2), off.sortie(2)
    assert (one.world.home == other.world.home) == (effect != "furniture_moves")
    assert one.world.skipped == other.world.skipped
    assert np.array_equal(one.distortion.turns, other.distortion.turns)
    assert np.array_equal(one.distortion.shifts, other.distortion.shifts) == (effect != "jitter_m")
    assert (one.png() == other.png()) == (effect == "tracking_noise_m")


def test_streams_are_the_same_for_the_same_purpose_and_independent_otherwise() -> None:
    def draw(seed: int, robot: int, mission: int) -> float:
        return float(Streams(seed, robot).of("scans", mission).random())

    assert draw(1, 2, 3) == draw(1, 2, 3)
    assert len({draw(1, 2, 3), draw(0, 2, 3), draw(1, 0, 3), draw(1, 2, 0), Streams(1, 2).of("gaps", 3).random()}) == 5


def test_explored_grows_and_leaves_out_what_stands_there_now(home: Home) -> None:
    robot = SimulatedRobot(home, STREAMS, LIVELY)
    first, second = robot.sortie(0), robot.sortie(1)
    assert not (second.explored & second.sensed.floor.solid).any()
    cleared = first.explored & ~second.explored & ~second.sensed.floor.solid
    assert cleared.mean() < 0.002, "nothing but slivers beside what was put there"


def test_what_was_seen_in_a_sliver_alone_is_not_explored(home: Home) -> None:
    explored = SimulatedRobot(home, STREAMS, LIVELY).sortie(0).explored.astype(np.uint8)
    assert explored.any()
    assert np.array_equal(cv2.morphologyEx(explored, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)), explored)


def test_a_robot_that_was_reset_tracks_nothing_across_that(home: Home) -> None:
    effects = replace(BENT, resets=0.4, drift_m=0.0, drift_deg=0.0)
    robot = SimulatedRobot(home, STREAMS, effects)
    epochs = [robot.epoch(number) for number in range(12)]
    assert epochs[0] == 0
    assert 1 < epochs[-1] < 11
    for number in range(1, 12):
        base = document(home, robot.distortion(number - 1)) | {"mission": str(number - 1)}
        same = epochs[number] == epochs[number - 1]
        meta = robot.meta(robot.sortie(number), base)
        assert meta["epoch"] == epochs[number]
        assert ("tracking" in meta) == ("base_version" in meta) == same
        frames = [robot.distortion(mission).frame for mission in (number - 1, number)]
        assert (abs(frames[1].x - frames[0].x) < 1e-9) == same
        assert ("resets" in robot.sortie(number).happened) == (not same)
    last = epochs.index(epochs[-1])
    assert robot.tracking(document(home, robot.distortion(0)), last - 1, 11) is None


def test_on_another_floor_the_robot_maps_another_home_and_learns_nothing_of_its_own(home: Home) -> None:
    lost, there = (SimulatedRobot(home, STREAMS, replace(LIVELY, other_floors=share)) for share in (1.0, 0.0))
    first, elsewhere = lost.sortie(0), lost.sortie(1)
    assert (first.refuse, elsewhere.refuse) == (None, "other_floors")
    assert elsewhere.png() != there.sortie(1).png()
    assert elsewhere.happened == {"other_floors"}
    assert elsewhere.explored.sum() <= first.explored.sum()


def test_on_another_floor_a_robot_tracks_nothing_or_believes_that_nothing_moved(home: Home) -> None:
    effects = replace(BENT, other_floors=1.0)
    tracked = set()
    for seed in range(12):
        robot = SimulatedRobot(home, Streams(seed), effects)
        base = document(home, robot.distortion(2))
        tracking = robot.tracking(base, 2, 5)
        tracked.add(tracking is not None)
        if tracking is not None:
            was = [as_points(f["geometry"]["coordinates"][0])[:-1] for f in base["features"][:6]]
            assert (
                np.abs(np.concatenate([*map(as_points, tracking["rooms"].values())]) - np.concatenate(was)).max() < 1e-3
            )
    assert tracked == {True, False}
