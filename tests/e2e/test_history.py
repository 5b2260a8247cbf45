"""The history of a map."""

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.looking import shown
from tests.homes import home


@pytest.fixture
def stepped(mapped: Robot) -> Robot:
    """Three versions: made by a mission, edited, updated by a mission."""
    mapped.upload("1", home(shift=(1, 0)), base_version=2, tracking={"transform": [0.05, 0.0, 0.0]})
    return mapped


def entries(page: Page) -> list[str]:
    return page.get_by_role("tabpanel").get_by_role("listitem").all_inner_texts()


def test_versions_can_be_stepped_through_and_left_again(stepped: Robot, open_page: OpenPage) -> None:
    page = open_page(stepped.page)
    shown(page, 3)
    expect(page.get_by_text("Version 3 of 3")).to_be_visible()
    page.get_by_role("button", name="Previous version").click()
    shown(page, 2)
    page.get_by_role("button", name="Previous version").click()
    shown(page, 1)
    expect(page.get_by_role("button", name=re.compile("^Kitchen"))).to_have_count(0)
    page.get_by_role("button", name="Next version").click()
    shown(page, 2)
    expect(page).to_have_url(re.compile("version=2$"))
    page.reload()
    shown(page, 2)
    page.get_by_role("button", name="Back to the newest").click()
    shown(page, 3)
    expect(page).not_to_have_url(re.compile("version="))
    expect(page.get_by_role("button", name="Back to the newest")).to_have_count(0)


def test_the_slider_steps_by_keyboard(stepped: Robot, open_page: OpenPage) -> None:
    page = open_page(stepped.page)
    slider = page.get_by_role("slider", name="Version shown")
    slider.press("ArrowLeft")
    shown(page, 2)
    slider.press("Home")
    shown(page, 1)
    slider.press("End")
    shown(page, 3)


def test_the_list_says_what_made_each_version_and_who(stepped: Robot, open_page: OpenPage) -> None:
    page = open_page(stepped.page)
    page.get_by_role("tab", name="History").click()
    expect(page.get_by_role("tabpanel").get_by_role("listitem")).to_have_count(3)
    newest, edited, first = entries(page)
    for text, words in (
        (newest, ("Version 3", "in force", "Map updated", "by the robot, mission 1", "just now")),
        (edited, ("Version 2", "Edited", "by an operator")),
        (first, ("Version 1", "Map made", "by the robot, mission 0")),
    ):
        assert [word for word in words if word not in text] == [], text
    assert "mission" not in edited
    page.get_by_role("button", name=re.compile("^Version 1 ")).click()
    shown(page, 1)


def test_a_mission_that_changed_nothing_is_told_with_its_reason(stepped: Robot, open_page: OpenPage) -> None:
    page = open_page(stepped.page)
    page.get_by_role("tab", name="History").click()
    expect(page.get_by_role("tabpanel").get_by_role("listitem")).to_have_count(3)
    late = stepped.upload("late", home(), sequence=0)
    assert late["outcome"] == "superseded"
    told = page.get_by_role("tabpanel").get_by_role("listitem").first
    expect(told).to_contain_text("Arrived late; map unchanged")
    expect(told).to_contain_text(late["reason"])
    shown(page, 3)


def test_an_old_version_stays_in_view_when_a_new_one_arrives(stepped: Robot, open_page: OpenPage) -> None:
    page = open_page(f"{stepped.page}?version=1")
    shown(page, 1)
    expect(page.get_by_text("Version 1 of 3")).to_be_visible()
    expect(page.get_by_text("Live", exact=True)).to_be_visible()
    stepped.upload("2", home(), base_version=3, tracking={"transform": [-0.05, 0.0, 0.0]})
    expect(page.get_by_text("Version 1 of 4")).to_be_visible()
    shown(page, 1)


def opened(page: Page, version: int) -> Locator:
    """An entry of the list, unfolded."""
    page.get_by_role("tab", name="History").click()
    page.get_by_role("button", name=re.compile(f"^Version {version} ")).click()
    return page.locator("li[data-shown=true]")


def test_two_versions_are_laid_over_each_other_and_compared_in_words(
    stepped: Robot, open_page: OpenPage, keep: Callable[[Page, str], None]
) -> None:
    stepped.edit(3, {"op": "rename_room", "id": "r1", "name": "Pantry"})
    page = open_page(f"{stepped.page}?version=2")
    opened(page, 2)
    page.get_by_role("button", name="Compare with now").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Version 2 and 4")
    expect(page.get_by_role("region", name="What changed").get_by_role("listitem")).to_have_text(
        [re.compile("is called Pantry now")]
    )
    keep(page, "compare-1440-light")
    slider = page.get_by_role("slider", name="How much of which version is shown")
    slider.press("Home")
    page.get_by_role("button", name="Swap").click()
    expect(slider).to_have_value("100")
    page.set_viewport_size({"width": 360, "height": 740})
    keep(page, "compare-360-light")
    page.get_by_role("button", name="Back to the map").click()
    shown(page, 4)


def test_an_old_version_is_brought_back(stepped: Robot, open_page: OpenPage) -> None:
    page = open_page(f"{stepped.page}?version=1")
    shown(page, 1)
    entry = opened(page, 1)
    entry.get_by_role("button", name="Restore this version").click()
    shown(page, 4)
    expect(page.get_by_text("An earlier version was restored").first).to_be_visible()


def test_a_version_is_named_and_pinned(stepped: Robot, open_page: OpenPage, keep: Callable[[Page, str], None]) -> None:
    page = open_page(stepped.page)
    page.get_by_role("tab", name="History").click()
    entry = page.locator("li[data-shown=true]")
    entry.get_by_label("Name of this version").fill("As it should be")
    entry.get_by_role("button", name="Set name").click()
    expect(page.get_by_role("button", name=re.compile("^Version 3 .*As it should be"))).to_be_visible()
    entry.get_by_role("button", name="Pin this version").click()
    expect(entry.get_by_text("pinned", exact=True)).to_be_visible()
    keep(page, "history-pinned-1440-light")
    entry.get_by_role("button", name="Unpin").click()
    expect(entry.get_by_text("pinned", exact=True)).to_have_count(0)
