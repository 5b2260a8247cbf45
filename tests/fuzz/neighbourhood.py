"""Three homes with everything in them that the API can show, and one of each kind of caller."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from stillroom.service.accounts import new_login_link
from stillroom.store import people
from stillroom.store.clock import now
from tests.conflicts import expect
from tests.conftest import Caller, RobotCaller, Service
from tests.homes import home

Json = dict[str, Any]
STILL: Json = {"tracking": {"transform": [0.0, 0.0, 0.0]}, "firmware": "3.2.1", "model": "S9"}
PEOPLE = {
    "owner": "ann@example.org",
    "member": "mel@example.org",
    "viewer": "vera@example.org",
    "engineer": "erik@example.org",
    "neighbour": "bob@example.org",
}
PRIVATE = "Zz9Private"
"""In everything that Bob has written; nobody but Bob and his robot may ever be told."""


@dataclass(frozen=True)
class Home:
    robot: RobotCaller
    owner: str | None
    names: Mapping[str, Sequence[str]]
    """What path parameters may be, of this home."""


@dataclass(frozen=True)
class Neighbourhood:
    homes: Sequence[Home]
    callers: Mapping[str, Caller]
    bobs: frozenset[str]
    """Callers that may see what is Bob's."""


def settle(service: Service) -> Neighbourhood:
    """Bob's home holds PRIVATE wherever a person can write something."""
    free = _move_in(service, "free", None, "Flur")
    ann = _move_in(service, "anns", "ann@example.org", "Diele")
    bob = _move_in(service, "bobs", "bob@example.org", PRIVATE)
    others = {
        "stranger": service.stranger,
        "robot": ann.robot,
        "operator": service.operator,
        "neighbour's robot": bob.robot,
    }
    with service.database.write() as tx:
        moment = now(tx)
        for name, role in (("member", "member"), ("viewer", "viewer")):
            people.join(tx, PEOPLE["owner"], PEOPLE[name], role, moment)
        people.find_or_add(tx, PEOPLE["engineer"], moment)
        people.change(tx, PEOPLE["engineer"], {"duty": "engineer"})
    bobs = frozenset({"neighbour", "neighbour's robot"})
    return sign_in_again(service, Neighbourhood((free, ann, bob), others, bobs))


def sign_in_again(service: Service, before: Neighbourhood) -> Neighbourhood:
    """People who were signed out have new sessions."""
    sessions = {name: signed_in(service, email) for name, email in PEOPLE.items()}
    return replace(before, callers={**before.callers, **sessions})


def signed_in(service: Service, owner: str | None = None) -> Caller:
    answer = service.http.get(f"/login?token={new_login_link(service.database, owner)}", follow_redirects=False)
    cookie = answer.headers["Set-Cookie"].partition(";")[0]
    service.http.cookies.clear()
    return Caller(service.http, {"Cookie": cookie, "Sec-Fetch-Site": "same-origin"})


def _move_in(service: Service, robot_id: str, owner: str | None, word: str) -> Home:
    """Missions that were taken and one that was not; a question, and everything else that a person can make."""
    robot = service.add_robot(robot_id, owner)
    person = service.operator if owner is None else signed_in(service, owner)
    path = robot.path()
    expect(robot.upload("0", **STILL), 201)
    lines: list[Json] = [
        {"op": "rename_room", "id": "r1", "name": f"{word} room"},
        {"op": "add_restriction", "kind": "no_go", "shape": [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0]]},
        {"op": "add_divider", "line": [[4.0, 1.5], [8.0, 1.5]]},
    ]
    expect(person.edit(path, 1, *lines))
    expect(robot.upload("1", home(shift=(1, 0)), base_version=2, **STILL), 201)
    expect(robot.upload("2", home(wall_between=False), base_version=3, **STILL), 201)
    expect(person.request("PATCH", path, json={"name": f"{word} floor"}))
    expect(person.request("PATCH", f"{path}/versions/1", json={"name": f"{word} first"}))
    webhook = {"url": f"https://hooks.example.org/{word}", "label": f"{word} hook"}
    made = expect(person.request("POST", "/api/v1/webhooks", json=webhook), 201)
    expect(person.request("POST", f"/api/v1/webhooks/{made['id']}/test"), 202)
    delivery = expect(person.get(f"/api/v1/webhooks/{made['id']}/deliveries"))["items"][0]["id"]
    conflicts = [one["id"] for one in expect(robot.get(f"{path}/conflicts"))["items"]]
    names = {
        "robot": [robot_id],
        "map": ["ground"],
        "version": ["1", "2", "3"],
        "other": ["1", "2"],
        "mission": ["0", "1", "2"],
        "conflict": conflicts or ["c1"],
        "proposal": ["p1", "p2"],
        "room": ["r1", "r2"],
        "webhook": [made["id"]],
        "delivery": [str(delivery)],
    }
    return Home(robot, owner, names)
