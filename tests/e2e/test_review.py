"""People decide (journeys J1, J2, J3, J7, J8), with a robot that goes on uploading."""

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from math import pi

import pytest
import sqlalchemy as sa
from playwright.sync_api import Locator, Page, Route, expect

from stillroom.documents.images import as_grey
from stillroom.maps.geometry import Pose
from stillroom.service.decisions import expire
from stillroom.store.database import Database
from stillroom.store.tables import conflict
from tests.e2e import calling
from tests.e2e.asking import (
    OPEN_PLAN,
    OWNER,
    annex,
    causes,
    question,
    questions,
    read,
    rooms,
    send,
    settings,
    shut,
)
from tests.e2e.conftest import OpenPage, Robot
from tests.e2e.drawing import pen
from tests.e2e.looking import FIRST, shown
from tests.e2e.test_placement import FRAME
from tests.pipeline.test_registration import HOME, MIRRORED, turned

Keep = Callable[[Page, str], None]
PHONE = {"width": 360, "height": 740, "has_touch": True}
KEEP = re.compile("Keep .* as they were")


@pytest.fixture
def asked(mapped: Robot) -> Robot:
    """Its owner wants to be asked, and the robot found the wall between the rooms gone."""
    settings(mapped, review="ask_first")
    assert send(mapped, "1", OPEN_PLAN)["outcome"] == "needs_review"
    return mapped


def heading(page: Page, words: str) -> None:
    expect(page.get_by_role("heading", level=1)).to_contain_text(re.compile(words))


def ended(page: Page, title: str, *words: str) -> None:
    expect(page.get_by_role("heading", level=2, name=title)).to_be_focused()
    told = page.locator("section[data-state]")
    for one in words:
        expect(told).to_contain_text(re.compile(one))


def listed(page: Page, robot: Robot) -> Locator:
    """The question about a robot's map, in the list of all."""
    name = robot.id.replace("RB-", "Robin ")
    return page.get_by_role("listitem").filter(has_text=re.compile(rf"{name}\b")).get_by_role("link")


def without_events(page: Page) -> None:
    """The page hears of nothing that it does not ask for."""
    page.route("**/api/v1/events*", lambda route: route.abort())
    page.reload()
    expect(page.get_by_role("button", name=KEEP)).to_be_visible()


def test_a_question_appears_by_itself_and_is_answered_within_three_taps(
    mapped: Robot, open_page: OpenPage, keep: Keep
) -> None:
    page = open_page(mapped.page, **PHONE)
    page.get_by_role("radio", name="ask me first").tap()
    expect(page.get_by_role("radio", name="ask me first")).to_be_checked()
    expect(page.get_by_text("Live", exact=True)).to_be_attached()
    segments = read(mapped, "/segments")
    assert send(mapped, "1", OPEN_PLAN)["version"] == 2
    page.get_by_role("region", name="Questions about this map").get_by_role("link").tap()
    heading(page, "would be kept as before although there is a new way through")
    expect(page.get_by_text(re.compile(r"If nobody answers by .*, the map stays as it is\."))).to_be_visible()
    rooms_concerned = page.get_by_role("region", name="Rooms concerned")
    expect(rooms_concerned).to_contain_text("not found any more")
    expect(page.get_by_role("region", name="What changed").get_by_role("listitem").first).to_contain_text("is gone")
    before = page.get_by_role("button", name="Before")
    before.tap()
    expect(before).to_have_attribute("aria-pressed", "true")
    keep(page, "question-360-light")
    page.get_by_role("button", name=KEEP).tap()
    ended(page, "Decided", "Keep Bedroom and Kitchen as they were", "by an operator", "The map is version 3 now")
    assert read(mapped, "/segments") == segments
    assert causes(mapped) == ["decision", "edit", "created"]
    page.get_by_role("button", name="Undo this").tap()
    expect(page.get_by_text(re.compile("Undone: .* as version 4"))).to_be_visible()
    page.get_by_role("link", name="See the history").tap()
    expect(page.get_by_role("tabpanel")).to_contain_text("A decision was taken")


def test_two_taps_and_a_lost_answer_are_one_decision(asked: Robot, open_page: OpenPage) -> None:
    page = open_page(question(asked))
    without_events(page)
    sent: list[str] = []

    def lose_the_first(route: Route) -> None:
        sent.append(str(route.request.post_data))
        answer = route.fetch()
        assert answer.ok
        if len(sent) == 1:
            route.abort("connectionreset")
        else:
            route.fulfill(response=answer)

    page.route("**/decision", lose_the_first)
    page.get_by_role("button", name="Take the map with the repair").dblclick()
    ended(page, "Decided", "Take the map with the repair")
    assert len(sent) == 2
    assert len(set(sent)) == 1
    assert causes(asked) == ["decision", "edit", "created"]


def test_the_picture_is_compared_by_slider_and_keyboard_alone(asked: Robot, open_page: OpenPage, keep: Keep) -> None:
    page = open_page(question(asked), color_scheme="dark")
    slider = page.get_by_role("slider", name="How much of the map before is shown")
    slider.press("Home")
    expect(slider).to_have_attribute("aria-valuetext", "100 % before")
    expect(page.get_by_role("button", name="Before")).to_have_attribute("aria-pressed", "true")
    for _ in range(5):
        slider.press("PageUp")
    expect(slider).to_have_attribute("aria-valuetext", "50 % before")
    keep(page, "question-swipe-1440-dark")
    page.get_by_role("button", name="Robot's view").press("Enter")
    expect(slider).to_have_attribute("aria-valuetext", "0 % before")
    page.get_by_role("button", name="Layers").press("Enter")
    expect(page.get_by_role("checkbox", name="What changed")).to_be_checked()
    expect(page.get_by_role("checkbox", name="Rooms")).to_have_count(0)
    page.get_by_role("region", name="Rooms concerned").get_by_role("button", name=re.compile("^Kitchen")).press("Enter")
    page.get_by_role("button", name="It is only temporary").press("Enter")
    ended(page, "Decided", "It is only temporary", "The map did not change")
    assert send(asked, "2", OPEN_PLAN)["outcome"] == "needs_review"
    assert questions(asked) == []  # nobody is asked again for a week


def test_a_door_that_was_shut_is_called_one_and_is_never_asked_about_again(mapped: Robot, open_page: OpenPage) -> None:
    page = open_page("/questions")
    expect(page.get_by_text("Live", exact=True)).to_be_visible()
    assert send(mapped, "1", shut())["outcome"] == "updated"
    send(mapped, "2")
    expect(listed(page, mapped)).to_contain_text("Is there a door?")
    listed(page, mapped).click()
    page.get_by_role("button", name="This is a door").click()
    ended(page, "Decided", "This is a door")
    again = send(mapped, "3", shut())
    assert (again["outcome"], again["conflicts"]) == ("updated", [])
    assert send(mapped, "4")["conflicts"] == []


def test_all_that_is_open_about_a_map_is_answered_as_recommended_at_once(mapped: Robot, open_page: OpenPage) -> None:
    send(mapped, "1", shut())
    send(mapped, "2")
    settings(mapped, review="ask_first")
    send(mapped, "3", OPEN_PLAN)
    assert len(questions(mapped)) == 2
    page = open_page(mapped.page)
    page.get_by_role("button", name="Answer all as recommended").click()
    expect(page.get_by_role("region", name="Questions about this map")).to_have_count(0)
    assert questions(mapped) == []
    assert causes(mapped)[:2] == ["decision", "decision"]
    (door,) = (f for f in read(mapped)["features"] if f["properties"].get("kind") == "door")
    assert door["properties"]["semantic"] == "divider"


def test_an_answer_that_was_picked_in_a_message_takes_one_tap_to_confirm(asked: Robot, open_page: OpenPage) -> None:
    page = open_page(f"{question(asked)}?answer=accept:p2")
    picked = page.get_by_role("button", name="Take the new map")
    expect(picked).to_be_focused()
    expect(page.get_by_text("Picked in your message")).to_be_visible()
    assert causes(asked) == ["edit", "created"]  # looking decides nothing
    picked.press("Enter")
    ended(page, "Decided", "Take the new map")


def test_a_new_room_is_named(mapped: Robot, open_page: OpenPage, keep: Keep) -> None:
    assert send(mapped, "1", annex())["discovered_rooms"]
    page = open_page(question(mapped, "resolved_automatically"), **PHONE)
    heading(page, "A new room was found")
    keep(page, "question-new-room-360-light")
    page.get_by_label("Name of the new room").fill("Study")
    page.get_by_role("button", name="Name the new room").tap()
    ended(page, "Decided", "Study is a room of its own")
    assert rooms(mapped) == {"Kitchen", "Bedroom", "Study"}


def test_a_new_room_that_is_none_becomes_part_of_its_neighbour_for_good(mapped: Robot, open_page: OpenPage) -> None:
    send(mapped, "1", annex())
    page = open_page(question(mapped, "resolved_automatically"))
    page.get_by_role("button", name="This is part of Kitchen").click()
    ended(page, "Decided", "This is part of Kitchen")
    assert rooms(mapped) == {"Kitchen", "Bedroom"}
    again = send(mapped, "2", annex())
    assert (again["discovered_rooms"], rooms(mapped)) == ([], {"Kitchen", "Bedroom"})


def test_a_later_mission_that_makes_a_question_pointless_leads_on_to_its_own(asked: Robot, open_page: OpenPage) -> None:
    page = open_page(question(asked))
    expect(page.get_by_text("Live", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name=KEEP)).to_be_visible()
    send(asked, "2", annex())
    ended(page, "This question is over", "Mission 2 has made it pointless")
    page.get_by_role("link", name="Room 3 would be new.").first.click()
    page.get_by_role("button", name="Take the new map").click()
    ended(page, "Decided", "The map is version 3 now")
    assert len(rooms(asked)) == 3


def test_a_question_about_a_pinned_map_that_nobody_answers_ends_at_its_deadline(
    mapped: Robot, open_page: OpenPage
) -> None:
    assert calling.put(f"{mapped.path}/pin", headers=OWNER).status_code == 200
    assert send(mapped, "1", OPEN_PLAN)["version"] == 2
    page = open_page(question(mapped))
    expect(page.get_by_role("button", name=KEEP)).to_be_visible()
    database = Database(f"sqlite:///{mapped.service.data_dir / 'stillroom.sqlite'}")
    past = datetime.now(UTC) - timedelta(seconds=1)
    with database.write() as tx:
        tx.execute(sa.update(conflict).where(conflict.c.key == questions(mapped)[0]["id"]).values(due_at=past))
    expire(database)  # as a worker does now and then
    database.dispose()
    page.get_by_role("button", name=KEEP).click()
    expect(page.get_by_role("alert").or_(page.locator("section[data-state=expired]")).first).to_be_visible()
    ended(page, "Nobody answered in time", "The map stayed as it was")
    page.get_by_role("link", name="See the history").click()
    expect(page.get_by_role("tabpanel")).to_contain_text("Nobody answered in time; the map stayed as it was.")
    assert causes(mapped) == ["edit", "created"]


def test_of_two_people_the_second_is_told_who_was_first(asked: Robot, open_page: OpenPage) -> None:
    late = open_page(question(asked))
    without_events(late)
    early, third = open_page(question(asked)), open_page(question(asked))
    expect(third.get_by_text("Live", exact=True)).to_be_visible()
    early.get_by_role("button", name="Take the new map").click()
    ended(early, "Decided", "Take the new map")
    ended(third, "Decided", "Take the new map", "by an operator")
    late.get_by_role("button", name=KEEP).click()
    ended(late, "Decided", "Take the new map", "by an operator")
    expect(late.get_by_text("Somebody else answered first.")).to_be_visible()
    assert causes(asked) == ["decision", "edit", "created"]


def test_an_own_boundary_is_drawn_where_the_robot_found_none(asked: Robot, open_page: OpenPage, keep: Keep) -> None:
    page = open_page(question(asked), **PHONE)
    page.get_by_role("button", name="Draw the boundary myself").tap()
    expect(page.get_by_role("heading", level=1)).to_have_text("Draw the boundary")
    hand = pen(page, (FIRST,))
    hand.touch((4.0, 1.0), (4.0, 1.6))
    refused = page.get_by_role("alert").filter(has_text="from the nearest wall or divider")
    expect(refused).to_be_visible()
    keep(page, "question-drawing-360-light")
    refused.get_by_role("button", name="Extend to the wall").tap()
    expect(page.get_by_role("status").filter(has_text="With this: Bedroom")).to_contain_text("Kitchen")
    page.get_by_role("button", name="Decide with these lines").tap()
    ended(page, "Decided with lines of one's own", "The map is version 3 now")
    assert rooms(asked) == {"Kitchen", "Bedroom"}
    assert send(asked, "2", OPEN_PLAN)["outcome"] == "updated"


def test_a_line_that_another_one_held_up_is_refused_with_its_place(asked: Robot, open_page: OpenPage) -> None:
    page = open_page(question(asked))
    page.get_by_role("button", name="Draw the boundary myself").click()
    page.get_by_label("Position").fill("15")
    page.get_by_role("button", name="Divide here").click()
    expect(page.get_by_role("status").filter(has_text="Room 3")).to_be_visible()
    page.get_by_role("combobox", name="Room").select_option("Room 3")
    page.get_by_role("combobox", name="Line").select_option("level")
    page.get_by_label("Position").fill("50")
    page.get_by_role("button", name="Divide here").click()
    expect(page.get_by_role("status").filter(has_text="Room 4")).to_be_visible()
    page.get_by_role("button", name="Remove Line 1").click()
    expect(page.get_by_role("alert").filter(has_text="That does not work yet")).to_contain_text("ends in mid-air")
    expect(page.get_by_role("button", name="Decide with these lines")).to_be_disabled()
    page.get_by_role("button", name="Back to the answers").click()
    expect(page.get_by_role("button", name=KEEP)).to_be_visible()
    assert len(questions(asked)) == 1


def test_a_mission_from_upstairs_is_answered_among_the_questions(robot: Robot, open_page: OpenPage, keep: Keep) -> None:
    robot.upload("0", as_grey(HOME.grid.cells), **FRAME)
    robot.upload("1", as_grey(MIRRORED.grid.cells), **FRAME)
    page = open_page(question(robot), **PHONE)
    heading(page, "New floor, or an existing one")
    keep(page, "question-parked-360-light")
    page.get_by_role("button", name="A new floor").tap()
    page.get_by_role("textbox", name="Name of the new floor").fill("Upstairs")
    page.get_by_role("button", name="Make the new floor").tap()
    ended(page, "Decided", "Mission 1 was placed on upstairs")
    assert read(robot)["version"] == 1


def test_after_a_reset_one_tap_brings_rooms_and_zones_back(robot: Robot, open_page: OpenPage) -> None:
    robot.upload("0", as_grey(MIRRORED.grid.cells), **FRAME)
    zone = [[1.0, 1.0], [2.0, 1.0], [2.0, 1.5], [1.0, 1.5]]
    robot.edit(1, {"op": "add_restriction", "kind": "no_go", "shape": zone})
    before = rooms(robot)
    grid = turned(MIRRORED.grid, Pose(5.0, 3.0, pi / 2))
    o = grid.frame.origin
    frame = {"resolution": grid.frame.resolution, "origin": [o.x, o.y, o.yaw]}
    robot.upload("after-reset", as_grey(grid.cells), sequence=0, epoch=1, **frame)
    page = open_page("/questions")
    listed(page, robot).click()
    expect(page.get_by_text("that brings back 2 rooms and 1 restriction")).to_be_visible()
    page.get_by_role("button", name=re.compile("^ground ")).click()
    ended(page, "Decided", "Mission after-reset was placed on ground")
    assert rooms(robot) == before
    (kept,) = (f for f in read(robot)["features"] if f["properties"]["semantic"] == "restriction")
    assert kept["properties"]["placement"] == "placed"


def test_a_mission_that_belongs_nowhere_is_ignored(robot: Robot, open_page: OpenPage) -> None:
    robot.upload("0", as_grey(HOME.grid.cells), **FRAME)
    robot.upload("1", as_grey(MIRRORED.grid.cells), **FRAME)
    page = open_page(question(robot))
    page.get_by_role("button", name="Ignore this mission").click()
    ended(page, "Decided", "Ignore this mission")
    page.goto(robot.page)
    shown(page, 1)
