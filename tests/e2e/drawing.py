"""Where the places of a home are on the screen, and ways to point at them."""

from dataclasses import dataclass

import numpy as np
from playwright.sync_api import Locator, Page, expect

from tests.e2e.looking import FIRST, SECOND, Colour, eventually, map_of, painted

Place = tuple[float, float]
WEST, EAST, SOUTH, NORTH = 0.0, 8.0, -1.0, 3.0
"""Of both rooms together, in metres: see tests.homes.home."""


@dataclass(frozen=True)
class Pen:
    """Metres of the map as pixels of the page."""

    page: Page
    left: float
    bottom: float
    scale: float

    def at(self, place: Place) -> Place:
        return self.left + (place[0] - WEST) * self.scale, self.bottom - (place[1] - SOUTH) * self.scale

    def tap(self, *places: Place) -> None:
        for place in places:
            x, y = self.at(place)
            self.page.mouse.click(x, y)

    def touch(self, *places: Place) -> None:
        for place in places:
            x, y = self.at(place)
            self.page.touchscreen.tap(x, y)

    def drag(self, start: Place, end: Place) -> None:
        self.page.mouse.move(*self.at(start))
        self.page.mouse.down()
        for share in (0.2, 0.5, 0.8, 1.0):
            between = (start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share)
            self.page.mouse.move(*self.at(between))
        self.page.mouse.up()

    def hover(self, place: Place) -> None:
        self.page.mouse.move(*self.at(place))


def pen(page: Page, colours: tuple[Colour, ...] = (FIRST, SECOND)) -> Pen:
    """Once the home is drawn whole and untouched. `colours`: of the rooms that it has."""
    eventually(page, lambda: all(len(painted(page, colour)) > 1000 for colour in colours))
    box = map_of(page).bounding_box()
    assert box is not None
    home = np.concatenate([painted(page, colour) for colour in colours])
    left, right, top = float(home[:, 0].min()), float(home[:, 0].max()), float(home[:, 1].min())
    scale = (right - left) / (EAST - WEST)
    return Pen(page, box["x"] + left, box["y"] + top + (NORTH - SOUTH) * scale, scale)


def start_editing(page: Page) -> Pen:
    page.get_by_role("button", name="Edit").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Editing ground")
    return pen(page)


def choose(page: Page, tool: str) -> None:
    button = page.get_by_role("toolbar").get_by_role("button", name=tool)
    button.click()
    expect(button).to_have_attribute("aria-pressed", "true")


def rooms(page: Page) -> Locator:
    return page.get_by_role("region", name="Rooms").get_by_role("listitem")


def save(page: Page, version: int) -> None:
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text(f"Saved as version {version}.")).to_be_visible()
