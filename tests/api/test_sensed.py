"""What the robot saw when a question came up."""

from dataclasses import replace

import numpy as np
import pytest

from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.update import MapUpdate
from tests.conflicts import Core, expect, rejected, send
from tests.conftest import RobotCaller, Service
from tests.homes import home, pixels


def test_it_is_told_where_the_robot_saw_something_else_and_in_which_frame(
    mapped: RobotCaller, service: Service, core: Core
) -> None:
    core.planned["1"] = rejected("c1")
    image = home(wall_between=False, shift=(2, 0))
    send(mapped, "1", image, base_version=1, tracking={"transform": [0.1, 0.0, 0.0]})
    found = expect(service.operator.get(f"{mapped.path()}/conflicts/c1/sensed"))
    assert (found["mission"], found["base_version"], found["version"], found["taken"]) == ("1", 1, 1, False)
    assert found["moved"] == found["moved_now"] == pytest.approx([0.1, 0.0, 0.0], abs=0.01)
    assert (found["frame"]["width"], found["frame"]["origin"]) == (200, [-1.0, -2.0, 0.0])
    assert np.array_equal(pixels(mapped.get(found["grid"]).content), image)
    assert mapped.get(found["cells"]).status_code == 200
    assert [place["change"] for place in found["differences"]] == ["opened", "opened"]
    for place in found["differences"]:
        xs = [x for x, _ in place["geometry"]["coordinates"][0]]
        assert (min(xs), max(xs)) == pytest.approx((4.05, 4.15), abs=0.06)


def test_after_the_mission_was_taken_its_frame_is_the_one_in_force(mapped: RobotCaller, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    send(mapped, "1", base_version=1, tracking={"transform": [0.05, 0.0, 0.0]})
    send(mapped, "2", home(shift=(4, 0)), base_version=1, tracking={"transform": [0.2, 0.0, 0.0]})
    found = expect(mapped.get(f"{mapped.path()}/conflicts/c1/sensed"))
    assert (found["base_version"], found["version"], found["differences"]) == (1, 2, [])
    assert found["moved"] == pytest.approx([0.05, 0.0, 0.0], abs=0.01)
    assert found["moved_now"] == pytest.approx([-0.15, 0.0, 0.0], abs=0.01)


def test_where_no_motion_is_known_nothing_is_compared(mapped: RobotCaller, core: Core) -> None:
    def lost(previous: SemanticMap, mission: Mission, update: MapUpdate) -> MapUpdate:
        return replace(rejected("c1", kind="wrong_map", rooms=())(previous, mission, update), motion=None)

    core.planned["1"] = lost
    send(mapped, "1")
    found = expect(mapped.get(f"{mapped.path()}/conflicts/c1/sensed"))
    assert (found["moved"], found["moved_now"], found["differences"]) == (None, None, [])


def test_another_s_is_not_shown(mapped: RobotCaller, service: Service, core: Core) -> None:
    core.planned["1"] = rejected("c1")
    send(mapped, "1")
    stranger = service.add_robot("RB-2", owner="ann@example.org")
    assert stranger.get(f"{mapped.path()}/conflicts/c1/sensed").status_code == 403
    assert mapped.get(f"{mapped.path()}/conflicts/c2/sensed").status_code == 404


def test_where_a_room_that_drifted_was_when_somebody_last_confirmed_it_is_told(
    mapped: RobotCaller, service: Service, core: Core
) -> None:
    before = service.operator.get(mapped.path()).json()
    outlines = {f["id"]: f["geometry"]["coordinates"][0] for f in before["features"]}

    def slid(previous: SemanticMap, mission: Mission, update: MapUpdate) -> MapUpdate:
        """Taken all the same, and asked about."""
        (asked,) = rejected("c1", kind="drift", rooms=("r1",))(previous, mission, update).conflicts
        return replace(update, conflicts=(asked,))

    core.planned["1"] = slid
    send(mapped, "1", home(shift=(2, 0)), base_version=1, tracking={"transform": [0.1, 0.0, 0.0]})
    found = expect(mapped.get(f"{mapped.path()}/conflicts/c1/sensed"))
    (place,) = found["confirmed"]
    assert place["room"] == "r1"
    assert place["geometry"]["coordinates"][0] == pytest.approx(np.add(outlines["r1"], (0.1, 0.0)), abs=0.02)
    core.planned["2"] = rejected("c2")
    send(mapped, "2")
    assert expect(mapped.get(f"{mapped.path()}/conflicts/c2/sensed"))["confirmed"] == []
