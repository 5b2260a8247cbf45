"""What a person sees on the map."""

from collections.abc import Callable

import cv2
import numpy as np
import numpy.typing as npt
from playwright.sync_api import Locator, Page, expect

PATIENCE_MS, GLANCE_MS = 60_000, 50
Colour = tuple[int, int, int]
FIRST: Colour = (212, 224, 184)
SECOND: Colour = (228, 179, 138)
"""The first two colours of the light palette (web/src/map/colours.ts) as they lie over the floor: of the rooms 1 and 2."""


def map_of(page: Page) -> Locator:
    return page.get_by_role("img", name="Map of ground")


def shown(page: Page, version: int) -> None:
    expect(map_of(page)).to_have_attribute("data-version", str(version))


def picture(page: Page) -> npt.NDArray[np.uint8]:
    """The map as it looks now, what lies over it included: (height, width, RGB)."""
    decoded = cv2.imdecode(np.frombuffer(map_of(page).screenshot(), np.uint8), cv2.IMREAD_COLOR_RGB)
    assert decoded is not None
    return np.asarray(decoded, np.uint8)


def painted(page: Page, colour: Colour) -> npt.NDArray[np.intp]:
    """Where the map has a colour: (n, 2) of x, y."""
    near = np.abs(picture(page).astype(np.int16) - colour).max(axis=2) < 4
    return np.argwhere(near)[:, ::-1]


def eventually(page: Page, holds: Callable[[], bool]) -> None:
    """The map is drawn by frames, of which a page tells nothing: looks until `holds`."""
    for _ in range(PATIENCE_MS // GLANCE_MS):
        if holds():
            return
        page.wait_for_timeout(GLANCE_MS)
    raise AssertionError("what was looked for did not appear")
