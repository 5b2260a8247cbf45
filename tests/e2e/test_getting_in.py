"""Signing in, and connections that come and go."""

from pathlib import Path

from playwright.sync_api import expect

from tests.e2e.asking import OPEN_PLAN, question, send, settings
from tests.e2e.conftest import OpenPage, Robot, Running, running
from tests.e2e.looking import shown


def test_who_is_signed_out_is_told_how_to_get_in(open_page: OpenPage) -> None:
    page = open_page("/robots/RB-1/maps/ground", storage_state=None)
    expect(page.get_by_role("heading", level=1)).to_have_text("Come on in")
    expect(page.get_by_text("stillroom login-link")).to_be_visible()


def test_a_link_signs_one_browser_in_once(served: Running, open_page: OpenPage) -> None:
    link = served.login_link()
    page = open_page(link, storage_state=None)
    expect(page.get_by_role("link", name="Your account")).to_be_visible()
    another = open_page(link, storage_state=None)
    another.goto("/")
    expect(another.get_by_role("heading", name="Come on in")).to_be_visible()


def test_a_link_in_a_message_is_where_somebody_comes_back_to_after_signing_in(
    served: Running, mapped: Robot, open_page: OpenPage
) -> None:
    settings(mapped, review="ask_first")
    send(mapped, "1", OPEN_PLAN)
    page = open_page(f"{question(mapped)}?answer=accept:p2", storage_state=None)
    expect(page.get_by_text("it leads back to this page")).to_be_visible()
    page.goto(served.login_link())
    expect(page.get_by_text("Picked in your message")).to_be_visible()
    expect(page.get_by_role("button", name="Take the new map")).to_be_focused()


def test_a_page_that_stays_open_survives_a_restart_of_the_service(tmp_path: Path, open_page: OpenPage) -> None:
    service = running(tmp_path)
    service.start()
    try:
        robot = service.add_robot("RB-1", "Robin")
        robot.upload("0")
        page = open_page(service.link, storage_state=None, base_url=service.url)
        page.get_by_role("link", name="ground").click()
        shown(page, 1)
        expect(page.get_by_text("Live", exact=True)).to_be_visible()
        service.stop()
        expect(page.get_by_text("Reconnecting", exact=True)).to_be_visible()
        service.start()
        robot.upload("1")
        shown(page, 2)
        expect(page.get_by_text("Live", exact=True)).to_be_visible()
    finally:
        service.stop()


def test_signing_out_ends_the_session(served: Running, open_page: OpenPage) -> None:
    page = open_page(served.login_link(), storage_state=None)
    page.get_by_role("link", name="Your account").click()
    page.get_by_role("button", name="Sign out", exact=True).click()
    expect(page.get_by_role("heading", name="Come on in")).to_be_visible()
    page.goto("/")
    expect(page.get_by_role("heading", name="Come on in")).to_be_visible()
