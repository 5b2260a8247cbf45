"""The map of a home, and its rooms as a list."""

import re

import numpy as np
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.looking import FIRST, SECOND, Colour, eventually, map_of, painted, picture, shown
from tests.homes import home


def drawn(page: Page) -> tuple[Colour, Colour]:
    """The colours of the kitchen, which is on the left, and of the bedroom, once both are there."""
    eventually(page, lambda: len(painted(page, FIRST)) > 10_000 and len(painted(page, SECOND)) > 10_000)
    is_first_left = painted(page, FIRST)[:, 0].mean() < painted(page, SECOND)[:, 0].mean()
    return (FIRST, SECOND) if is_first_left else (SECOND, FIRST)


def test_the_map_page_shows_rooms_by_name_and_area(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    expect(page.get_by_role("heading", level=1)).to_have_text("ground")
    expect(page.get_by_role("button", name=re.compile(r"Kitchen 1[56]\.\d m²"))).to_be_visible()
    expect(page.get_by_role("button", name=re.compile(r"Bedroom 1[56]\.\d m²"))).to_be_visible()
    kitchen, bedroom = (painted(page, colour) for colour in drawn(page))
    assert kitchen[:, 0].max() < bedroom[:, 0].max()


def test_the_picture_of_the_grid_lies_under_the_rooms_where_its_frame_says(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    rooms = np.concatenate([painted(page, colour) for colour in drawn(page)])
    page.get_by_role("button", name="Layers").click()
    for layer in ("Rooms", "Names", "Walls", "Dividers and doors"):
        page.get_by_role("checkbox", name=layer).uncheck()
    page.keyboard.press("Escape")
    expect(page.get_by_role("checkbox", name="Rooms")).to_be_hidden()
    eventually(page, lambda: len(painted(page, (255, 253, 248))) > 10_000)
    grid = painted(page, (255, 253, 248))
    # The buttons over the map are as light as the floor: only what lies between the rooms' edges is compared.
    low, high = rooms.min(axis=0), rooms.max(axis=0)
    inside = np.all((grid >= low) & (grid <= high), axis=1)
    assert inside.sum() > 0.97 * len(rooms)


def test_a_room_chosen_in_the_list_tells_of_its_neighbours_and_leads_to_them(
    mapped: Robot, open_page: OpenPage
) -> None:
    page = open_page(mapped.page)
    page.get_by_role("button", name=re.compile("^Kitchen")).click()
    expect(page.get_by_role("button", name=re.compile("^Kitchen"))).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_role("status").filter(has_text="Kitchen selected")).to_be_attached()
    page.get_by_role("list", name="Next to").get_by_role("button", name="Bedroom open").click()
    expect(page.get_by_role("button", name=re.compile(r"^Bedroom \d"))).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_role("button", name=re.compile(r"^Kitchen \d"))).to_have_attribute("aria-pressed", "false")


def test_a_room_tapped_on_the_map_is_chosen_in_the_list(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    _, bedroom = drawn(page)
    x, y = painted(page, bedroom)[1000]
    map_of(page).click(position={"x": float(x) + 3, "y": float(y) + 3})
    expect(page.get_by_role("button", name=re.compile(r"^Bedroom \d"))).to_have_attribute("aria-pressed", "true")


def test_the_keyboard_moves_and_zooms_the_map_and_shows_it_whole_again(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    left, right = drawn(page)
    whole, bedroom = painted(page, left), painted(page, right)
    map_of(page).focus()
    page.keyboard.press("ArrowRight")
    eventually(page, lambda: painted(page, right)[:, 0].max() < bedroom[:, 0].max() - 50)
    page.keyboard.press("-")
    eventually(page, lambda: len(painted(page, left)) < len(whole) / 2)
    page.get_by_role("button", name="Show the whole map").press("Enter")
    eventually(page, lambda: abs(len(painted(page, left)) - len(whole)) < 0.01 * len(whole))


def test_a_new_version_appears_by_itself(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    shown(page, 2)
    expect(page.get_by_text("Live", exact=True)).to_be_visible()
    mapped.upload("1", home(shift=(1, 1)), base_version=2, tracking={"transform": [0.05, 0.05, 0.0]})
    shown(page, 3)
    expect(page.get_by_text("Version 3 has just arrived").first).to_be_visible()
    expect(page.get_by_role("button", name=re.compile("^Kitchen"))).to_be_visible()


def test_dark_and_light_follow_the_system_until_one_is_chosen_for_good(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page, color_scheme="dark")
    shown(page, 2)
    eventually(page, lambda: picture(page).mean() < 100)
    page.get_by_role("button", name="Appearance: as the system").click()
    eventually(page, lambda: picture(page).mean() > 200)
    page.reload()
    shown(page, 2)
    eventually(page, lambda: picture(page).mean() > 200)


def test_what_is_not_there_is_said_in_words(open_page: OpenPage) -> None:
    page = open_page("/robots/nobody/maps/nowhere")
    expect(page.get_by_role("heading", name="Nothing here")).to_be_visible()
    page.get_by_role("link", name="Back to all maps").click()
    expect(page.get_by_role("heading", name="Homes")).to_be_visible()
