"""Server-sent events."""

import asyncio
import json
from typing import Any

import pytest

from stillroom.api import events
from stillroom.errors import Unauthenticated
from stillroom.pipeline.conflicts import ConflictKind
from stillroom.service.access import OPERATOR, Person, Principal, Robot
from tests.conflicts import Core, expect, listed, rejected, send, told
from tests.conftest import RobotCaller, Service
from tests.homes import changed, home

KINDS: tuple[ConflictKind, ...] = ("room_recall", "room_precision", "shape", "drift")


async def first(
    service: Service, who: Principal, count: int, last: int = 0, robot: str | None = None, map_name: str | None = None
) -> list[dict[str, Any]]:
    """The first `count` events of a stream."""
    stream = events._stream(service.http.app.state.parts, who, lambda: who, robot, map_name, last)  # type: ignore[attr-defined]
    found: list[dict[str, Any]] = []
    async with asyncio.timeout(30):
        async for message in stream:
            fields = dict(line.split(": ", 1) for line in message.strip().splitlines())
            if "data" in fields:
                found.append(json.loads(fields["data"]) | {"id": int(fields["id"]), "event": fields["event"]})
            if len(found) >= count:
                break
    await stream.aclose()  # type: ignore[attr-defined]
    return found


@pytest.mark.usefixtures("mapped")
def test_a_mission_that_was_taken_tells_of_its_version_and_of_itself(service: Service) -> None:
    version, mission = asyncio.run(first(service, OPERATOR, 2))
    assert (version["event"], version["version"], version["cause"]) == ("version", 1, "created")
    assert (mission["event"], mission["mission"], mission["outcome"]) == ("mission", "0", "created")
    assert (mission["robot"], mission["map"]) == ("RB-1", "ground")
    assert mission["id"] > version["id"]


def test_a_stream_goes_on_after_the_last_event_that_was_seen(service: Service, mapped: RobotCaller) -> None:
    version, mission = asyncio.run(first(service, OPERATOR, 2))
    service.operator.edit(mapped.path(), 1, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    (edit,) = asyncio.run(first(service, OPERATOR, 1, last=mission["id"]))
    assert (edit["event"], edit["cause"], edit["version"]) == ("version", "edit", 2)
    assert edit["id"] > version["id"]


def test_a_stream_that_waits_hears_of_a_change_at_once(service: Service, mapped: RobotCaller) -> None:
    async def wait_and_edit() -> dict[str, Any]:
        known = (await first(service, OPERATOR, 2))[-1]["id"]
        waiting = asyncio.create_task(first(service, OPERATOR, 1, last=known))
        await asyncio.sleep(0)
        edit = {"op": "rename_room", "id": "r1", "name": "Kitchen"}
        await asyncio.to_thread(service.operator.edit, mapped.path(), 1, edit)
        return (await waiting)[0]

    assert asyncio.run(wait_and_edit())["cause"] == "edit"


@pytest.mark.parametrize("who", [OPERATOR, Person("ann@example.org"), Robot("anns")])
def test_nobody_hears_of_what_they_may_not_see(service: Service, who: Principal) -> None:
    nobodys, anns, bobs = (
        service.add_robot(*named)
        for named in (("free", None), ("anns", "ann@example.org"), ("bobs", "bob@example.org"))
    )
    for robot in (bobs, nobodys, anns, bobs):
        robot.upload("0")
    own = "free" if who == OPERATOR else "anns"
    assert {event["robot"] for event in asyncio.run(first(service, who, 2))} == {own}


def test_a_stream_can_be_narrowed_to_a_robot_and_to_a_map(service: Service, mapped: RobotCaller) -> None:
    other = service.add_robot("RB-2")
    other.upload("0", map_name="upstairs")
    mapped.upload("0", map_name="upstairs")
    mapped.upload("1", home(shift=(1, 0)))
    of_other = asyncio.run(first(service, OPERATOR, 2, robot="RB-2"))
    assert {event["robot"] for event in of_other} == {"RB-2"}
    upstairs = asyncio.run(first(service, OPERATOR, 4, map_name="upstairs"))
    assert [(event["robot"], event["map"]) for event in upstairs[::2]] == [("RB-2", "upstairs"), ("RB-1", "upstairs")]


@pytest.mark.parametrize("ended", ["signed out", "switched off", "no operator any more"])
def test_a_stream_tells_nothing_more_when_its_credential_has_ended(service: Service, ended: str) -> None:
    robot = service.add_robot()
    known = [OPERATOR]

    def who_now() -> Principal:
        if not known:
            raise Unauthenticated(ended)
        return known[0]

    async def follow() -> list[str]:
        parts = service.http.app.state.parts  # type: ignore[attr-defined]
        stream = events._stream(parts, OPERATOR, who_now, None, None, 0)
        began = [await anext(stream)]
        await asyncio.to_thread(robot.upload, "0")
        known[:] = [Person("olga@example.org")] if ended == "no operator any more" else []
        asyncio.get_running_loop().call_later(1, service.http.app.state.parts.signals.close)  # type: ignore[attr-defined]
        async with asyncio.timeout(30):
            return began + [message async for message in stream if "data" in message]

    assert len(asyncio.run(follow())) == 1


def test_the_stream_needs_a_caller(service: Service) -> None:
    assert service.stranger.get("/api/v1/events").status_code == 401


def resumed(service: Service, whole: list[dict[str, Any]]) -> None:
    """Whoever lost the connection after any of the events gets all that follow, in order, and none twice."""
    for seen, last in enumerate(whole[:-1], 1):
        rest = asyncio.run(first(service, OPERATOR, len(whole) - seen, last=last["id"]))
        assert rest == whole[seen:]


def test_conflicts_that_open_and_close_are_in_the_stream_and_none_is_missed_after_a_break(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    core.planned |= {
        "1": rejected("c1"),
        "2": rejected("c2", kind="drift"),
        "3": rejected("c3", kind="wrong_map", rooms=()),
    }
    responses = {"1": None, "2": "accept", "3": "temporary"}
    for mission, response in responses.items():
        send(mapped, mission)
        if response is not None:
            url = f"{mapped.path()}/conflicts/c{mission}/decision"
            expect(service.operator.request("POST", url, json={"response": response}))
    whole = asyncio.run(first(service, OPERATOR, len(told(service))))
    ids = [event["id"] for event in whole]
    assert ids == sorted(set(ids))
    seen = [(event["conflict"], event["state"]) for event in whole if event["event"] == "conflict"]
    opened = [(key, "open") for key in ("c1", "c2", "c3")]
    assert [pair for pair in seen if pair[1] == "open"] == opened
    assert ("c2", "accepted") in seen
    assert ("c3", "rejected") in seen
    assert {key for key, _ in seen} == {"c1", "c2", "c3"}
    resumed(service, whole)


def test_a_parked_mission_and_its_question_are_in_the_stream(service: Service, mapped: RobotCaller) -> None:
    assert send(mapped, "1", changed("other floor"))["outcome"] == "parked"
    (key,) = listed(mapped, "open")
    placed = {"map": "upstairs"}
    answer = service.operator.request("POST", f"{mapped.path()}/missions/1/placement", json=placed)
    assert answer.status_code in (200, 202), answer.text
    service.worker.settle()
    whole = asyncio.run(first(service, OPERATOR, len(told(service))))
    of_mission = [event for event in whole if event["mission"] == "1"]
    assert [event["outcome"] for event in of_mission if event["event"] == "mission"] == ["parked"]
    assert [(e["conflict"], e["state"]) for e in whole if e["event"] == "conflict"] == [
        (key, "open"),
        (key, "accepted"),
    ]
    resumed(service, whole)


def test_a_stream_that_was_cut_while_things_happened_goes_on_where_it_was(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    """Each connection ends after one event, whatever happens meanwhile."""
    core.planned |= {str(number): rejected(f"c{number}", kind=kind) for number, kind in enumerate(KINDS, 1)}
    last, seen = asyncio.run(first(service, OPERATOR, 2))[-1]["id"], list[str]()
    for number in range(1, len(KINDS) + 1):
        send(mapped, str(number))
        (event,) = asyncio.run(first(service, OPERATOR, 1, last=last))
        last = event["id"]
        seen.append(event["event"])
    everything = [event["kind"] for event in told(service)][2:]
    rest = asyncio.run(first(service, OPERATOR, len(everything) - len(seen), last=last))
    assert seen + [event["event"] for event in rest] == everything
