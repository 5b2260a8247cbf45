"""The list of maps."""

import re

from playwright.sync_api import expect

from tests.e2e.conftest import OpenPage, Robot


def test_the_list_shows_a_robots_map_with_its_rooms_and_last_mission(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page("/")
    home = page.get_by_role("region", name=re.compile(rf"\b{mapped.id}$"))
    card = home.get_by_role("listitem")
    card.scroll_into_view_if_needed()  # of a long list, only what is looked at is loaded
    expect(card).to_contain_text(re.compile(r"2 rooms, 3[012]\.\d m²"))
    expect(card).to_contain_text("Map made just now")
    expect(card.get_by_role("img").locator("path")).not_to_have_count(0)
    card.get_by_role("link").click()
    expect(page).to_have_url(re.compile(re.escape(mapped.page)))
    expect(page.get_by_role("heading", level=1)).to_have_text("ground")


def test_a_robots_first_map_appears_by_itself(robot: Robot, open_page: OpenPage) -> None:
    page = open_page("/")
    home = page.get_by_role("region", name=re.compile(rf"\b{robot.id}$"))
    expect(home).to_contain_text("This robot has not uploaded a mission yet.")
    expect(page.get_by_text("Live", exact=True)).to_be_visible()
    robot.upload("0")
    expect(home.get_by_role("listitem")).to_contain_text("2 rooms")
