"""The forms in which robots say how their map moved."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stillroom.documents.missions import TrackingDocument
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import GridFrame
from stillroom.maps.mission import tracked_motion
from stillroom.maps.semantics import Room, SemanticMap
from stillroom.simulator.building import home_of
from stillroom.simulator.distortion import Distortion, distortion_at
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.homes import Home, carried
from stillroom.simulator.tracking import Form, form_of, track_map

STREAMS = Streams(8)
BENT = replace(Effects.NONE, jitter_m=0.05, jitter_deg=0.5, drift_m=0.3, drift_deg=8.0)


@pytest.fixture(scope="module")
def home() -> Home:
    return home_of(STREAMS, Effects.NONE)


def tracked(home: Home, form: Form, effects: Effects = BENT) -> tuple[Distortion, Distortion, dict[str, Any]]:
    before, after = (distortion_at(home, mission, effects, STREAMS) for mission in (1, 4))
    features = [
        {
            "id": room.name,
            "geometry": {"coordinates": [before.apply(as_points(room.polygon.exterior.coords)).tolist()]},
            "properties": {"semantic": "room"},
        }
        for room in home.rooms
    ]
    noise, outliers = np.random.default_rng(1), np.random.default_rng(2)
    return before, after, track_map({"features": features}, before, after, form, effects, noise, outliers)


def errors(home: Home, form: Form, effects: Effects = BENT) -> np.ndarray:
    """How far off the rooms' corners are where the service takes the tracking to put them."""
    before, after, document = tracked(home, form, effects)
    rooms = tuple(
        Room(room.name, room.name, i, carried(room.polygon, before.apply)) for i, room in enumerate(home.rooms, 1)
    )
    base = SemanticMap(GridFrame(0.05, 10, 10), rooms)
    motion, warnings = tracked_motion(base, TrackingDocument.model_validate_json(json.dumps(document)).as_tracking())
    assert motion is not None
    assert not warnings
    corners = np.concatenate([as_points(room.polygon.exterior.coords)[:-1] for room in home.rooms])
    return np.asarray(np.linalg.norm(motion.apply(before.apply(corners)) - after.apply(corners), axis=1))


@pytest.mark.parametrize(("form", "within"), [("vertices", 0.001), ("submaps", 0.10), ("transform", 0.30)])
def test_each_form_tells_the_service_where_the_rooms_went(home: Home, form: Form, within: float) -> None:
    assert errors(home, form).max() < within


def test_a_frame_that_moves_as_a_whole_is_told_by_one_transform(home: Home) -> None:
    assert errors(home, "transform", replace(BENT, jitter_m=0.0, jitter_deg=0.0)).max() < 0.002


@pytest.mark.parametrize("form", ["vertices", "submaps", "transform"])
def test_every_form_has_noise(home: Home, form: Form) -> None:
    noisy = replace(BENT, tracking_noise_m=0.05)
    assert tracked(home, form)[2] != tracked(home, form, noisy)[2]


def test_sub_maps_are_poses_of_both_maps(home: Home) -> None:
    before, after, document = tracked(home, "submaps")
    assert len(document["submaps"]) == len(before.centres)
    for centre, poses in zip(before.centres, document["submaps"], strict=True):
        for distortion, key in ((before, "from"), (after, "to")):
            pose = Pose(*poses[key])
            ahead = distortion.apply(as_points(centre + np.array([0.01, 0.0])))[0]
            assert np.abs(distortion.apply(as_points(centre))[0] - (pose.x, pose.y)).max() < 1e-3
            assert np.abs(pose.apply(as_points((0.01, 0.0)))[0] - ahead).max() < 1e-3


def test_a_robots_model_has_one_form_and_robots_differ() -> None:
    mixed = replace(Effects.NONE, submap_tracking=0.3, transform_tracking=0.3)
    forms = [form_of(mixed, Streams(1, robot)) for robot in range(60)]
    assert forms == [form_of(mixed, Streams(1, robot)) for robot in range(60)]
    shares = [forms.count(form) / len(forms) for form in ("vertices", "submaps", "transform")]
    assert shares == pytest.approx([0.4, 0.3, 0.3], abs=0.17)
    assert form_of(Effects.NONE, STREAMS) == "vertices"
