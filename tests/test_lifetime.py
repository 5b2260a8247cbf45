"""Shapes come from the new map's walls every time: no error accumulates from mission to mission."""

from dataclasses import dataclass

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import update_map
from tests.drawing import iou
from tests.golden.homes import FOUR_ROOMS
from tests.missions import mission, random_pose, sense, track_all

FIRST = create_map(FOUR_ROOMS.grid, "0", Ids())


@dataclass(frozen=True)
class Life:
    """The map after some missions, the pose of its frame, and the ids of the missions that were not taken."""

    map: SemanticMap
    pose: Pose
    lost: tuple[str, ...]


def live(missions: int, seed: int, noise_m: float, ragged: float) -> Life:
    """Missions in a frame that lies a few centimetres elsewhere each time, with ragged walls and noisy tracking."""
    rng = np.random.default_rng(seed)
    semantic_map, at, lost = FIRST, Pose(), []
    for number in range(1, missions + 1):
        pose = random_pose(rng, shift_m=0.04, turn=0.004)
        grid = sense(FOUR_ROOMS.grid, pose, rng, ragged)
        tracking = track_all(semantic_map, pose.after(at.inverse()), rng, noise_m)
        update = update_map(semantic_map, mission(str(number), semantic_map, tracking, grid))
        if update.taken:
            semantic_map, at = update.map, pose
            assert violations(semantic_map, grid, PARAMS.wall_reach_m) == ()
        else:
            lost.append(str(number))
    return Life(semantic_map, at, tuple(lost))


def assert_as_it_began(life: Life, most_m: float) -> None:
    assert [room.id for room in life.map.rooms] == [room.id for room in FIRST.rooms]
    assert [divider.id for divider in life.map.dividers] == [divider.id for divider in FIRST.dividers]
    for before, after in zip(FIRST.rooms, life.map.rooms, strict=True):
        truth = shapely.transform(before.polygon, life.pose.apply)
        assert iou(truth, after.polygon) >= 0.95, f"{after.id}: {iou(truth, after.polygon):.3f}"
        assert len(after.polygon.exterior.coords) <= 20
    for began, ended in zip(FIRST.dividers, life.map.dividers, strict=True):
        line = shapely.LineString(life.pose.apply(as_points(began.line)))
        off = shapely.hausdorff_distance(line, shapely.LineString(ended.line))
        assert off <= most_m, f"{ended.id}: {off:.2f} m"


def test_after_two_hundred_missions_a_map_has_the_rooms_it_began_with() -> None:
    life = live(200, seed=17, noise_m=0.04, ragged=0.1)
    assert len(life.lost) <= 2
    assert_as_it_began(life, most_m=0.15)


@settings(max_examples=8)
@given(st.integers(0, 2**32), st.floats(0.03, 0.05), st.floats(0, 0.15))
def test_no_error_adds_up_whatever_the_noise(seed: int, noise_m: float, ragged: float) -> None:
    # anywhere in a doorway 0.4 m deep, give or take two cells of ragged doorposts
    assert_as_it_began(live(25, seed, noise_m, ragged), most_m=0.3)
