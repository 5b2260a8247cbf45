"""Drift (journey 3): rooms that creep against each other, too slowly for any one mission to show, are noticed; frames that move are not."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
import shapely

from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import Cell, GridFrame, OccupancyGrid
from stillroom.maps.mission import Tracking
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.edits import AddDivider, RenameRoom, apply_edits
from stillroom.pipeline.update import MapUpdate, update_map
from tests.drawing import paint, rectangle
from tests.golden.homes import FOUR_ROOMS
from tests.golden.uploads import assert_valid, conflicts_of, first_map, upload
from tests.missions import mission, random_pose, sense, track_all

STEP_M = 0.2
FRAME = GridFrame(0.05, 320, 220, Pose(-1.0, -1.0))
EMPTY = OccupancyGrid(FRAME, np.zeros((220, 320), np.uint8))


def home(slid_m: float = 0.0, up_m: float = 0.0) -> OccupancyGrid:
    """A hall of 13 x 2.4 m with rooms of 4 x 4 m above its ends; the walls of the left one have slid."""
    left = rectangle(0.2 + slid_m, 2.6 + up_m, 4.2 + slid_m, 6.6 + up_m)
    right, hall = rectangle(9.0, 2.6, 13.0, 6.6), rectangle(0.0, 0.0, 13.2, 2.4)
    walls = [room.buffer(0.2, join_style="mitre") for room in (left, right, hall)]
    doors = [rectangle(x, 2.35, x + 0.9, 2.65 + up) for x, up in ((1.8 + slid_m, up_m), (10.6, 0.0))]
    return paint(paint(EMPTY, Cell.OCCUPIED, *walls), Cell.FREE, left, right, hall, *doors)


@dataclass(frozen=True)
class Home:
    """The first map and which of its rooms slides."""

    map: SemanticMap
    slides: str


@cache
def began() -> Home:
    created = create_map(home(), "0", Ids())
    assert len(created.rooms) == 3
    (left,) = (room for room in created.rooms if shapely.contains_xy(room.polygon, 2.0, 5.0))
    return Home(created, left.id)


def creep(missions: int, step: tuple[float, float]) -> Iterator[MapUpdate]:
    """Each mission finds the left room's walls a step farther on, and the robot's tracking went with them."""
    semantic_map, slides = began().map, began().slides
    for number in range(1, missions + 1):
        still = track_all(semantic_map, Pose(), np.random.default_rng(number), 0.01)
        rooms = {id_: points + (step if id_ == slides else (0.0, 0.0)) for id_, points in still.rooms.items()}
        dividers = {
            d.id: still.dividers[d.id] + (step if slides in d.rooms else (0.0, 0.0)) for d in semantic_map.dividers
        }
        grid = home(number * step[0], number * step[1])
        update = update_map(
            semantic_map, mission(str(number), semantic_map, Tracking(rooms=rooms, dividers=dividers), grid)
        )
        if update.taken:
            assert_valid(update.map, grid)
        semantic_map = update.map
        yield update


def drifted(update: MapUpdate) -> set[str]:
    return {score.id for conflict in conflicts_of(update, "drift") for score in conflict.rooms}


def test_a_room_that_creeps_twenty_centimetres_a_mission_opens_a_conflict_before_a_fifth_of_it_is_gone() -> None:
    """Anchor recall of a room of 4 m is 1 - 0.05 n after n missions: 0.8 after the fourth."""
    updates = list(creep(12, (STEP_M, 0.0)))
    assert [update.taken for update in updates] == [True] * 12, [u.reason for u in updates if not u.taken]
    opened = [number for number, update in enumerate(updates, 1) if drifted(update)]
    assert 2 <= min(opened) <= 4
    assert opened == list(range(min(opened), 13))
    for number in opened:
        (conflict,) = conflicts_of(updates[number - 1], "drift")
        (score,) = conflict.rooms
        assert (score.id, conflict.cause, conflict.resolved) == (began().slides, "drift", False)
        assert score.recall == pytest.approx(1 - 0.05 * number, abs=0.06)
        assert score.name in conflict.summary


def test_no_single_mission_of_those_shows_anything() -> None:
    for update in creep(3, (STEP_M, 0.0)):
        assert update.outcome == "updated"
        assert all(score.precision > 0.9 and score.recall > 0.9 for score in update.rooms)


def test_a_room_that_creeps_slantwise_is_noticed_too() -> None:
    """Anchor recall is (1 - 0.025 n) (1 - 0.035 n): less than 0.8 after the fourth."""
    updates = list(creep(4, (0.1, 0.14)))
    assert [update.taken for update in updates] == [True] * 4
    assert drifted(updates[-1]) == {began().slides}


def test_how_far_it_slid_is_told_and_grows() -> None:
    said = [conflicts_of(update, "drift") for update in creep(8, (STEP_M, 0.0))]
    slid = [int(found[0].summary.split(" cm")[0].split()[-1]) for found in said if found]
    assert slid == sorted(slid)
    assert slid[-1] == pytest.approx(160, abs=15)


def test_a_room_that_shrinks_bit_by_bit_is_asked_about_before_half_of_it_is_gone() -> None:
    """Its divider creeps through the hall; no wall says where it was."""
    semantic_map = apply_edits(began().map, [AddDivider(((6.6, 0.0), (6.6, 2.4)))]).map
    (divider,) = (d for d in semantic_map.dividers if d.made_by == "user")
    (shrinks,) = (room for room in semantic_map.rooms if shapely.contains_xy(room.polygon, 1.0, 1.2))
    gone = []
    for number in range(1, 6):
        still = track_all(semantic_map, Pose(), np.random.default_rng(number), 0.01)
        crept = {id_: points - ((0.6, 0.0) if id_ == divider.id else 0.0) for id_, points in still.dividers.items()}
        update = update_map(semantic_map, mission(str(number), semantic_map, Tracking(dividers=crept), home()))
        assert update.taken, update.reason
        semantic_map = update.map
        gone.append(conflicts_of(update, "shape"))
    assert gone[:4] == [[], [], [], []]
    ((conflict,),) = gone[4:]
    (score,) = conflict.rooms
    assert (score.id, conflict.cause, conflict.resolved) == (shrinks.id, "drift", False)
    assert score.recall == pytest.approx(3.6 / 6.6, abs=0.05)
    assert conflict.summary.startswith(f"{1 - score.recall:.0%} of {score.name} is gone, bit by bit,")


MOVES = [Pose(0.2, 0.1), Pose(0.0, 0.0, 0.05), Pose(-0.15, 0.1, -0.03)]


@pytest.mark.parametrize("step", MOVES, ids=["slides", "turns", "both"])
def test_a_frame_that_moves_as_a_whole_is_no_drift(step: Pose) -> None:
    semantic_map, pose = began().map, Pose()
    rng = np.random.default_rng(7)
    for number in range(1, 13):
        pose = step.after(pose)
        larger = OccupancyGrid(replace(FRAME, width=560, height=560, origin=Pose(-11.0, -10.0)), _blank(560))
        grid = _moved(home(), larger, pose)
        update = update_map(
            semantic_map, mission(str(number), semantic_map, track_all(semantic_map, step, rng, 0.02), grid)
        )
        assert update.taken, update.reason
        assert drifted(update) == set()
        semantic_map = update.map


def _blank(side: int) -> np.ndarray:
    return np.zeros((side, side), np.uint8)


def _moved(grid: OccupancyGrid, onto: OccupancyGrid, pose: Pose) -> OccupancyGrid:
    """A home as it lies in a frame that moved by `pose`."""
    frame = onto.frame
    columns, rows = np.meshgrid(np.arange(frame.width) + 0.5, np.arange(frame.height) + 0.5)
    places = pose.inverse().apply(frame.to_map(as_points(np.stack([columns.ravel(), rows.ravel()], 1))))
    cells = np.floor(grid.frame.to_cells(places)).astype(int)
    inside = ((cells >= 0) & (cells < (grid.frame.width, grid.frame.height))).all(1)
    values = np.zeros(len(cells), np.uint8)
    values[inside] = grid.cells[cells[inside, 1], cells[inside, 0]]
    return OccupancyGrid(frame, values.reshape(frame.height, frame.width))


def test_the_jitter_of_thirty_missions_is_no_drift() -> None:
    semantic_map, at = first_map(FOUR_ROOMS), Pose()
    rng = np.random.default_rng(11)
    for number in range(1, 31):
        pose = random_pose(rng, 0.05, 0.004)
        grid = sense(FOUR_ROOMS.grid, pose, rng, 0.1)
        tracking = track_all(semantic_map, pose.after(at.inverse()), rng, 0.05)
        update = update_map(semantic_map, mission(str(number), semantic_map, tracking, grid))
        assert drifted(update) == set(), f"mission {number}"
        if update.taken:
            semantic_map, at = update.map, pose


def test_a_rename_confirms_no_shape() -> None:
    """The anchor stays where it was, or else a room could be renamed while it is half off and nobody would hear of it."""
    *_, last = creep(2, (STEP_M, 0.0))
    renamed = apply_edits(last.map, [RenameRoom(began().slides, "Kitchen")]).map
    before, after = last.map.room(began().slides), renamed.room(began().slides)
    assert before is not None
    assert after is not None
    assert before.anchor is not None
    assert after.anchor is not None
    assert before.anchor.equals(after.anchor)


def test_an_anchor_keeps_its_shape_whatever_the_walls_do() -> None:
    base = first_map(FOUR_ROOMS)
    grid = paint(FOUR_ROOMS.grid, Cell.FREE, rectangle(3.0, 1.95, 3.8, 2.25))
    update = upload(base, grid, noise_m=0.03)
    assert update.taken
    for room in base.rooms:
        after = update.map.room(room.id)
        assert room.anchor is not None
        assert after is not None
        assert after.anchor is not None
        assert after.anchor.area == pytest.approx(room.anchor.area, rel=1e-6)
        assert len(after.anchor.exterior.coords) == len(room.anchor.exterior.coords)
