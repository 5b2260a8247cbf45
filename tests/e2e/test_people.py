"""People: invited, signed in by password, at home; robots that change hands."""

import re
from datetime import UTC, datetime

from playwright.sync_api import Page, expect

from stillroom.service.accounts import new_login_link
from stillroom.store import people
from stillroom.store.database import Database
from tests.e2e import calling
from tests.e2e.conftest import ADMIN_TOKEN, OpenPage, Robot, Running
from tests.e2e.looking import shown
from tests.e2e.test_accessibility import AXE

PASSWORD = "a few words in a row"
SIZES = ({"width": 360, "height": 740, "color_scheme": "dark"}, {"width": 1440, "color_scheme": "light"})


def invited(page: Page, email: str, duty: str = "No duty") -> str:
    """The link that an operator hands over where no e-mail is sent."""
    page.get_by_role("textbox", name="E-mail address", exact=True).fill(email)
    page.get_by_label("With the duty").select_option(duty)
    page.get_by_role("button", name="Make an invitation").click()
    expect(page.get_by_role("listitem").filter(has_text=email)).to_be_visible()
    return page.get_by_text("/invitation#").inner_text()


def accept(page: Page) -> None:
    """By keyboard alone."""
    page.get_by_label("Password").focus()
    page.keyboard.type(PASSWORD)
    page.keyboard.press("Enter")
    expect(page.get_by_role("link", name="Your account")).to_be_visible()


def complaints(page: Page) -> list[str]:
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text())
    found: list[str] = page.evaluate("async () => (await axe.run()).violations.map((v) => v.id)")
    if page.evaluate("document.documentElement.scrollWidth > innerWidth"):
        found.append("wider than the window")
    return found


def test_somebody_is_invited_comes_in_by_password_and_gives_a_robot_up(open_page: OpenPage) -> None:
    email = "zoe@example.org"
    operator = open_page("/operator")
    link = invited(operator, email)
    operator.get_by_label("Id", exact=True).fill("RB-of-Zoe")
    operator.get_by_role("button", name="Register a robot").click()
    code = operator.get_by_text("claim code for its owner").locator("code").inner_text()

    zoe = open_page(link, storage_state=None)
    expect(zoe.get_by_role("heading", level=1)).to_have_text(f"You are invited, {email}")
    accept(zoe)
    zoe.get_by_role("link", name="Your account").click()
    zoe.get_by_role("button", name="Sign out", exact=True).click()
    expect(zoe.get_by_role("heading", name="Come on in")).to_be_visible()

    # what a link was for is over; the password is not
    zoe.goto(link)
    expect(zoe.get_by_role("heading", level=1)).to_have_text("This link was used already or has expired")
    zoe.goto("/home")
    zoe.get_by_label("E-mail address").fill(email)
    zoe.get_by_label("Password").fill("not that one at all")
    zoe.keyboard.press("Enter")
    expect(zoe.get_by_role("alert")).to_have_text("The e-mail address or the password is not right.")
    zoe.get_by_label("Password").fill(PASSWORD)
    zoe.keyboard.press("Enter")
    expect(zoe.get_by_role("heading", level=1)).to_have_text("Your home")  # where she wanted to go

    zoe.get_by_label("Claim code").fill(code.lower())
    zoe.get_by_role("button", name="Make it mine").click()
    expect(zoe.get_by_text("RB-of-Zoe is yours.")).to_be_visible()
    zoe.get_by_role("button", name="Give up: RB-of-Zoe").click()
    expect(zoe.get_by_role("button", name="Cancel")).to_be_focused()
    zoe.get_by_role("button", name="Yes, give it up").click()
    expect(zoe.get_by_text("shown this once")).to_contain_text(re.compile(r"[2-9A-Z]{4}-[2-9A-Z]{4}-[2-9A-Z]{4}"))
    expect(zoe.get_by_text("No robot is yours yet.")).to_be_visible()


def test_people_see_their_browsers_and_give_tokens_to_their_programs(served: Running, open_page: OpenPage) -> None:
    operator = open_page("/operator")
    page = open_page(invited(operator, "yann@example.org", "Fleet engineer"), storage_state=None)
    accept(page)
    page.goto("/account")
    expect(page.get_by_text("Fleet engineer")).to_be_visible()
    page.get_by_role("button", name="Make a link").click()
    other = open_page(page.get_by_text("/login?token=").inner_text(), storage_state=None)
    expect(other.get_by_role("link", name="Your account")).to_be_visible()
    page.reload()
    page.get_by_role("button", name=re.compile("^Sign out: ")).click()
    expect(page.get_by_role("button", name=re.compile("^Sign out: "))).to_have_count(0)
    other.reload()
    expect(other.get_by_role("heading", name="Come on in")).to_be_visible()
    page.get_by_label("What it is for").fill("a dashboard")
    page.get_by_label("See the fleet's figures", exact=True).check()
    page.get_by_role("button", name="Make a token").click()
    token = page.get_by_text("stp_").inner_text()
    figures = f"{served.url}/api/v1/fleet/failure-rates"
    assert calling.get(figures, headers={"Authorization": f"Bearer {token}"}).status_code == 200
    page.get_by_role("button", name="Revoke: a dashboard").click()
    expect(page.get_by_role("button", name="Revoke: a dashboard")).to_have_count(0)
    assert calling.get(figures, headers={"Authorization": f"Bearer {token}"}).status_code == 401


def test_pages_about_people_are_for_everybody(served: Running, open_page: OpenPage) -> None:
    operator = open_page("/operator")
    links = [invited(operator, f"{name}@example.org") for name in ("wim", "xena")]
    calling.post(
        f"{served.url}/api/v1/robots",
        headers={"Authorization": f"Bearer {ADMIN_TOKEN}"},
        json={"id": "RB-of-Wim", "name": "Wim's robot with quite a long name", "owner": "wim@example.org"},
    )
    for link, size in zip(links, SIZES, strict=True):
        page = open_page(link, storage_state=None, bypass_csp=True, **size)
        expect(page.get_by_role("button", name="Accept")).to_be_visible()
        assert complaints(page) == []
        accept(page)
        for path, title in (
            ("/account", "Your account"),
            ("/home", "Your home"),
            ("/forgotten", "Forgot the password?"),
        ):
            page.goto(path)
            expect(page.get_by_role("heading", level=1)).to_have_text(title)
            assert complaints(page) == [], path
        page = open_page("/operator", bypass_csp=True, **size)
        expect(page.get_by_role("heading", name="Accounts", exact=True)).to_be_visible()
        assert complaints(page) == []


def test_a_viewer_of_a_home_is_offered_nothing_that_viewers_may_not_do(served: Running, open_page: OpenPage) -> None:
    made = calling.post(
        f"{served.url}/api/v1/robots",
        headers={"Authorization": f"Bearer {ADMIN_TOKEN}"},
        json={"id": "RB-of-Una", "name": "Una's robot", "owner": "una@example.org"},
    )
    robot = Robot(served, "RB-of-Una", made.json()["token"])
    robot.upload("0")
    database = Database(f"sqlite:///{served.data_dir / 'stillroom.sqlite'}")
    with database.write() as tx:
        people.join(tx, "una@example.org", "vic@example.org", "viewer", datetime.now(UTC))
    for email, offered in (("una@example.org", 1), ("vic@example.org", 0)):
        page = open_page(f"/login?token={new_login_link(database, email)}", storage_state=None)
        page.get_by_role("link", name="ground").click()
        shown(page, 1)
        page.get_by_role("tab", name="History").click()
        expect(page.get_by_text("in force")).to_be_visible()
        expect(page.get_by_role("button", name="Pin this version")).to_have_count(offered)
        expect(page.get_by_role("button", name="Edit", exact=True)).to_have_count(offered)
        page.goto("/home")
        expect(page.get_by_text("una@example.org")).to_have_count(1 - offered)
    database.dispose()
