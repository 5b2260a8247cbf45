"""The API of what people are told."""

import pytest

from stillroom.settings import MailServer
from tests.conflicts import expect
from tests.conftest import Caller, RobotCaller, Service
from tests.telling import allow, owner

BASE = "/api/v1/notifications"
SERVER = MailServer("127.0.0.1", 25, "none", None, None, "maps@example.org")


@pytest.fixture
def ann(service: Service) -> Caller:
    return owner(service, "ann@example.org")


def test_without_a_mail_server_the_service_says_so(ann: Caller) -> None:
    assert not expect(ann.get(BASE))["email"]["available"]
    refused = ann.request("PUT", f"{BASE}/email", json={"address": "ann@example.org"})
    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/unavailable")


def test_everybody_has_their_own_choice(service: Service, ann: Caller) -> None:
    everything = ["conflict", "parked", "room"]
    bob = owner(service, "bob@example.org")
    expect(ann.request("PATCH", BASE, json={"email": [], "push": ["room", "conflict", "room"]}))
    told = expect(ann.get(BASE))
    assert (told["email"]["kinds"], told["push"]["kinds"]) == ([], ["conflict", "room"])
    for other in (bob, service.operator):
        shown = expect(other.get(BASE))
        assert (shown["email"]["kinds"], shown["push"]["kinds"]) == (everything, everything)
    expect(ann.request("PATCH", BASE, json={"email": everything}))
    assert expect(ann.get(BASE))["push"]["kinds"] == ["conflict", "room"]
    assert expect(service.operator.get(BASE))["email"]["suggested"] is None


def test_all_machines_have_one_public_key(service: Service, ann: Caller) -> None:
    keys = {expect(caller.get(BASE))["push"]["public_key"] for caller in (ann, service.operator, ann)}
    assert len(keys) == 1


def test_robots_are_told_nothing(robot: RobotCaller) -> None:
    refusals = [
        robot.request("PATCH", BASE, json={"email": []}),
        robot.request("DELETE", f"{BASE}/email"),
        robot.request("DELETE", f"{BASE}/push/subscriptions/push_1"),
        robot.request("POST", f"{BASE}/push/subscriptions/push_1/test"),
        robot.get(BASE),
    ]
    assert {answer.status_code for answer in refusals} == {403}


@pytest.mark.parametrize(
    "address",
    [
        "",
        "ann",
        "ann@",
        "@example.org",
        "ann@example.org, bob@example.org",
        "ann@example.org\nBcc: bob@example.org",
        "a b@example.org",
        "<ann@example.org>",
    ],
)
def test_what_is_no_address_is_refused(service: Service, ann: Caller, address: str) -> None:
    allow(service, mail=SERVER)
    refused = expect(ann.request("PUT", f"{BASE}/email", json={"address": address}), 422)
    assert [fault["pointer"] for fault in refused["errors"]] == ["/address"]
    assert expect(ann.get(BASE))["email"]["address"] is None


def test_an_address_is_set_changed_and_removed(service: Service, ann: Caller) -> None:
    allow(service, mail=SERVER)
    for address in ("ann@example.org", "ann@example.org", "ann.new+maps@example.org"):
        shown = expect(ann.request("PUT", f"{BASE}/email", json={"address": address}), 202)
        assert (shown["email"]["address"], shown["email"]["confirmed"]) == (address, False)
    assert ann.request("DELETE", f"{BASE}/email").status_code == 204
    assert ann.request("DELETE", f"{BASE}/email").status_code == 204
    assert expect(ann.get(BASE))["email"]["address"] is None


def test_the_first_browser_brings_its_language_and_a_person_s_choice_stays(service: Service, ann: Caller) -> None:
    allow(service, mail=SERVER)
    assert expect(ann.get(BASE))["language"] is None
    for language, kept in ((None, None), ("de", "de"), ("en", "de")):
        shown = expect(ann.request("PUT", f"{BASE}/email", json={"address": "ann@a.org", "language": language}), 202)
        assert shown["language"] == kept
    assert expect(ann.request("PATCH", BASE, json={"language": "en"}))["language"] == "en"
    assert expect(ann.request("PATCH", BASE, json={"email": []}))["language"] == "en"
    expect(ann.request("PATCH", BASE, json={"language": "fr"}), 422)
    assert expect(service.operator.get(BASE))["language"] is None


def test_another_site_can_not_change_what_somebody_is_told(service: Service, ann: Caller) -> None:
    elsewhere = {"Sec-Fetch-Site": "cross-site"}
    assert ann.request("PATCH", BASE, elsewhere, json={"email": []}).status_code == 403
    assert ann.request("POST", "/api/v1/webhooks", elsewhere, json={"url": "https://evil.example/"}).status_code == 403
    assert expect(service.operator.get(BASE))["email"]["kinds"] == ["conflict", "parked", "room"]


@pytest.mark.parametrize("page", ["confirm", "stop"])
def test_a_link_that_is_not_ours_is_explained_on_a_page(service: Service, page: str) -> None:
    for token in ("", "x", "x.y", "W10.W10", "%00", "<script>alert(1)</script>"):
        answer = service.stranger.request("POST", f"/email/{page}", params={"token": token})
        assert (answer.status_code, "The link is damaged" in answer.text) == (422, True), token
        shown = service.stranger.request("GET", f"/email/{page}", params={"token": token})
        assert "<script>" not in shown.text
        assert shown.headers["Referrer-Policy"] == "no-referrer"
