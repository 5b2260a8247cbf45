"""Ids of what is another's open nothing, also in a path of one's own."""

from typing import Any

import pytest
from argon2 import PasswordHasher

from stillroom.service.people import passwords
from tests.conflicts import Core, rejected, send
from tests.conftest import Caller, RobotCaller, Service
from tests.people.browsers import ANN, BOB, Browser, add_account, by_link, posting

Json = dict[str, Any]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(passwords, "HASHER", PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))


def test_nobody_reads_or_changes_what_has_the_id_of_anothers(service: Service) -> None:
    """Every kind of id that the API gives out: Ann's, tried by Bob with all the rights that he has over his own."""
    anns = service.add_robot("anns", ANN)
    add_account(service, ANN)
    ann, bob = by_link(service, ANN), by_link(service, BOB)
    things = _anns_things(service, ann)
    before = {path: ann.get(path).json() for path in LISTS}
    for method, path, body in _calls(things):
        answer = bob.request(method, path, json=body)
        assert answer.status_code in (403, 404), (method, path, answer.text)
        assert ANN not in answer.text
    assert {path: ann.get(path).json() for path in LISTS} == before
    assert anns.upload("0").status_code == 201


LISTS = (
    "/api/v1/webhooks",
    "/api/v1/notifications",
    "/api/v1/account/tokens",
    "/api/v1/account/sessions",
    "/api/v1/household",
    "/api/v1/grants",
    "/api/v1/robots/anns",
)


def _anns_things(service: Service, ann: Browser) -> Json:
    hook = ann.post("/api/v1/webhooks", url="https://hooks.example.org/", label="", scope="own", types=None)
    assert hook.status_code == 201, hook.text
    delivery = ann.post(f"/api/v1/webhooks/{hook.json()['id']}/test")
    asked = service.operator.request(
        "POST", "/api/v1/fleet/grants", json={"robot": "anns", "reason": "to see why it failed", "hours": 1}
    )
    assert asked.status_code == 201, asked.text
    with posting(service):
        home = ann.post("/api/v1/household/invitations", email="mel@example.org", role="member").json()
    keys = {
        "p256dh": "BCVxsr7N_eNgVRqvHtD0zTZsEc6-VV-JvLexhqUzORcxaOzi6-AYWXvTBHm4bjyPjs7Vd8pZGH6SRpkNtoIAiw4",
        "auth": "BTBZMqHH6r4Tts7J_aSIgg",
    }
    push = "/api/v1/notifications/push/subscriptions"
    browser = ann.post(push, endpoint="https://push.example.org/ann", keys=keys, label="")
    assert browser.status_code == 201, browser.text
    return {
        "subscription": browser.json()["id"],
        "webhook": hook.json()["id"],
        "delivery": delivery.json()["id"],
        "grant": asked.json()["id"],
        "token": ann.post("/api/v1/account/tokens", name="mine", scopes=["maps:read"]).json()["id"],
        "session": ann.get("/api/v1/account/sessions").json()["items"][0]["id"],
        "invitation": home["invitations"][0]["id"],
    }


def _calls(things: Json) -> list[tuple[str, str, Json | None]]:
    hook = f"/api/v1/webhooks/{things['webhook']}"
    return [
        ("GET", hook, None),
        ("PATCH", hook, {"enabled": False}),
        ("DELETE", hook, None),
        ("POST", f"{hook}/secret", None),
        ("POST", f"{hook}/test", None),
        ("GET", f"{hook}/deliveries", None),
        ("POST", f"{hook}/deliveries/{things['delivery']}/replay", None),
        ("POST", f"/api/v1/grants/{things['grant']}/answer", {"answer": "grant"}),
        ("DELETE", f"/api/v1/grants/{things['grant']}", None),
        ("DELETE", f"/api/v1/account/tokens/{things['token']}", None),
        ("DELETE", f"/api/v1/account/sessions/{things['session']}", None),
        ("DELETE", f"/api/v1/household/invitations/{things['invitation']}", None),
        ("DELETE", f"/api/v1/notifications/push/subscriptions/{things['subscription']}", None),
        ("POST", f"/api/v1/notifications/push/subscriptions/{things['subscription']}/test", None),
        ("GET", "/api/v1/robots/anns/archive", None),
        ("GET", "/api/v1/robots/anns", None),
        ("PATCH", "/api/v1/robots/anns", {"name": "Mine"}),
        ("POST", "/api/v1/robots/anns/token", None),
        ("DELETE", "/api/v1/robots/anns/token", None),
        ("POST", "/api/v1/robots/anns/release", None),
    ]


def test_a_path_of_ones_own_map_leads_to_nothing_of_another_map(service: Service, core: Core) -> None:
    mine, theirs = service.add_robot("mine", BOB), service.add_robot("theirs", ANN)
    assert mine.upload("0").status_code == 201
    for mission in ("0", "7"):
        assert theirs.upload(mission).status_code == 201
    core.planned |= {"8": rejected("c8")}
    send(theirs, "8")
    bob = by_link(service, BOB)
    key = theirs_conflict(service, theirs)
    for path in (
        "missions/7",
        "missions/7/grid.png",
        "missions/7/cells.png",
        "versions/2",
        "versions/2/grid.png",
        "versions/1/diff/2",
        f"conflicts/{key}",
        f"conflicts/{key}/sensed",
        f"conflicts/{key}/proposals/p1",
    ):
        assert bob.get(f"{mine.path()}/{path}").status_code == 404, path
    decided = bob.post(f"{mine.path()}/conflicts/{key}/decision", response="accept", proposal="p1")
    assert decided.status_code == 404


def theirs_conflict(service: Service, robot: RobotCaller) -> str:
    ann = Caller(service.http, robot.headers)
    (found,) = ann.get(f"{robot.path()}/conflicts").json()["items"]
    key: str = found["id"]
    return key
