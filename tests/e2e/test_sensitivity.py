"""People say how finely the rooms of a new map are parted, and see it before it is so."""

from collections.abc import Callable

import numpy as np
from playwright.sync_api import Page, expect

from tests.e2e.asking import causes, read
from tests.e2e.asking import rooms as room_names
from tests.e2e.conftest import ROOT, OpenPage, Robot
from tests.e2e.drawing import rooms
from tests.e2e.looking import FIRST, SECOND, eventually, map_of, painted, shown
from tests.homes import OCCUPIED, Image, home

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
TITLE = "More or fewer rooms"
Keep = Callable[[Page, str], None]


def wide_passage() -> Image:
    """Two rooms that might as well be one: 2.8 m of the 4 m between them are open."""
    image = home(wall_between=False)
    image[20:32, 99:101] = image[88:100, 99:101] = OCCUPIED
    return np.asarray(image)


def test_fewer_rooms_are_seen_before_they_are_taken_and_can_be_undone(
    robot: Robot, open_page: OpenPage, keep: Keep
) -> None:
    robot.upload("0", wide_passage())
    before = read(robot)
    page = open_page(f"{robot.page}?edit")
    panel = page.get_by_role("region", name=TITLE)
    slider = panel.get_by_role("slider", name="Number of rooms")
    expect(panel.get_by_role("status")).to_have_text("2 rooms now.")
    expect(slider).to_have_attribute("aria-valuetext", "as they are now")
    eventually(page, lambda: len(painted(page, SECOND)) > 1000)

    slider.press("ArrowLeft")
    expect(slider).to_have_attribute("aria-valuetext", "slightly fewer")
    expect(panel.get_by_role("status")).to_have_text("Nothing would change: 2 rooms.")
    expect(panel.get_by_role("button", name="Take these rooms")).to_be_disabled()
    slider.press("Home")
    expect(slider).to_have_attribute("aria-valuetext", "as few as possible")
    expect(panel.get_by_role("status")).to_have_text("1 room instead of 2.")
    eventually(page, lambda: len(painted(page, FIRST)) > 1000 and len(painted(page, SECOND)) == 0)
    expect(rooms(page)).to_have_count(0)
    assert read(robot) == before
    page.evaluate(AXE.read_text())
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
        expect(page.locator(f"html[data-mantine-color-scheme={scheme}]")).to_be_attached()
        found = page.evaluate("axe.run()")
        keep(page, f"sensitivity-1440-{scheme}")
        assert [(rule["id"], [node["html"] for node in rule["nodes"]]) for rule in found["violations"]] == []

    panel.get_by_role("button", name="Leave as it was").click()
    expect(panel.get_by_role("status")).to_have_text("2 rooms now.")
    expect(slider).to_be_focused()
    expect(rooms(page)).to_have_count(2)
    assert read(robot) == before

    slider.press("Home")
    panel.get_by_role("button", name="Take these rooms").click()
    expect(page.get_by_text("Saved as version 2.")).to_be_visible()
    expect(rooms(page)).to_have_count(1)
    expect(panel.get_by_role("status")).to_have_text("1 room now.")
    expect(slider).to_have_value("-3")
    assert (causes(robot), len(room_names(robot))) == (["edit", "created"], 1)

    page.get_by_role("button", name="Undo").click()
    shown(page, 3)
    expect(rooms(page)).to_have_count(2)
    expect(slider).to_have_value("0")
    assert room_names(robot) == {"Room 1", "Room 2"}


def test_at_360_pixels_the_map_stays_in_sight_while_the_slider_moves_and_lost_names_are_told(
    mapped: Robot, open_page: OpenPage, keep: Keep
) -> None:
    """An edited map: the slider is there for whoever looks for it."""
    mapped.upload("1", wide_passage(), base_version=2, tracking={"transform": [0.0, 0.0, 0.0]})
    page = open_page(f"{mapped.page}?edit", width=360, height=740, has_touch=True)
    panel = page.get_by_role("region", name=TITLE)
    expect(panel.get_by_role("slider")).to_have_count(0)
    panel.get_by_role("button", name=TITLE).click()
    panel.get_by_role("slider").press("Home")
    expect(panel.get_by_role("status")).to_contain_text("1 room instead of 2.")
    expect(panel.get_by_role("status")).to_contain_text("These go: ")
    expect(panel.get_by_role("slider")).to_be_in_viewport()
    expect(map_of(page)).to_be_in_viewport(ratio=1)
    expect(page.get_by_text("1 room instead of 2. Nothing has changed yet.")).to_be_in_viewport(ratio=1)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    keep(page, "sensitivity-360-light")
