"""An owner saves a home, sees who looked, and deletes it, which takes its name."""

import zipfile
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, StorageState, expect

from tests.e2e import calling
from tests.e2e.conftest import ADMIN_TOKEN, OpenPage, Robot, Running
from tests.e2e.test_hostile_text import link_of

EMAIL = "paula@example.org"


def test_an_owner_saves_deletes_and_brings_in_a_home(
    served: Running, open_page: OpenPage, keep: Callable[[Page, str], None], tmp_path: Path
) -> None:
    made = calling.post(
        f"{served.url}/api/v1/robots",
        headers={"Authorization": f"Bearer {ADMIN_TOKEN}"},
        json={"id": "RB-paula", "name": "Paulas", "owner": EMAIL},
    ).json()
    robot = Robot(served, made["id"], made["token"])
    robot.upload("0")
    nobody = StorageState(cookies=[], origins=[])
    page = open_page(link_of(served, EMAIL), storage_state=nobody)
    page.goto("/home")
    page.get_by_role("button", name="Who looked at the maps of Paulas").click()
    keep(page, "privacy-1440-light")
    with page.expect_download() as download:
        page.get_by_role("link", name="Save everything of Paulas").click()
    saved = tmp_path / download.value.suggested_filename
    download.value.save_as(saved)
    assert saved.name == "RB-paula.zip"
    assert "manifest.json" in zipfile.ZipFile(saved).namelist()
    page.get_by_role("button", name="Delete the maps of Paulas").click()
    sure = page.get_by_role("group", name="Delete all maps of Paulas?")
    for_good = sure.get_by_role("button", name="Delete for good")
    expect(for_good).to_be_disabled()
    sure.get_by_label("Type RB-paula to confirm").fill("RB-paula")
    keep(page, "privacy-sure-1440-light")
    for_good.click()
    expect(page.get_by_role("status").filter(has_text="Deleted: 1 map, 1 mission.")).to_be_visible()
    page.get_by_label("Bring saved maps into Paulas").set_input_files(saved)
    expect(page.get_by_role("status").filter(has_text="Brought in: 1 map, 1 version.")).to_be_visible()
    with page.expect_download() as download:
        page.get_by_role("link", name="Save everything of the home").click()
    download.value.save_as(tmp_path / "home.zip")
    assert "robots/1/maps/1/map.json" in zipfile.ZipFile(tmp_path / "home.zip").namelist()
    page.get_by_label("Bring a saved home in").set_input_files(tmp_path / "home.zip")
    expect(page.get_by_text("The robot has a map of this name already.")).to_be_visible()
    page.get_by_role("combobox", name="How long what the robots sensed is kept").select_option("30")
    expect(page.get_by_text("deleted 30 days after it came")).to_be_visible()
    page.get_by_role("button", name="Keep it so long").click()
    page.get_by_role("button", name="Delete everything and the account").click()
    page.get_by_label(f"Type {EMAIL} to confirm").fill(EMAIL)
    page.set_viewport_size({"width": 360, "height": 740})
    page.emulate_media(color_scheme="dark")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    keep(page, "privacy-360-dark")
    page.get_by_role("button", name="Delete for good").click()
    page.wait_for_url("**/")
    answer = calling.put(f"{robot.path}/missions/1", headers={"Authorization": f"Bearer {robot.token}"}, content=b"")
    assert answer.status_code == 403
