"""Web Push, as a browser and its push service see it: encrypted for the one, signed for the other."""

import json
import os
from base64 import urlsafe_b64decode
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from urllib.parse import urlsplit

import http_ece
import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from py_vapid import Vapid02

from stillroom.service.messages.keys import decode_base64url, encode_base64url
from stillroom.settings import Messaging, Outbound
from tests.conflicts import Core, expect, rejected, send
from tests.conftest import Caller, RobotCaller, Service
from tests.homes import changed
from tests.telling import Json, Receiver, Request, allow, answering, delivering, hasten, owner, receiving

pytestmark = pytest.mark.parametrize("engine", ["sqlite"])
ANN = "ann@example.org"
SUBSCRIPTIONS = "/api/v1/notifications/push/subscriptions"


@dataclass
class Browser:
    """Has keys of its own, and a push service that keeps what is sent to it."""

    service: Receiver
    path: str = "/push/1"
    key: ec.EllipticCurvePrivateKey = field(default_factory=lambda: ec.generate_private_key(ec.SECP256R1()))
    auth: bytes = field(default_factory=lambda: os.urandom(16))

    @property
    def endpoint(self) -> str:
        return f"http://127.0.0.1:{self.service.port}{self.path}"

    def subscription(self) -> Json:
        point = self.key.public_key().public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
        keys = {"p256dh": encode_base64url(point), "auth": encode_base64url(self.auth)}
        return {"endpoint": self.endpoint, "expirationTime": None, "keys": keys}

    def subscribe(self, caller: Caller, label: str = "") -> Json:
        return expect(caller.request("POST", SUBSCRIPTIONS, json=self.subscription() | {"label": label}), 201)

    def read(self, request: Request) -> Json:
        """As the browser does; nobody else can."""
        assert request.headers["content-encoding"] == "aes128gcm"
        plain = http_ece.decrypt(request.body, private_key=self.key, auth_secret=self.auth, version="aes128gcm")
        found: Json = json.loads(plain)
        return found

    @property
    def shown(self) -> list[Json]:
        return [self.read(request) for request in self.service.requests if request.path == self.path]


@pytest.fixture
def device() -> Iterator[Browser]:
    with receiving() as push_service:
        push_service.behaviour = answering(201)
        yield Browser(push_service)


@pytest.fixture
def messaging(service: Service) -> Messaging:
    return allow(service)


@pytest.fixture
def anns(service: Service) -> RobotCaller:
    robot = service.add_robot("RB-1", ANN)
    robot.upload("0")
    return robot


def push_of(caller: Caller) -> Json:
    found: Json = expect(caller.get("/api/v1/notifications"))["push"]
    return found


def test_a_question_reaches_the_browser_and_nobody_else_can_read_it(
    service: Service, messaging: Messaging, device: Browser, anns: RobotCaller, core: Core
) -> None:
    ann = owner(service, ANN)
    made = device.subscribe(ann, "Firefox on Linux")
    assert push_of(ann)["subscriptions"] == [made]
    core.planned["1"] = rejected("c1")
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        messenger.settle()
        hasten(service)
        messenger.settle()
    page = "/robots/RB-1/maps/ground/conflicts/c1"
    assert device.shown == [
        {
            "kind": "conflict",
            "title": "ground: a question about Room r1",
            "body": device.shown[0]["body"],
            "url": page,
            "tag": "RB-1/ground",
            "count": 1,
            "actions": [
                {"title": "Take the new map", "url": f"{page}?answer=accept:p1"},
                {"title": "Keep Room r1 as it was", "url": f"{page}?answer=accept:p2"},
            ],
        }
    ]
    assert device.shown[0]["body"].startswith("59 % of Room r1 is gone.")
    (request,) = device.service.requests
    assert b"Room" not in request.body
    with pytest.raises(http_ece.ECEException):
        Browser(device.service, key=ec.generate_private_key(ec.SECP256R1()), auth=device.auth).read(request)
    assert len(request.body) <= 4096
    assert (request.headers["ttl"], request.headers["urgency"]) == (str(7 * 24 * 3600), "normal")
    assert len(request.headers["topic"]) == 32
    assert push_of(ann)["subscriptions"][0]["delivered_at"] is not None


def test_the_push_service_knows_who_sends(service: Service, messaging: Messaging, device: Browser) -> None:
    ann = owner(service, ANN)
    made = device.subscribe(ann)
    assert ann.request("POST", f"{SUBSCRIPTIONS}/{made['id']}/test").status_code == 202
    with delivering(service, messaging) as messenger:
        messenger.settle()
    (request,) = device.service.requests
    assert Vapid02.verify(request.headers["authorization"])
    scheme, _, rest = request.headers["authorization"].partition(" ")
    said = dict(part.split("=", 1) for part in rest.split(","))
    claims = json.loads(decode_base64url(said["t"].split(".")[1]))
    assert scheme == "vapid"
    assert said["k"] == push_of(ann)["public_key"]
    assert claims["aud"] == f"http://127.0.0.1:{device.service.port}"
    assert claims["sub"] == "https://maps.example.org"
    assert (
        datetime.now(UTC)
        < datetime.fromtimestamp(claims["exp"], UTC)
        < datetime.now(UTC) + timedelta(hours=24, minutes=1)
    )
    assert device.shown[0]["kind"] == "test"
    point = urlsafe_b64decode(push_of(ann)["public_key"] + "=")
    assert (len(point), point[0]) == (65, 4)


@pytest.mark.parametrize("status", [404, 410])
def test_a_subscription_that_has_expired_is_removed(
    service: Service, messaging: Messaging, device: Browser, status: int
) -> None:
    ann = owner(service, ANN)
    made = device.subscribe(ann)
    ann.request("POST", f"{SUBSCRIPTIONS}/{made['id']}/test")
    device.service.behaviour = answering(status)
    with delivering(service, messaging) as messenger:
        messenger.settle()
        assert push_of(ann)["subscriptions"] == []
        hasten(service)
        messenger.settle()
    assert len(device.service.requests) == 1


def test_a_push_service_that_is_busy_is_asked_again_when_it_says(
    service: Service, messaging: Messaging, device: Browser
) -> None:
    ann = owner(service, ANN)
    made = device.subscribe(ann)
    ann.request("POST", f"{SUBSCRIPTIONS}/{made['id']}/test")
    device.service.behaviour = answering(429, {"Retry-After": "3600"})
    with delivering(service, messaging) as messenger:
        messenger.settle()
        messenger.settle()
        assert len(device.service.requests) == 1
        assert push_of(ann)["subscriptions"][0]["trouble"] == "It answered 429."
        device.service.behaviour = answering(201)
        hasten(service)
        messenger.settle()
    assert len(device.service.requests) == 2
    assert push_of(ann)["subscriptions"][0]["trouble"] is None


def test_many_at_once_are_one_message(service: Service, messaging: Messaging, device: Browser, core: Core) -> None:
    device.subscribe(owner(service, ANN))
    core.planned["1"] = rejected("c1")
    for name in ("RB-1", "RB-2", "RB-3"):
        robot = service.add_robot(name, ANN)
        robot.upload("0")
        send(robot, "1")
    with delivering(service, messaging) as messenger:
        messenger.settle()
        hasten(service)
        messenger.settle()
    (shown,) = device.shown
    assert (shown["kind"], shown["count"], shown["url"]) == ("digest", 3, "/questions")
    assert shown["title"] == "3 questions about your maps"


def test_a_new_room_and_a_mission_from_another_floor_are_told(
    service: Service, messaging: Messaging, device: Browser, anns: RobotCaller
) -> None:
    device.subscribe(owner(service, ANN))
    found = send(anns, "1", changed("annex"))
    assert len(found["discovered_rooms"]) == 1, found
    assert send(anns, "2", changed("other floor"))["outcome"] == "parked"
    assert send(anns, "3", changed("other floor"))["outcome"] == "parked"  # the same question
    with delivering(service, messaging) as messenger:
        messenger.settle()
        hasten(service)
        messenger.settle()
    (shown,) = device.shown
    assert (shown["kind"], shown["count"]) == ("digest", 2)
    assert shown["body"].startswith("ground: a new room, ")
    assert shown["body"].endswith("ground: which floor is this?")


def test_what_a_person_does_not_want_to_be_told_by_a_channel_is_not(
    service: Service, messaging: Messaging, device: Browser, anns: RobotCaller, core: Core
) -> None:
    ann = owner(service, ANN)
    device.subscribe(ann)
    expect(ann.request("PATCH", "/api/v1/notifications", json={"push": ["parked"]}))
    core.planned |= {"1": rejected("c1"), "2": rejected("c2", kind="wrong_map", rooms=())}
    send(anns, "1")
    send(anns, "2")
    with delivering(service, messaging) as messenger:
        messenger.settle()
        hasten(service)
        messenger.settle()
    assert [told["kind"] for told in device.shown] == ["parked"]


@pytest.mark.usefixtures("messaging")
def test_the_same_browser_is_one_subscription_and_belongs_to_who_signed_in_last(
    service: Service, device: Browser
) -> None:
    ann, bob = owner(service, ANN), owner(service, "bob@example.org")
    first = device.subscribe(ann, "Phone")
    again = device.subscribe(ann)
    assert (again["id"], again["label"]) == (first["id"], "Phone")
    device.subscribe(bob)
    assert push_of(ann)["subscriptions"] == []
    (bobs,) = push_of(bob)["subscriptions"]
    assert ann.request("DELETE", f"{SUBSCRIPTIONS}/{bobs['id']}").status_code == 404
    assert bob.request("DELETE", f"{SUBSCRIPTIONS}/{bobs['id']}").status_code == 204
    assert push_of(bob)["subscriptions"] == []


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"endpoint": "https://127.0.0.1/push"}, "/endpoint"),
        ({"endpoint": "http://push.example.org/1"}, "/endpoint"),
        ({"endpoint": "https://push.example.org/\n1"}, "/endpoint"),
        ({"keys": {"p256dh": "AAAA", "auth": "AAAAAAAAAAAAAAAAAAAAAA"}}, "/keys/p256dh"),
        ({"keys": {"p256dh": "", "auth": "AAAAAAAAAAAAAAAAAAAAAA"}}, "/keys/p256dh"),
    ],
)
def test_a_subscription_that_nothing_can_be_sent_to_is_refused(
    service: Service, device: Browser, change: Json, pointer: str
) -> None:
    allow(service, outbound=Outbound())
    wanted = device.subscription() | {"endpoint": "https://push.example.org/1"} | change
    refused = expect(owner(service, ANN).request("POST", SUBSCRIPTIONS, json=wanted), 422)
    assert [fault["pointer"] for fault in refused["errors"]] == [pointer]


def test_a_secret_of_the_wrong_size_is_refused(service: Service, device: Browser) -> None:
    allow(service)
    wanted = device.subscription()
    wanted["keys"]["auth"] = "AAAA"
    refused = expect(owner(service, ANN).request("POST", SUBSCRIPTIONS, json=wanted), 422)
    assert refused["errors"][0]["pointer"] == "/keys/auth"
    assert urlsplit(wanted["endpoint"]).hostname == "127.0.0.1"
