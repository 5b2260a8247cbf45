"""People draw on the map: by mouse, by touch, by keyboard and through the lists."""

import re
from collections.abc import Callable
from typing import Any

import httpx2
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.drawing import choose, rooms, save, start_editing
from tests.homes import home

Keep = Callable[[Page, str], None]
PHONE: dict[str, Any] = {"width": 360, "height": 740, "has_touch": True}


def stored(robot: Robot) -> dict[str, Any]:
    found: dict[str, Any] = httpx2.get(robot.path, headers={"Authorization": f"Bearer {robot.token}"}).json()
    return found


def features(document: dict[str, Any], semantic: str) -> list[dict[str, Any]]:
    return [f for f in document["features"] if f["properties"]["semantic"] == semantic]


def test_a_divider_drawn_by_two_taps_shows_the_rooms_to_be_and_is_saved(
    mapped: Robot, open_page: OpenPage, keep: Keep
) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.tap((1.5, -0.9))
    hand.hover((1.5, 2.9))
    expect(
        page.get_by_text(re.compile(r"Kitchen becomes 9\.\d m² and 6\.\d m²|Kitchen becomes 6\.\d m² and 9"))
    ).to_be_visible()
    keep(page, "editor-drawing-1440-light")
    hand.tap((1.5, 2.9))
    expect(rooms(page)).to_have_count(3)
    expect(page.get_by_text("1 change not saved yet")).to_be_visible()
    assert stored(mapped)["version"] == 2
    save(page, 3)
    document = stored(mapped)
    assert len(features(document, "room")) == 3
    (drawn,) = [f for f in features(document, "divider") if f["properties"]["made_by"] == "user"]
    assert sorted(round(y, 1) for _, y in drawn["geometry"]["coordinates"]) == [-1.0, 3.0]
    expect(page.get_by_text("The robot gets it with its next mission.")).to_be_visible()
    mapped.upload("1", home(), base_version=3, tracking={"transform": [0.0, 0.0, 0.0]})
    expect(page.get_by_text("On the robot since mission 1.")).to_be_visible()
