"""A mission from another floor waits on the map page until a person says where it belongs."""

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from stillroom.documents.images import as_grey
from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.looking import shown
from tests.pipeline.test_registration import HOME, MIRRORED

FRAME = {"resolution": 0.05, "origin": [HOME.grid.frame.origin.x, HOME.grid.frame.origin.y, 0.0]}


@pytest.fixture
def visited_upstairs(robot: Robot) -> Robot:
    """A robot that knows its ground floor and was then carried upstairs."""
    assert robot.upload("0", as_grey(HOME.grid.cells), **FRAME)["outcome"] == "created"
    assert robot.upload("1", as_grey(MIRRORED.grid.cells), **FRAME)["outcome"] == "parked"
    return robot


def question(page: Page) -> "Callable[[str], None]":
    region = page.get_by_role("region", name="New floor, or an existing one?")

    def asks(words: str) -> None:
        expect(region).to_contain_text(re.compile(words))

    return asks


def test_a_mission_that_was_set_aside_becomes_a_new_floor_with_a_name(
    visited_upstairs: Robot, open_page: OpenPage, keep: Callable[[Page, str], None]
) -> None:
    page = open_page(visited_upstairs.page)
    question(page)(r"Mission 1 does not look like this floor.*ground\d+ % of its walls fit")
    keep(page, "parked-1440-light")
    page.get_by_role("button", name="A new floor").click()
    page.get_by_role("textbox", name="Name of the new floor").fill("Étage")
    page.get_by_role("button", name="Make the new floor").click()
    page.get_by_role("link", name="Open Étage").click()
    expect(page).to_have_url(re.compile("/maps/etage$"))
    expect(page.get_by_role("heading", level=1)).to_have_text("Étage")
    page.goto(visited_upstairs.page)
    shown(page, 1)
    expect(page.get_by_role("region", name="New floor, or an existing one?")).to_have_count(0)


def test_a_mission_that_was_set_aside_is_put_on_the_floor_that_was_chosen(
    visited_upstairs: Robot, open_page: OpenPage, keep: Callable[[Page, str], None]
) -> None:
    page = open_page(visited_upstairs.page, width=360, height=740, has_touch=True)
    question(page)("Mission 1 does not look like this floor")
    keep(page, "parked-360-light")
    page.get_by_role("button", name=re.compile("^ground ")).click()
    expect(page.get_by_role("status").filter(has_text="It is now on ground.")).to_be_visible()
    shown(page, 2)
    expect(page.get_by_role("region", name="New floor, or an existing one?")).to_have_count(0)
