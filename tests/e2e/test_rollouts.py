"""Another setting on its way to all homes, from the first look to the way back (journey J9), and what runs the service."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, StorageState, expect

from stillroom.service.fleet.variants import is_candidate
from stillroom.store.database import Database
from tests.e2e import calling
from tests.e2e.conftest import ADMIN_TOKEN, OpenPage, Robot, Running, running
from tests.e2e.looking import eventually
from tests.e2e.test_accessibility import AXE, Keep
from tests.fleets import Arms, put_at
from tests.homes import home

OPERATOR = {"Authorization": f"Bearer {ADMIN_TOKEN}"}
NAME = "coarse-2-4"


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    service = running(tmp_path_factory.mktemp("rollouts"))
    service.start()
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
def page(fleet: Running, engineer: StorageState, open_page: OpenPage) -> Page:
    return open_page("/fleet", base_url=fleet.url, storage_state=engineer)


@pytest.fixture
def arms(fleet: Running) -> Iterator[Arms]:
    database = Database(f"sqlite:///{fleet.data_dir / 'stillroom.sqlite'}")
    yield Arms(database)
    database.dispose()


def get(fleet: Running, path: str) -> Any:
    answer = calling.get(f"{fleet.url}{path}", headers=OPERATOR)
    assert answer.status_code == 200, answer.text
    return answer.json()


@pytest.fixture
def look_at_all(keep: Keep) -> Callable[[Page, str], None]:
    """In both schemes and at both widths; axe finds nothing."""

    def look(page: Page, name: str) -> None:
        page.evaluate(AXE.read_text())
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
            expect(page.locator(f"html[data-mantine-color-scheme={scheme}]")).to_be_attached()
            keep(page, f"{name}-1440-{scheme}")
            found = page.evaluate("axe.run()")
            assert [(rule["id"], [node["html"] for node in rule["nodes"]]) for rule in found["violations"]] == []
        page.set_viewport_size({"width": 360, "height": 740})
        keep(page, f"{name}-360-dark")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        page.set_viewport_size({"width": 1440, "height": 900})
        page.emulate_media(color_scheme="light")

    return look


def test_a_rollout_from_the_first_look_to_the_way_back(
    fleet: Running, page: Page, arms: Arms, look_at_all: Callable[[Page, str], None]
) -> None:
    number = next(n for n in range(1000) if is_candidate(NAME, 25, f"RB-{n}"))
    robot = fleet.add_robot(f"RB-{number}", "Robin")
    robot.upload("0")
    robot.upload("1", home(shift=(1, 0)))

    # on stored missions
    page.get_by_role("link", name="Rollouts").click()
    again = page.get_by_role("form", name="Run missions again")
    again.get_by_label("Name").fill("coarse")
    again.get_by_label("Resolvers").select_option("none")
    again.get_by_role("button", name="Run missions again").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("coarse")
    eventually(page, lambda: get(fleet, "/api/v1/fleet/replays/coarse")["done"] == 1)
    page.reload()
    expect(page.get_by_role("main")).to_contain_text("1 of 1")
    expect(page.get_by_role("row", name="With meta-dividers")).to_contain_text("1")
    page.get_by_role("link", name="All rollouts and replays").click()

    # beside: no home's map changes, and a paired table appears
    begin = page.get_by_role("region", name="Begin a rollout")
    begin.get_by_label("Name").fill(NAME)
    begin.get_by_label("Resolvers").select_option("none")
    begin.get_by_label("At most so much worse (points)").fill("2")
    begin.get_by_role("button", name="Begin").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text(f"{NAME} running")
    robot.upload("2", home(shift=(2, 0)))
    before = get(fleet, robot.path.removeprefix(fleet.url))
    paired = page.get_by_role("region", name="The same missions both ways")
    eventually(page, lambda: get(fleet, f"/api/v1/fleet/rollouts/{NAME}")["tables"] != [])
    page.reload()
    expect(paired.get_by_role("row", name="With meta-dividers")).to_contain_text("1")
    arms.add(0, False, 400, 6, beside_failed=6)
    page.reload()
    gates = page.get_by_role("region", name="Gates")
    expect(gates).to_contain_text("passed · 401 missions")
    assert get(fleet, robot.path.removeprefix(fleet.url)) == before
    look_at_all(page, "rollout-beside")

    # at 1 %: seven failures against four of 300 are inconclusive, and it does not go on
    page.get_by_role("button", name="Go on to 1\u00a0% of homes").click()
    expect(page.get_by_role("listitem").filter(has_text="1\u00a0%").first).to_have_attribute("aria-current", "step")
    expect(page.get_by_role("button", name="Go on to 5\u00a0% of homes")).to_be_disabled()
    arms.add(1, False, 300, 4)
    arms.add(1, True, 300, 7)
    page.reload()
    expect(gates).to_contain_text("inconclusive · 300 missions of each arm; looked at when there are 600")
    row = gates.get_by_role("row", name="With meta-dividers")
    for said in ("0.5 to 3.4", "1.1 to 4.7", "0.55", "inconclusive", "missions"):
        expect(row).to_contain_text(said)
    expect(row).to_contain_text("about")
    expect(page.get_by_role("button", name="Go on to 5\u00a0% of homes")).to_be_disabled()
    refused = calling.post(f"{fleet.url}/api/v1/fleet/rollouts/{NAME}/advance", headers=OPERATOR)
    assert (refused.status_code, refused.json()["verdict"]) == (409, "inconclusive")
    look_at_all(page, "rollout-inconclusive")

    # at 25 %: it harms, and halts by itself
    put_at(arms.database, 25)
    robot.upload("3", home(shift=(1, 0)))
    document = get(fleet, robot.path.removeprefix(fleet.url))
    rooms = [feature for feature in document["features"] if feature["properties"]["semantic"] == "room"]
    robot.edit(document["version"], {"op": "rename_room", "id": rooms[0]["id"], "name": "Kitchen"})
    arms.add(25, False, 400, 8)
    arms.add(25, True, 300, 40)
    page.reload()
    expect(page.get_by_role("heading", level=1)).to_contain_text(f"{NAME} failed")
    expect(page.get_by_text("meta_dividers: 13.")).to_be_visible()
    maps = page.get_by_role("region", name="Maps that the candidate changed")
    expect(maps).to_contain_text(f"{robot.id} / ground")
    look_at_all(page, "rollout-halted")
    robot.upload("4", home(shift=(2, 0)))
    of_last = get(fleet, f"/api/v1/fleet/robots/{robot.id}/maps/ground/missions/4")
    assert "+" not in of_last["algorithm"]  # it has what it had before

    # and back, with what its owner changed meanwhile
    page.reload()
    maps.get_by_role("button", name="Take it back everywhere").click()
    expect(maps).to_contain_text("1 map went back, with 1 edit kept.")
    expect(maps).to_contain_text("nothing of it is left")
    document = get(fleet, robot.path.removeprefix(fleet.url))
    assert document["cause"] == "rollback"
    assert "Kitchen" in {f["properties"].get("name") for f in document["features"]}
    page.get_by_role("link", name="All rollouts").click()
    expect(page.get_by_role("row", name=NAME)).to_contain_text("failed")
    look_at_all(page, "rollouts")


def test_alerts_are_made_and_removed_and_what_could_not_be_processed_is_run_again(
    fleet: Running, page: Page, look_at_all: Callable[[Page, str], None]
) -> None:
    robot: Robot = fleet.add_robot("RB-broken", "Robin")
    robot.upload("0")
    robot.upload("1", home(shift=(1, 0)))
    database = Database(f"sqlite:///{fleet.data_dir / 'stillroom.sqlite'}")
    with database.write() as tx:
        tx.exec_driver_sql(
            "UPDATE mission SET outcome = 'reverted', traceback = 'Traceback\nValueError: mended since' "
            "WHERE key = '1' AND map_id IN (SELECT id FROM map WHERE robot_id = 'RB-broken')"
        )
    database.dispose()
    page.get_by_role("link", name="Operations").click()
    broken = page.get_by_role("region", name="Missions that could not be processed")
    expect(broken).to_contain_text("ValueError: mended since")
    form = page.get_by_role("form", name="Add an alert")
    form.get_by_label("Name").fill("doors")
    form.get_by_role("button", name="Add an alert").click()
    alerts = page.get_by_role("region", name="Alerts")
    expect(alerts.get_by_role("row", name="doors")).to_contain_text("quiet")
    look_at_all(page, "operations")
    broken.get_by_role("button", name="Run again: 1 of RB-broken").click()
    expect(broken).to_contain_text("All were processed.")
    alerts.get_by_role("button", name="Remove: doors").click()
    expect(alerts).to_contain_text("There is none.")
