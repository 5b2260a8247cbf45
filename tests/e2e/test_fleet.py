"""From a doubling of failures to a group, to a mission, and no further than its owner lets (journey J10)."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from urllib.parse import parse_qs, urlsplit

import httpx2
import pytest
import sqlalchemy as sa
from playwright.sync_api import Browser, Page, StorageState, expect

from stillroom.store.database import Database
from stillroom.store.fleet_tables import plan_grant
from stillroom.store.tables import metadata, robot
from tests.e2e import calling
from tests.e2e.conftest import ADMIN_TOKEN, OpenPage, Robot, Running, running
from tests.e2e.test_accessibility import AXE, Keep
from tests.homes import changed

OPERATOR = {"Authorization": f"Bearer {ADMIN_TOKEN}"}
ANN = "ann@example.org"
SEED = ("--missions", "3000", "--robots", "60", "--days", "40")
PAGES = {
    "overview": ("/fleet", "Robots that fail most"),
    "causes": ("/fleet/causes", "door_closed"),
    "mission": ("/fleet/robots/RB-7/maps/ground/missions/1", "Ask the owner"),
}


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A service whose fleet is made up, but for one robot, which is Ann's: a door of hers was shut."""
    service = running(tmp_path_factory.mktemp("fleet"))
    environment = os.environ | {"STILLROOM_DATA_DIR": str(service.data_dir)}
    subprocess.run([sys.executable, "-m", "stillroom", "seed-fleet", *SEED], env=environment, check=True)
    service.start()
    body = {"id": "RB-7", "name": "Robin", "owner": ANN}
    made = calling.post(f"{service.url}/api/v1/robots", headers=OPERATOR, json=body)
    robot = Robot(service, "RB-7", made.json()["token"])
    robot.upload("0")
    robot.upload("1", changed("shut"), firmware="5.2", model="S9")
    yield service
    service.stop()


@pytest.fixture(scope="module")
def engineer(fleet: Running, chromium: Browser) -> StorageState:
    context = chromium.new_context()
    context.new_page().goto(fleet.link)
    state = context.storage_state()
    context.close()
    return state


@pytest.fixture
def look(fleet: Running, engineer: StorageState, open_page: OpenPage) -> OpenPage:
    def opened(path: str, **options: object) -> Page:
        return open_page(path, base_url=fleet.url, storage_state=engineer, **options)

    return opened


def search(page: Page) -> dict[str, list[str]]:
    return parse_qs(urlsplit(page.url).query)


def test_two_clicks_lead_from_a_spike_to_the_group_that_makes_it_up_and_one_more_to_a_mission(look: OpenPage) -> None:
    page = look("/")
    page.get_by_role("link", name="Fleet").click()
    chart = page.get_by_role("img", name="Failure rates")
    expect(chart.locator("canvas")).to_be_visible()
    box = chart.bounding_box()
    assert box is not None
    chart.click(position={"x": box["width"] - 26, "y": box["height"] / 2})
    page.wait_for_url(re.compile("/fleet/causes"))
    assert search(page)["from"] == search(page)["to"]
    group = page.get_by_role("listitem").first
    expect(group).to_contain_text("door_closed")
    expect(group).to_contain_text("of all that failed")
    expect(group).to_contain_text("First seen")
    group.get_by_role("link").click()
    expect(page.get_by_role("group", name="Firmware").get_by_role("row").nth(1)).to_contain_text("5.2")
    page.get_by_role("group", name="Its missions").get_by_role("link").first.click()
    expect(page.get_by_role("heading", level=1)).to_have_text(re.compile(r"Mission \d+"))
    expect(page.get_by_role("region", name="What came of it")).to_contain_text("✗ fails")
    page.go_back()
    expect(page.get_by_role("heading", level=1)).to_contain_text("door_closed")


def test_filters_are_kept_in_the_address(look: OpenPage) -> None:
    page = look("/fleet?days=7")
    expect(page.get_by_role("radio", name="7 days")).to_be_checked()
    page.get_by_text("Firmware: any").click()
    page.get_by_role("checkbox", name="5.2").check()
    expect(page.get_by_text("Firmware: 5.2")).to_be_visible()
    assert search(page) == {"days": ["7"], "firmware": ["5.2"]}
    page.reload()
    expect(page.get_by_text("Firmware: 5.2")).to_be_visible()
    page.get_by_role("link", name="Causes", exact=True).click()
    assert search(page) == {"days": ["7"], "firmware": ["5.2"]}
    page.get_by_role("button", name="Show all missions").click()
    expect(page.get_by_text("Firmware: any")).to_be_visible()
    assert search(page) == {"days": ["7"]}


def test_few_missions_show_their_interval_alone_and_charts_are_tables_too(look: OpenPage) -> None:
    page = look("/fleet?days=7&model=S7&size=10%2B")
    rates = page.get_by_role("region", name="Missions that fail")
    expect(rates).to_contain_text("the interval is all that is known")
    rates.get_by_role("button", name="As a table").click()
    row = rates.get_by_role("row").last
    expect(row).to_have_text(re.compile(r"\d+\.\d to \d+\.\d\s%"))
    expect(row.locator("strong")).to_have_count(0)


def test_a_floor_plan_is_seen_with_the_owners_leave_and_each_look_is_written_down(
    fleet: Running, look: OpenPage, keep: Keep
) -> None:
    path = f"{fleet.url}/api/v1/fleet/robots/RB-7/maps/ground/missions/1/figure"
    assert calling.get(path, headers=OPERATOR).status_code == 403
    page = look("/fleet/robots/RB-7/maps/ground/missions/1")
    plan = page.get_by_role("region", name="Floor plan")
    expect(plan).to_contain_text("403")
    expect(page.get_by_role("region", name="Rooms")).to_contain_text("r1")
    plan.get_by_label("Why you want to look").fill("A door was shut, and a room was lost.")
    plan.get_by_role("button", name="Ask the owner").click()
    expect(plan).to_contain_text("has not answered")
    with signed_in(fleet, ANN) as ann:
        (grant,) = ann.get("/api/v1/grants").json()["items"]
        assert ann.post(f"/api/v1/grants/{grant['id']}/answer", json={"answer": "grant"}).status_code == 200
        assert ann.get("/api/v1/robots/RB-7/views").json()["items"] == []
        page.reload()
        with page.expect_response(re.compile(r"/cells\.png$")):
            plan.get_by_role("button", name="Show the floor plan").click()
        expect(plan.get_by_role("img", name="Floor plan of mission 1")).to_be_visible()
        looks = ann.get("/api/v1/robots/RB-7/views").json()["items"]
        assert sorted(one["what"] for one in looks) == ["cells", "figure"]
        keep(page, "fleet-plan-1440")
        assert ann.delete(f"/api/v1/grants/{grant['id']}").status_code == 200
    page.reload()
    expect(plan).to_contain_text("403")


def test_owners_are_not_shown_the_fleet(fleet: Running, open_page: OpenPage) -> None:
    page = open_page(owner_link(fleet, ANN), base_url=fleet.url, storage_state=None)
    expect(page.get_by_role("heading", name="Homes")).to_be_visible()
    expect(page.get_by_role("link", name="Fleet")).to_have_count(0)
    page.goto(f"{fleet.url}/fleet")
    expect(page.get_by_role("heading", name="Not for this account")).to_be_visible()


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing_and_phones_show_all_of_it(name: str, look: OpenPage, keep: Keep) -> None:
    path, there = PAGES[name]
    page = look(path)
    expect(page.get_by_text(there).first).to_be_visible()
    page.evaluate(AXE.read_text())
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
        expect(page.locator(f"html[data-mantine-color-scheme={scheme}]")).to_be_attached()
        found = page.evaluate("axe.run()")
        keep(page, f"fleet-{name}-1440-{scheme}")
        assert [(rule["id"], [node["html"] for node in rule["nodes"]]) for rule in found["violations"]] == []
    page.set_viewport_size({"width": 360, "height": 740})
    expect(page.get_by_text(there).first).to_be_visible()
    keep(page, f"fleet-{name}-360-dark")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360


def test_leave_ends_by_itself_and_when_the_owner_leaves_only_the_counts_stay(fleet: Running, look: OpenPage) -> None:
    mission = "/fleet/robots/RB-7/maps/ground/missions/1"
    database = Database(f"sqlite:///{fleet.data_dir / 'stillroom.sqlite'}")
    with signed_in(fleet, ANN) as ann:
        asked = {"robot": "RB-7", "reason": "A door was shut, and a room was lost.", "hours": 1}
        grant = calling.post(f"{fleet.url}/api/v1/fleet/grants", headers=OPERATOR, json=asked).json()["id"]
        ann.post(f"/api/v1/grants/{grant}/answer", json={"answer": "grant"})
        page = look(mission)
        plan = page.get_by_role("region", name="Floor plan")
        expect(plan.get_by_role("button", name="Show the floor plan")).to_be_visible()
        with database.write() as tx:
            over = datetime.now(UTC) - timedelta(seconds=1)
            tx.execute(sa.update(plan_grant).where(plan_grant.c.key == grant).values(expires_at=over))
        page.reload()
        expect(plan).to_contain_text("403")
        before = rates(fleet)
        gone = ann.delete(f"/api/v1/home?confirm={ANN}")
        assert gone.status_code == 200, gone.text
    assert rates(fleet) == before
    page.reload()
    expect(page.get_by_role("heading", name="Nothing here")).to_be_visible()
    with database.read() as tx:
        rows = [
            str(row) for table in metadata.sorted_tables for row in tx.execute(sa.select(table)) if table is not robot
        ]
    database.dispose()
    assert [row for row in rows if ANN in row or "RB-7" in row] == []


def rates(fleet: Running) -> object:
    answer = calling.get(f"{fleet.url}/api/v1/fleet/failure-rates?group_by=firmware", headers=OPERATOR)
    assert answer.status_code == 200, answer.text
    return answer.json()


def owner_link(service: Running, owner: str) -> str:
    command = [sys.executable, "-m", "stillroom", "login-link", "--url", service.url, "--owner", owner]
    environment = os.environ | {"STILLROOM_DATA_DIR": str(service.data_dir)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()[-1]


@contextmanager
def signed_in(service: Running, owner: str) -> Iterator[httpx2.Client]:
    """As the owner's browser would be."""
    headers = {"Sec-Fetch-Site": "same-origin"}
    with httpx2.Client(
        timeout=calling.PATIENCE_S, base_url=service.url, headers=headers, follow_redirects=True
    ) as client:
        client.get(owner_link(service, owner))
        yield client
