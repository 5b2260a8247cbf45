"""Where the places of a home are on the screen, and ways to point at them."""

from dataclasses import dataclass

from playwright.sync_api import Locator, Page, expect

from tests.e2e.looking import Colour, eventually, map_of, painted

# The first two colours of the light palette (web/src/map/colours.ts) as they lie over the floor.
KITCHEN: Colour = (212, 224, 184)
BEDROOM: Colour = (228, 179, 138)
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


def pen(page: Page) -> Pen:
    """Once the home is drawn whole and untouched."""
    eventually(page, lambda: len(painted(page, KITCHEN)) > 1000 and len(painted(page, BEDROOM)) > 1000)
    box = map_of(page).bounding_box()
    assert box is not None
    kitchen, bedroom = painted(page, KITCHEN), painted(page, BEDROOM)
    left, right = float(kitchen[:, 0].min()), float(bedroom[:, 0].max())
    top = float(min(kitchen[:, 1].min(), bedroom[:, 1].min()))
    scale = (right - left) / (EAST - WEST)
    return Pen(page, box["x"] + left, box["y"] + top + (NORTH - SOUTH) * scale, scale)


def start_editing(page: Page) -> Pen:
    page.get_by_role("button", name="Edit").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Editing ground")
    return pen(page)


def choose(page: Page, tool: str) -> None:
    page.get_by_role("toolbar").get_by_role("button", name=tool).click()


def rooms(page: Page) -> Locator:
    return page.get_by_role("region", name="Rooms").get_by_role("listitem")


def save(page: Page, version: int) -> None:
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text(f"Saved as version {version}.")).to_be_visible()
