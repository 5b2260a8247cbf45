"""Every page for everybody: axe's rules, small screens, large enough targets."""

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.asking import OPEN_PLAN, question, send, settings
from tests.e2e.conftest import ROOT, OpenPage, Robot
from tests.e2e.looking import shown
from tests.homes import home

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
QUESTIONS = ("questions", "question", "drawing", "answered")
PAGES = ("list", "rooms", "history", "old version", "editor", "signed out", "nothing", "settings", *QUESTIONS)
Keep = Callable[[Page, str], None]


def asked(name: str, robot: Robot, open_page: OpenPage, **options: object) -> Page:
    """The pages of a question that waits."""
    settings(robot, review="ask_first")
    send(robot, "2", OPEN_PLAN)
    page = open_page("/questions" if name == "questions" else question(robot), **options)
    if name == "questions":
        expect(page.get_by_role("listitem").first).to_be_visible()
        return page
    expect(page.get_by_role("button", name="Take the new map")).to_be_visible()
    if name == "question":
        page.get_by_role("button", name="Robot's view").click()
        page.get_by_role("button", name="Layers").click()
    if name == "drawing":
        page.get_by_role("button", name="Draw the boundary myself").click()
        page.get_by_role("button", name="Divide here").click()
        expect(page.get_by_text("With this: ")).to_be_visible()
    if name == "answered":
        page.get_by_role("button", name="Take the new map").click()
        expect(page.get_by_role("button", name="Undo this")).to_be_visible()
    return page


@pytest.fixture
def visit(mapped: Robot, open_page: OpenPage) -> Callable[..., Page]:
    """Opens each of the app's pages in a state with much to see."""
    mapped.upload("1", home(shift=(1, 0)), base_version=2, tracking={"transform": [0.05, 0.0, 0.0]})

    def visited(name: str, **options: object) -> Page:
        if name == "list":
            page = open_page("/", **options)
            home = page.get_by_role("region", name=re.compile(rf"\b{mapped.id}$"))
            home.scroll_into_view_if_needed()
            expect(home).to_contain_text("Map updated")
        elif name == "signed out":
            page = open_page("/", **options | {"storage_state": None})
            expect(page.get_by_role("heading", name="Come on in")).to_be_visible()
        elif name == "nothing":
            page = open_page("/nothing/here", **options)
            expect(page.get_by_role("heading", name="Nothing here")).to_be_visible()
        elif name == "settings":
            page = open_page("/settings", **options)
            expect(page.get_by_role("button", name="Add a webhook")).to_be_visible()
        elif name in QUESTIONS:
            page = asked(name, mapped, open_page, **options)
        elif name == "editor":
            page = open_page(f"{mapped.page}?edit", **options)
            page.get_by_role("button", name=re.compile("^Kitchen 1")).click()
            page.get_by_role("button", name="Divide here").click()
            expect(page.get_by_text("1 change not saved yet")).to_be_visible()
            page.get_by_role("region", name="Dividers").get_by_role("button").first.click()
            expect(page.get_by_role("button", name="Turn left")).to_be_visible()
        else:
            page = open_page(mapped.page + ("?version=1" if name == "old version" else ""), **options)
            shown(page, 1 if name == "old version" else 3)
            expect(page.get_by_text("of 3")).to_be_visible()
            if name == "history":
                page.get_by_role("tab", name="History").click()
                expect(page.get_by_text("in force")).to_be_visible()
            if name == "rooms":
                page.get_by_role("button", name="Kitchen").click()
                page.get_by_role("button", name="Layers").click()
        return page

    return visited


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing(name: str, visit: Callable[..., Page], keep: Keep) -> None:
    page = visit(name)
    page.evaluate(AXE.read_text())
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
        expect(page.locator(f"html[data-mantine-color-scheme={scheme}]")).to_be_attached()
        found = page.evaluate("axe.run()")
        keep(page, f"{name}-1440-{scheme}")
        assert [(rule["id"], [node["html"] for node in rule["nodes"]]) for rule in found["violations"]] == []


@pytest.mark.parametrize("name", PAGES)
def test_at_360_pixels_nothing_scrolls_sideways_and_fingers_find_their_targets(
    name: str, visit: Callable[..., Page], keep: Keep
) -> None:
    page = visit(name, width=360, height=740, has_touch=True)
    keep(page, f"{name}-360-light")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    small = page.evaluate("""[...document.querySelectorAll('button, a, input, [role=tab]')]
        .map((target) => [(target.closest('label') ?? target).getBoundingClientRect(), target.outerHTML])
        .filter(([box]) => box.width > 1 && (box.width < 24 || box.height < 24))
        .map(([, html]) => html)""")
    assert small == []
