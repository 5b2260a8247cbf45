"""People draw on the map: by mouse, by touch, by keyboard and through the lists."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

from tests.e2e import calling
from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.drawing import choose, rooms, save, start_editing
from tests.e2e.looking import eventually, map_of, shown
from tests.homes import home

Keep = Callable[[Page, str], None]
PHONE: dict[str, Any] = {"width": 360, "height": 740, "has_touch": True}


def stored(robot: Robot) -> dict[str, Any]:
    found: dict[str, Any] = calling.get(robot.path, headers={"Authorization": f"Bearer {robot.token}"}).json()
    return found


def features(document: dict[str, Any], semantic: str) -> list[dict[str, Any]]:
    return [f for f in document["features"] if f["properties"]["semantic"] == semantic]


def test_a_divider_drawn_by_two_taps_shows_the_rooms_to_be_and_is_saved(
    mapped: Robot, open_page: OpenPage, keep: Keep
) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.tap((1.5, -0.9))
    hand.hover((1.5, 2.9))
    expect(
        page.get_by_text(re.compile(r"Kitchen becomes 9\.\d m² and 6\.\d m²|Kitchen becomes 6\.\d m² and 9"))
    ).to_be_visible()
    keep(page, "editor-drawing-1440-light")
    hand.tap((1.5, 2.9))
    expect(rooms(page)).to_have_count(3)
    expect(page.get_by_text("1 change not saved yet")).to_be_visible()
    assert stored(mapped)["version"] == 2
    save(page, 3)
    document = stored(mapped)
    assert len(features(document, "room")) == 3
    (drawn,) = [f for f in features(document, "divider") if f["properties"]["made_by"] == "user"]
    assert sorted(round(y, 1) for _, y in drawn["geometry"]["coordinates"]) == [-1.0, 3.0]
    expect(page.get_by_text("The robot gets it with its next mission.")).to_be_visible()
    mapped.upload("1", home(), base_version=3, tracking={"transform": [0.0, 0.0, 0.0]})
    expect(page.get_by_text("On the robot since mission 1.")).to_be_visible()


def test_a_divider_drawn_by_dragging_is_the_same(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.drag((1.5, -0.9), (1.5, 2.9))
    expect(rooms(page)).to_have_count(3)


def test_a_divider_is_drawn_with_a_finger_on_a_small_phone(mapped: Robot, open_page: OpenPage, keep: Keep) -> None:
    page = open_page(mapped.page, **PHONE)
    hand = start_editing(page)
    keep(page, "editor-360-light")
    choose(page, "Divide")
    hand.touch((1.5, -0.8), (1.5, 2.8))
    expect(rooms(page)).to_have_count(3)
    keep(page, "editor-divided-360-light")
    save(page, 3)


def test_an_end_in_mid_air_is_refused_in_place_with_a_fix(mapped: Robot, open_page: OpenPage, keep: Keep) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.tap((1.5, -0.9), (1.5, 1.0))
    refused = page.get_by_role("alert").filter(has_text="This end is")
    expect(refused).to_contain_text(re.compile(r"[12]\.\d\d m from the nearest wall"))
    expect(rooms(page)).to_have_count(2)
    keep(page, "editor-refused-1440-light")
    refused.get_by_role("button", name="Extend to the wall").click()
    expect(rooms(page)).to_have_count(3)
    expect(refused).to_have_count(0)


def test_undo_and_redo_go_on_over_a_reload_and_over_saves(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.tap((1.5, -0.9), (1.5, 2.9))
    expect(rooms(page)).to_have_count(3)
    hand.tap((6.0, -0.9), (6.0, 2.9))
    expect(rooms(page)).to_have_count(4)
    page.reload()
    expect(rooms(page)).to_have_count(4)
    undo, redo = (page.get_by_role("button", name=name) for name in ("Undo", "Redo"))
    undo.click()
    expect(rooms(page)).to_have_count(3)
    save(page, 3)
    undo.click()
    expect(rooms(page)).to_have_count(2)
    assert stored(mapped)["cause"] == "restore"
    redo.click()
    expect(rooms(page)).to_have_count(3)
    page.reload()
    undo.click()
    expect(rooms(page)).to_have_count(2)
    page.keyboard.press("Control+Shift+Z")
    expect(rooms(page)).to_have_count(3)
    assert stored(mapped)["version"] == 7


def test_a_divider_is_selected_moved_nudged_made_a_door_and_deleted(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.tap((1.5, -0.9), (1.5, 2.9))
    expect(rooms(page)).to_have_count(3)
    choose(page, "Select")
    hand.tap((1.5, 2.0))
    entry = page.get_by_role("region", name="Dividers").locator("li[data-open=true]")
    expect(entry).to_have_count(1)
    hand.drag((1.5, 0.4), (2.5, 0.4))
    expect(rooms(page).filter(has_text=re.compile(r"10\.\d m²|9\.9 m²"))).to_have_count(1)
    map_of(page).focus()
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    entry.get_by_role("button", name="door").click()
    expect(entry.get_by_role("button", name="door", exact=True)).to_have_attribute("aria-pressed", "true")
    save(page, 3)
    (drawn,) = [f for f in features(stored(mapped), "divider") if f["properties"]["kind"] == "door"]
    assert [x for x, _ in drawn["geometry"]["coordinates"]] == pytest.approx([3.0, 3.0], abs=0.1)
    expect(page.get_by_text("All changes are saved.")).to_be_visible()
    map_of(page).focus()
    page.keyboard.press("Delete")
    expect(rooms(page)).to_have_count(2)
    save(page, 4)
    assert len(features(stored(mapped), "room")) == 2


def test_zones_and_places_that_are_not_real_are_drawn(mapped: Robot, open_page: OpenPage, keep: Keep) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    for tool, start, end in (
        ("No-go", (0.5, 0.0), (1.5, 1.0)),
        ("No-mop", (2.0, 0.0), (3.0, 1.0)),
        ("Wall", (0.5, 2.0), (3.0, 2.0)),
        ("Not real", (6.5, -0.8), (7.9, 2.8)),
    ):
        choose(page, tool)
        hand.tap(start, end)
        name = {"Wall": "Virtual wall", "Not real": "Not a real place"}.get(tool, f"{tool} zone")
        expect(page.get_by_role("button", name=re.compile(f"^{name}"))).to_have_count(1)
    keep(page, "editor-zones-1440-light")
    page.emulate_media(color_scheme="dark")
    keep(page, "editor-zones-1440-dark")
    save(page, 3)
    document = stored(mapped)
    assert [f["properties"]["kind"] for f in features(document, "restriction")] == ["no_go", "no_mop", "virtual_wall"]
    assert len(features(document, "phantom")) == 1
    assert len(features(document, "room")) == 2
    mapped.upload("1", home(), base_version=3, tracking={"transform": [0.0, 0.0, 0.0]})
    again = stored(mapped)
    assert again["version"] == 4
    assert len(features(again, "phantom")) == 1
    bedroom = max(features(again, "room"), key=lambda f: max(x for x, _ in f["geometry"]["coordinates"][0]))
    assert bedroom["properties"]["area"] < 12


def test_everything_can_be_done_by_keyboard_alone(mapped: Robot, open_page: OpenPage, keep: Keep) -> None:
    page = open_page(mapped.page)
    start_editing(page)
    page.keyboard.press("?")
    expect(page.get_by_role("dialog", name="Shortcuts")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    map_of(page).focus()
    page.keyboard.press("d")
    expect(page.get_by_role("toolbar").get_by_role("button", name="Divide")).to_have_attribute("aria-pressed", "true")
    for key, times in (("ArrowLeft", 12), ("ArrowUp", 20)):
        for _ in range(times):
            page.keyboard.press(key)
    page.keyboard.press("Enter")
    for _ in range(40):
        page.keyboard.press("ArrowDown")
    keep(page, "editor-keyboard-1440-light")
    page.keyboard.press("Enter")
    expect(rooms(page)).to_have_count(3)
    page.keyboard.press("Control+z")
    expect(rooms(page)).to_have_count(2)
    page.keyboard.press("Control+Shift+z")
    expect(rooms(page)).to_have_count(3)
    page.keyboard.press("Control+s")
    expect(page.get_by_text("Saved as version 3.")).to_be_visible()


def test_the_list_of_rooms_divides_names_pins_and_merges_without_the_map(
    mapped: Robot, open_page: OpenPage, keep: Keep
) -> None:
    page = open_page(mapped.page)
    start_editing(page)
    page.get_by_role("button", name="Kitchen 15").click()
    entry = page.get_by_role("region", name="Rooms").locator("li[data-open=true]")
    entry.get_by_label("Used as").select_option("Kitchen")
    entry.get_by_label("Pinned").check()
    entry.get_by_label("Position").press("ArrowLeft")
    expect(entry.get_by_text(re.compile("^Parts of "))).to_be_visible()
    keep(page, "editor-room-1440-light")
    entry.get_by_role("button", name="Divide here").click()
    expect(rooms(page)).to_have_count(3)
    page.get_by_role("button", name=re.compile("^Kitchen 2 ")).click()
    field = entry.get_by_role("textbox", name="Name")
    field.fill("Pantry")
    field.press("Enter")
    expect(page.get_by_role("button", name=re.compile("^Pantry"))).to_be_visible()
    save(page, 3)
    named = {f["properties"]["name"]: f["properties"] for f in features(stored(mapped), "room")}
    assert set(named) == {"Kitchen", "Pantry", "Bedroom"}
    assert (named["Pantry"]["kind"], named["Pantry"]["pinned"]) == ("kitchen", True)
    entry.get_by_role("button", name="Kitchen", exact=True).click()
    expect(rooms(page)).to_have_count(2)
    save(page, 4)
    assert len(features(stored(mapped), "room")) == 2


def test_what_is_chosen_shows_at_once_while_the_service_still_answers_what_came_before(
    mapped: Robot, open_page: OpenPage
) -> None:
    page = open_page(mapped.page)
    start_editing(page)
    page.get_by_role("button", name="Kitchen 15").click()
    held: list[Route] = []
    page.route("**/edits?dry_run=true", lambda route: held.append(route))
    page.get_by_label("Used as").select_option("Kitchen")
    pinned = page.get_by_label("Pinned")
    pinned.check()
    page.get_by_label("Used as").select_option("Hall")
    expect(page.get_by_label("Used as")).to_have_value("hall")
    for n in range(3):
        eventually(page, lambda n=n: len(held) == n + 1)  # type: ignore[misc]
        expect(pinned).to_be_checked()
        held[n].continue_()
    page.unroute("**/edits?dry_run=true")
    save(page, 3)
    (kitchen,) = (f["properties"] for f in features(stored(mapped), "room") if f["properties"]["name"] == "Kitchen")
    assert (kitchen["kind"], kitchen["pinned"]) == ("hall", True)


def test_what_is_being_typed_stays_when_the_service_names_what_was_drawn(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page(mapped.page)
    start_editing(page)
    page.get_by_role("button", name="Kitchen 15").click()
    held: list[Route] = []
    page.route("**/edits?dry_run=true", lambda route: held.append(route))
    page.get_by_role("button", name="Divide here").click()
    expect(rooms(page)).to_have_count(3)
    page.get_by_role("button", name=re.compile("^Kitchen 2 ")).click()
    field = page.get_by_role("textbox", name="Name")
    field.fill("Pant")
    eventually(page, lambda: len(held) == 1)
    with page.expect_response("**/edits?dry_run=true"):
        held[0].continue_()
    page.unroute("**/edits?dry_run=true")
    expect(page.get_by_role("button", name="Kitchen / Kitchen 2")).to_be_visible()  # only the service knows that
    expect(field).to_be_focused()
    field.press_sequentially("ry")
    field.press("Enter")
    expect(page.get_by_role("button", name=re.compile("^Pantry"))).to_be_visible()
    expect(field).to_have_value("Pantry")


def test_what_is_drawn_without_a_network_is_saved_when_it_is_back_onto_what_the_robot_sent_meanwhile(
    mapped: Robot, open_page: OpenPage, keep: Keep
) -> None:
    page = open_page(mapped.page, **PHONE)
    hand = start_editing(page)
    page.context.set_offline(True)
    choose(page, "Divide")
    hand.touch((1.5, -0.8), (1.5, 0.8))
    refused = page.get_by_role("alert").filter(has_text="This end is")
    refused.get_by_role("button", name="Extend to the wall").click()
    expect(rooms(page)).to_have_count(3)
    expect(page.get_by_text("No network")).to_be_visible()
    page.get_by_role("button", name="Undo").click()
    expect(rooms(page)).to_have_count(2)
    page.get_by_role("button", name="Redo").click()
    expect(rooms(page)).to_have_count(3)
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_text("Will be saved as soon as the network is back.")).to_be_visible()
    keep(page, "editor-offline-360-light")
    mission = mapped.upload("1", home(shift=(4, 2)), base_version=2, tracking={"transform": [0.2, 0.1, 0.0]})
    assert mission["version"] == 3
    page.context.set_offline(False)
    expect(page.get_by_text("Saved as version 4.")).to_be_visible()
    document = stored(mapped)
    assert (document["version"], document["mission"]) == (4, "1")
    (drawn,) = [f for f in features(document, "divider") if f["properties"]["made_by"] == "user"]
    assert [x for x, _ in drawn["geometry"]["coordinates"]] == pytest.approx([1.7, 1.7], abs=0.15)


def test_two_tabs_merge_what_is_apart_and_ask_about_what_is_not(mapped: Robot, open_page: OpenPage, keep: Keep) -> None:
    first = open_page(mapped.page)
    start_editing(first)
    second = first.context.new_page()
    second.goto(f"{mapped.page}?edit")
    expect(rooms(second)).to_have_count(2)

    def rename(page: Page, old: str, new: str) -> None:
        entry = page.get_by_role("button", name=re.compile(f"^{old} 1"))
        if entry.get_attribute("aria-expanded") == "false":
            entry.click()
        field = page.get_by_role("textbox", name="Name")
        field.fill(new)
        field.press("Enter")
        expect(page.get_by_role("button", name=re.compile(f"^{new} 1"))).to_be_visible()

    rename(first, "Kitchen", "Cookery")
    rename(second, "Bedroom", "Study")
    save(first, 3)
    expect(second.get_by_role("button", name=re.compile("^Cookery 1"))).to_be_visible()
    save(second, 4)
    assert {f["properties"]["name"] for f in features(stored(mapped), "room")} == {"Cookery", "Study"}
    expect(first.get_by_role("button", name=re.compile("^Study 1"))).to_be_visible()

    rename(first, "Cookery", "Galley")
    rename(second, "Cookery", "Canteen")
    save(first, 5)
    clash = second.get_by_role("alert").filter(has_text="Somebody else changed the same")
    expect(clash).to_contain_text("Galley")
    keep(second, "editor-clash-1440-light")
    clash.get_by_role("button", name="Use mine").click()
    save(second, 6)
    assert {f["properties"]["name"] for f in features(stored(mapped), "room")} == {"Canteen", "Study"}


@pytest.mark.parametrize("name", ["<script>document.title='hacked'</script>", "<img src=x onerror=alert(1)>", "מטבח"])
def test_names_are_shown_as_they_are_and_nothing_is_run(mapped: Robot, open_page: OpenPage, name: str) -> None:
    room = features(stored(mapped), "room")[0]
    mapped.edit(2, {"op": "rename_room", "id": room["id"], "name": name})
    page = open_page(mapped.page)
    shown(page, 3)
    expect(page.get_by_role("button", name=name)).to_be_visible()
    assert "hacked" not in page.title()


def test_what_was_changed_while_the_robot_was_out_is_there_when_it_comes_back(
    mapped: Robot, open_page: OpenPage
) -> None:
    page = open_page(mapped.page)
    hand = start_editing(page)
    choose(page, "Divide")
    hand.tap((1.5, -0.9), (1.5, 2.9))
    expect(rooms(page)).to_have_count(3)
    page.get_by_role("button", name=re.compile("^Bedroom 1")).click()
    field = page.get_by_role("textbox", name="Name")
    field.fill("Library")
    field.press("Enter")
    expect(page.get_by_role("button", name=re.compile("^Library 1"))).to_be_visible()
    save(page, 3)
    mission = mapped.upload("1", home(shift=(3, 1)), base_version=2, tracking={"transform": [0.15, 0.05, 0.0]})
    assert mission["version"] == 4
    page.get_by_role("button", name="Done").click()
    shown(page, 4)
    expect(page.get_by_role("button", name=re.compile(r"^Library 1"))).to_be_visible()
    expect(page.get_by_role("button", name=re.compile(r"^Kitchen( 2)? \d"))).to_have_count(2)
