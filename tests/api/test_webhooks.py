"""The API of webhooks: whose they are, and what is refused."""

from typing import Any

import pytest

from stillroom.service.webhooks import MOST
from tests.conflicts import expect
from tests.conftest import Caller, RobotCaller, Service
from tests.telling import Json, add_webhook, owner

URL = "https://hooks.example.org/stillroom"
BASE = "/api/v1/webhooks"


@pytest.fixture
def ann(service: Service) -> Caller:
    return owner(service, "ann@example.org")


@pytest.fixture
def bob(service: Service) -> Caller:
    return owner(service, "bob@example.org")


def test_a_webhook_is_added_shown_changed_and_removed(ann: Caller) -> None:
    made = add_webhook(ann, URL, types=["map.updated", "conflict.opened", "map.updated"], label=" Home ")
    secret = made.pop("secret")
    assert secret.startswith("whsec_")
    assert made == {
        "id": made["id"],
        "url": URL,
        "types": ["conflict.opened", "map.updated"],
        "label": "Home",
        "scope": "own",
        "enabled": True,
        "disabled_reason": None,
        "created_at": made["created_at"],
        "delivered_at": None,
        "failing_since": None,
        "failures": 0,
    }
    path = f"{BASE}/{made['id']}"
    assert expect(ann.get(path)) == made
    assert expect(ann.get(BASE)) == {"items": [made], "next": None}
    off = expect(ann.request("PATCH", path, json={"enabled": False, "label": "Off"}))
    assert (off["enabled"], off["disabled_reason"], off["label"]) == (False, "It was switched off.", "Off")
    assert expect(ann.request("PATCH", path, json={"url": f"{URL}/2", "enabled": True})) == made | {
        "url": f"{URL}/2",
        "label": "Off",
    }
    assert expect(ann.request("PATCH", path, json={}))["url"] == f"{URL}/2"
    assert ann.request("DELETE", path).status_code == 204
    assert ann.get(path).status_code == 404
    assert secret not in ann.get(BASE).text


def test_webhooks_belong_to_who_added_them(service: Service, ann: Caller, bob: Caller) -> None:
    made = add_webhook(ann, URL)
    path = f"{BASE}/{made['id']}"
    for other in (bob, service.operator):
        assert expect(other.get(BASE))["items"] == []
        for method, where in (
            ("GET", ""),
            ("PATCH", ""),
            ("DELETE", ""),
            ("POST", "/secret"),
            ("POST", "/test"),
            ("GET", "/deliveries"),
            ("POST", "/deliveries/1/replay"),
        ):
            answer = other.request(method, path + where, **({"json": {}} if method == "PATCH" else {}))
            assert answer.status_code == 404, (method, where)
    assert expect(ann.get(path))["id"] == made["id"]


def test_robots_add_no_webhooks(robot: RobotCaller) -> None:
    assert robot.get(BASE).status_code == 403
    assert robot.request("POST", BASE, json={"url": URL}).status_code == 403


def test_only_operators_are_told_about_the_fleet(service: Service, ann: Caller) -> None:
    wanted = {"url": URL, "scope": "fleet"}
    assert expect(ann.request("POST", BASE, json=wanted), 403)["type"] == "/problems/forbidden"
    assert expect(service.operator.request("POST", BASE, json=wanted), 201)["scope"] == "fleet"


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({"url": "http://hooks.example.org/"}, "/url"),
        ({"url": "https://127.0.0.1/"}, "/url"),
        ({"url": "https://[::ffff:169.254.169.254]/latest"}, "/url"),
        ({"url": "https://user:pass@example.org/"}, "/url"),
        ({"url": "https://example.org/ä"}, "/url"),
        ({"url": "https://example.org/\r\nX: y"}, "/url"),
        ({"url": f"https://example.org/{'x' * 2000}"}, "/url"),
        ({"url": "file:///etc/passwd"}, "/url"),
        ({"url": URL, "types": []}, "/types"),
        ({"url": URL, "types": ["everything"]}, "/types/0"),
        ({"url": URL, "scope": "all"}, "/scope"),
        ({"url": URL, "label": "a\nb"}, "/label"),
        ({"url": URL, "secret": "mine"}, "/secret"),
        ({}, "/url"),
    ],
)
def test_what_can_not_be_a_webhook_is_refused_and_says_where(ann: Caller, body: Json, pointer: str) -> None:
    refused = expect(ann.request("POST", BASE, json=body), 422)
    assert [fault["pointer"] for fault in refused["errors"]] == [pointer]
    assert expect(ann.get(BASE))["items"] == []


def test_a_webhook_is_not_changed_to_an_address_that_nothing_may_be_sent_to(ann: Caller) -> None:
    made = add_webhook(ann, URL)
    refused: list[Json] = [{"url": "https://10.0.0.1/"}, {"types": []}, {"scope": "fleet"}]
    for change in refused:
        assert ann.request("PATCH", f"{BASE}/{made['id']}", json=change).status_code == 422
    assert expect(ann.get(f"{BASE}/{made['id']}"))["url"] == URL


def test_nobody_has_more_than_twenty(ann: Caller, bob: Caller) -> None:
    for number in range(MOST):
        add_webhook(ann, f"{URL}/{number}")
    assert "20 webhooks" in expect(ann.request("POST", BASE, json={"url": URL}), 422)["detail"]
    add_webhook(bob, URL)


def test_lists_come_in_pages(ann: Caller) -> None:
    made = [add_webhook(ann, f"{URL}/{number}")["id"] for number in range(3)]
    first = ann.get(f"{BASE}?limit=2")
    rest = ann.get(f"{BASE}?limit=2&cursor={first.json()['next']}").json()
    assert [item["id"] for item in first.json()["items"] + rest["items"]] == made
    assert rest["next"] is None
    assert 'rel="next"' in first.headers["Link"]
    path = f"{BASE}/{made[0]}"
    sent = [expect(ann.request("POST", f"{path}/test"), 202)["id"] for _ in range(3)]
    newest = ann.get(f"{path}/deliveries?limit=2").json()
    oldest = ann.get(f"{path}/deliveries?limit=2&cursor={newest['next']}").json()
    assert [item["id"] for item in newest["items"] + oldest["items"]] == sent[::-1]


def test_a_delivery_that_is_not_there_is_not_sent_again(ann: Caller, bob: Caller) -> None:
    anns, bobs = add_webhook(ann, URL), add_webhook(bob, URL)
    test: Any = expect(bob.request("POST", f"{BASE}/{bobs['id']}/test"), 202)
    assert ann.request("POST", f"{BASE}/{anns['id']}/deliveries/{test['id']}/replay").status_code == 404
    assert ann.request("POST", f"{BASE}/{anns['id']}/deliveries/0/replay").status_code == 422


def test_a_webhook_that_was_switched_off_is_sent_nothing(ann: Caller) -> None:
    path = f"{BASE}/{add_webhook(ann, URL)['id']}"
    queued = expect(ann.request("POST", f"{path}/test"), 202)
    assert queued["state"] == "waiting"
    expect(ann.request("PATCH", path, json={"enabled": False}))
    (dropped,) = expect(ann.get(f"{path}/deliveries"))["items"]
    assert (dropped["state"], dropped["reason"]) == ("dead", "The webhook was switched off.")
    assert ann.request("POST", f"{path}/test").status_code == 422
