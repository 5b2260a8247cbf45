"""The history of a map."""

import re

import pytest
from playwright.sync_api import Page, expect

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
