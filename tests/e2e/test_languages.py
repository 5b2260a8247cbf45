"""Every page in another language."""

import re
from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.looking import eventually


def test_the_pages_speak_german_to_those_who_do_until_they_choose_otherwise(
    mapped: Robot, open_page: OpenPage, keep: Callable[[Page, str], None]
) -> None:
    page = open_page("/", locale="de-DE")
    expect(page.get_by_role("heading", level=1)).to_have_text("Wohnungen")
    expect(page.locator("html")).to_have_attribute("lang", "de")
    page.goto(mapped.page)
    expect(page.get_by_role("button", name=re.compile(r"Kitchen 15,\d m²"))).to_be_visible()
    page.get_by_role("button", name="Bearbeiten").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("ground bearbeiten")
    expect(page.get_by_text("Alles ist gespeichert.")).to_be_visible()
    keep(page, "editor-german-1440-light")
    page.get_by_role("button", name="DE: Deutsch. Zu Englisch wechseln.").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Editing ground")
    page.reload()
    eventually(page, lambda: page.locator("html").get_attribute("lang") == "en")
