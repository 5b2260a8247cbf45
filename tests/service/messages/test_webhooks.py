"""Webhooks as their receivers see them: signed, tried again, never lost, and never in anybody's way."""

import threading
from datetime import UTC, datetime, timedelta
from functools import partial
from http.server import BaseHTTPRequestHandler

import pytest
import sqlalchemy as sa
from standardwebhooks import Webhook, WebhookVerificationError

from stillroom.service.messages import schedule
from stillroom.service.messages.attempts import Attempt
from stillroom.service.messages.messenger import AT_ONCE, PER_RECEIVER
from stillroom.service.messages.sending import _retry_after
from stillroom.settings import Messaging, Outbound
from stillroom.store import deliveries
from stillroom.store.rows import DeliveryRow
from stillroom.store.tables import receiver as receiver_table
from tests.conflicts import Core, expect, rejected, send
from tests.conftest import RobotCaller, Service
from tests.ports import free_port
from tests.telling import (
    PUBLIC_URL,
    Json,
    Names,
    Receiver,
    Request,
    add_webhook,
    allow,
    answering,
    deliveries_of,
    delivering,
    expire_leases,
    hasten,
    owner,
    receiving,
    until,
)

ANN = "ann@example.org"


@pytest.fixture
def messaging(service: Service) -> Messaging:
    return allow(service)


def verified(request: Request, secret: str) -> Json:
    found: Json = Webhook(secret).verify(request.body, dict(request.headers))
    return found


def told(receiver: Receiver) -> list[str]:
    return [request.json["type"] for request in receiver.requests]


def test_a_program_is_told_what_happened_by_the_standard(
    service: Service, messaging: Messaging, mapped: RobotCaller, core: Core
) -> None:
    core.planned["1"] = rejected("c1")
    with receiving() as there, delivering(service, messaging) as messenger:
        messenger.settle()
        webhook = add_webhook(service.operator, there.url, label="Home automation")
        send(mapped, "1")
        messenger.settle()
        (opened,) = [r for r in there.requests if r.json["type"] == "conflict.opened"]
        body = verified(opened, webhook["secret"])
        assert opened.headers["content-type"] == "application/json"
        assert opened.headers["webhook-id"].startswith("msg_")
        data = body["data"]
        assert datetime.fromisoformat(body["timestamp"]) <= datetime.now(UTC)
        assert (data["robot"], data["map"], data["conflict"], data["mission"]) == ("RB-1", "ground", "c1", "1")
        assert (data["kind"], data["cause"], data["state"]) == ("room_recall", "wall_gap", "open")
        assert data["rooms"][0]["recall"] == 0.41
        assert data["default"]["response"] == "reject"
        assert data["page"] == f"{PUBLIC_URL}/robots/RB-1/maps/ground/conflicts/c1"
        decided = f"{mapped.path()}/conflicts/c1/decision"
        expect(service.operator.request("POST", decided, json={"response": "accept", "proposal": "p1"}))
        messenger.settle()
        assert sorted(told(there)) == ["conflict.closed", "conflict.opened", "map.updated"]
        closed = next(r.json["data"] for r in there.requests if r.json["type"] == "conflict.closed")
        assert (closed["state"], closed["version"], closed["decided_by"]) == ("accepted", 2, "operator")
        listed = deliveries_of(service.operator, webhook)
        assert [(d["state"], d["attempts"], d["status_code"]) for d in listed] == [("delivered", 1, 204)] * 3
        assert {d["message"] for d in listed} == {r.headers["webhook-id"] for r in there.requests}


def test_a_program_is_told_of_the_types_it_wants_alone(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as all_, receiving() as parked, delivering(service, messaging) as messenger:
        add_webhook(service.operator, all_.url)
        add_webhook(service.operator, parked.url, types=["mission.parked"])
        robot.upload("0")
        messenger.settle()
        assert (told(all_), told(parked)) == (["map.updated"], [])


def test_programs_are_told_of_the_robots_of_who_added_them_and_of_the_fleet_without_names(
    service: Service, messaging: Messaging, core: Core
) -> None:
    core.planned["1"] = rejected("c1")
    robots = [service.add_robot(*named) for named in (("free", None), ("anns", ANN), ("bobs", "bob@example.org"))]
    with (
        receiving() as anns,
        receiving() as operators,
        receiving() as fleets,
        delivering(service, messaging) as messenger,
    ):
        add_webhook(owner(service, ANN), anns.url)
        add_webhook(service.operator, operators.url)
        add_webhook(service.operator, fleets.url, scope="fleet")
        for robot in robots:
            robot.upload("0")
            send(robot, "1")
        messenger.settle()

        def seen(by: Receiver) -> set[str]:
            return {request.json["data"]["robot"] for request in by.requests}

        assert (seen(anns), seen(operators), seen(fleets)) == ({"anns"}, {"free"}, {"free", "anns", "bobs"})
        opened = [r for r in fleets.requests if r.json["type"] == "conflict.opened"]
        assert len(opened) == 3
        assert all(b"Room r1" not in r.body and r.json["data"]["rooms"][0]["recall"] == 0.41 for r in opened)
        assert any(b"Room r1" in request.body for request in anns.requests)


# -- receivers that fail ------------------------------------------------------------------------------------------------


def slow(request: BaseHTTPRequestHandler) -> None:
    threading.Event().wait(3)
    answering(204)(request)


@pytest.mark.parametrize("trouble", ["down", "slow", "500", "redirect", "private"])
def test_a_receiver_in_trouble_loses_nothing_blocks_nothing_and_reaches_nothing_else(
    service: Service, messaging: Messaging, mapped: RobotCaller, trouble: str
) -> None:
    names = Names({"inner.example": [["10.0.0.1"], ["127.0.0.1"]]})
    with (
        receiving() as inner,
        receiving() as bad,
        receiving() as good,
        delivering(service, messaging, names, 0.5) as messenger,
    ):
        messenger.settle()
        bad.behaviour = {
            "slow": slow,
            "500": answering(500),
            "redirect": answering(307, {"Location": inner.url}),
        }.get(trouble, bad.behaviour)
        url = {
            "down": f"http://127.0.0.1:{free_port()}/",
            "private": f"http://inner.example:{bad.port}/hook",
        }.get(trouble, bad.url)
        webhook = add_webhook(service.operator, url, types=["map.updated"])
        add_webhook(service.operator, good.url, types=["map.updated"])
        assert mapped.upload("1").json()["status"] == "done"
        messenger.settle()
        assert told(good) == ["map.updated"]
        assert inner.requests == []
        (first,) = deliveries_of(service.operator, webhook)
        assert (first["state"], first["attempts"]) == ("waiting", 1)
        expected = {"500": "answered 500", "redirect": "Redirects", "private": "not public", "slow": "0 seconds"}
        assert expected.get(trouble, "could not be reached") in first["reason"]
        assert "10.0.0.1" not in first["reason"], "who gave the name does not learn by it what names mean inside"
        assert datetime.fromisoformat(first["next_at"]) > datetime.now(UTC)
        shown = service.operator.get(f"/api/v1/webhooks/{webhook['id']}").json()
        assert (shown["failures"], shown["enabled"]) == (1, True)
        # the receiver recovers
        bad.behaviour = answering(200)
        if trouble == "down":
            expect(service.operator.request("PATCH", f"/api/v1/webhooks/{webhook['id']}", json={"url": bad.url}))
        hasten(service)
        messenger.settle()
        (again,) = deliveries_of(service.operator, webhook)
        assert (again["state"], again["attempts"], again["message"]) == ("delivered", 2, first["message"])
        assert bad.requests[-1].headers["webhook-id"] == first["message"]
        assert service.operator.get(f"/api/v1/webhooks/{webhook['id']}").json()["failures"] == 0


def test_a_receiver_that_hangs_holds_up_neither_missions_nor_other_receivers(
    service: Service, messaging: Messaging, mapped: RobotCaller
) -> None:
    released = threading.Event()

    def until_released(request: BaseHTTPRequestHandler) -> None:
        released.wait(30)
        answering(204)(request)

    with receiving() as hanging, receiving() as good, delivering(service, messaging, total_s=30) as messenger:
        messenger.settle()
        hanging.behaviour = until_released
        stuck = add_webhook(service.operator, hanging.url)
        add_webhook(service.operator, good.url)
        for number in range(1, 7):
            assert mapped.upload(str(number)).json()["status"] == "done"
        try:
            until(messenger, lambda: len(good.requests) >= 6)
            until(messenger, lambda: len(hanging.requests) >= PER_RECEIVER)
            assert len(hanging.requests) == PER_RECEIVER
            assert sorted({d["attempts"] for d in deliveries_of(service.operator, stuck)}) == [0, 1]
        finally:
            released.set()
        messenger.settle()
        assert len(hanging.requests) == len(good.requests)


def test_what_a_messenger_that_died_had_claimed_is_sent_by_another(service: Service, messaging: Messaging) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        messenger.settle()
        webhook = add_webhook(service.operator, there.url)
        expect(service.operator.request("POST", f"/api/v1/webhooks/{webhook['id']}/test"), 202)
        with service.database.write() as tx:  # claims it, and is never heard of again
            now = datetime.now(UTC) + timedelta(seconds=1)
            assert len(deliveries.claim(tx, now, AT_ONCE, PER_RECEIVER)) == 1
        messenger.settle()
        assert there.requests == []
        expire_leases(service)
        messenger.settle()
        (sent,) = there.requests
        assert (sent.json["type"], sent.json["data"]) == ("test", {"webhook": webhook["id"]})
        (shown,) = deliveries_of(service.operator, webhook)
        assert (shown["state"], shown["attempts"]) == ("delivered", 2)


def test_two_messengers_send_each_message_once(service: Service, messaging: Messaging) -> None:
    with receiving() as there, delivering(service, messaging) as first, delivering(service, messaging) as second:
        first.settle()
        webhook = add_webhook(service.operator, there.url)
        for _ in range(10):
            expect(service.operator.request("POST", f"/api/v1/webhooks/{webhook['id']}/test"), 202)
        both = [threading.Thread(target=messenger.settle) for messenger in (first, second)]
        for thread in both:
            thread.start()
        for thread in both:
            thread.join()
        first.settle()
        assert len({request.headers["webhook-id"] for request in there.requests}) == len(there.requests) == 10


def test_what_happened_before_the_messenger_ran_is_told_when_it_does(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as there:
        add_webhook(service.operator, there.url)
        robot.upload("0")  # no messenger is there
        with delivering(service, messaging) as messenger:
            messenger.settle()
        assert told(there) == ["map.updated"]


# -- what its owner can do -----------------------------------------------------------------------------------------------


def test_a_new_secret_and_the_old_one_both_sign_for_a_day(service: Service, messaging: Messaging) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        webhook = add_webhook(service.operator, there.url)
        url = f"/api/v1/webhooks/{webhook['id']}"
        newer = expect(service.operator.request("POST", f"{url}/secret"))
        assert newer["secret"] != webhook["secret"]
        expect(service.operator.request("POST", f"{url}/test"), 202)
        messenger.settle()
        for secret in (webhook["secret"], newer["secret"]):
            verified(there.requests[0], secret)
        with service.database.write() as tx:  # a day later
            known = tx.execute(sa.select(receiver_table.c["keys"])).scalar_one()
            known["secrets"][1]["until"] = (datetime.now(UTC) - timedelta(seconds=1)).isoformat()
            tx.execute(sa.update(receiver_table).values({"keys": known}))
        expect(service.operator.request("POST", f"{url}/test"), 202)
        messenger.settle()
        verified(there.requests[1], newer["secret"])
        with pytest.raises(WebhookVerificationError):
            verified(there.requests[1], webhook["secret"])


def test_a_message_is_sent_again_where_its_owner_asks_for_it(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        webhook = add_webhook(service.operator, there.url)
        robot.upload("0")
        messenger.settle()
        (sent,) = deliveries_of(service.operator, webhook)
        url = f"/api/v1/webhooks/{webhook['id']}/deliveries"
        again = expect(service.operator.request("POST", f"{url}/{sent['id']}/replay"), 202)
        assert (again["state"], again["message"]) == ("waiting", sent["message"])
        messenger.settle()
        first, second = there.requests
        assert first.body == second.body
        assert first.headers["webhook-id"] == second.headers["webhook-id"]
        verified(second, webhook["secret"])


def test_a_receiver_that_takes_nothing_for_days_is_switched_off_and_says_why(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        there.behaviour = answering(503)
        webhook = add_webhook(service.operator, there.url)
        url = f"/api/v1/webhooks/{webhook['id']}"
        robot.upload("0")
        for _ in range(schedule.END_FAILURES - 1):
            messenger.settle()
            hasten(service)
        with service.database.write() as tx:
            since = datetime.now(UTC) - schedule.END_AFTER
            tx.execute(sa.update(receiver_table).values(failing_since=since))
        robot.upload("1")
        messenger.settle()
        ended = service.operator.get(url).json()
        assert not ended["enabled"]
        assert ended["disabled_reason"] == "It took no message for 5 days. Last: It answered 503."
        assert {d["state"] for d in deliveries_of(service.operator, webhook)} == {"dead"}
        robot.upload("2")
        hasten(service)
        asked = len(there.requests)
        messenger.settle()
        assert len(there.requests) == asked
        there.behaviour = answering(204)
        refused = expect(service.operator.request("POST", f"{url}/test"), 422)
        assert "Switch it on first" in refused["errors"][0]["detail"]
        assert expect(service.operator.request("PATCH", url, json={"enabled": True}))["enabled"]
        dead = deliveries_of(service.operator, webhook)[0]
        expect(service.operator.request("POST", f"{url}/deliveries/{dead['id']}/replay"), 202)
        messenger.settle()
        assert there.requests[-1].headers["webhook-id"] == dead["message"]


def test_a_receiver_that_says_it_is_gone_is_switched_off_at_once(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        there.behaviour = answering(410)
        webhook = add_webhook(service.operator, there.url)
        robot.upload("0")
        messenger.settle()
        shown = service.operator.get(f"/api/v1/webhooks/{webhook['id']}").json()
        assert (shown["enabled"], "410" in shown["disabled_reason"]) == (False, True)


def test_a_message_that_failed_for_days_is_dead_and_keeps_the_reason(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        there.behaviour = answering(500)
        webhook = add_webhook(service.operator, there.url)
        robot.upload("0")
        for _ in range(schedule.MOST_ATTEMPTS + 2):
            messenger.settle()
            hasten(service)
        assert len(there.requests) == schedule.MOST_ATTEMPTS
        (dead,) = deliveries_of(service.operator, webhook)
        assert (dead["state"], dead["attempts"], dead["next_at"]) == ("dead", schedule.MOST_ATTEMPTS, None)
        assert dead["reason"] == "It answered 500."


def test_messages_that_were_finished_long_ago_are_forgotten(
    service: Service, messaging: Messaging, robot: RobotCaller
) -> None:
    with receiving() as there, delivering(service, messaging) as messenger:
        webhook = add_webhook(service.operator, there.url)
        robot.upload("0")
        messenger.settle()
        messenger.forget()
        assert len(deliveries_of(service.operator, webhook)) == 1
        with service.database.write() as tx:
            assert deliveries.prune(tx, datetime.now(UTC) + timedelta(seconds=1), 10) == 1
        assert deliveries_of(service.operator, webhook) == []


# -- when ---------------------------------------------------------------------------------------------------------------

NOW = datetime(2026, 11, 22, tzinfo=UTC)


def tried(attempts: int) -> DeliveryRow:
    return DeliveryRow(1, "msg", 1, "test", {}, "waiting", attempts, NOW, NOW, NOW, None, None, None)


def test_a_message_is_tried_over_days_ever_more_rarely() -> None:
    failed = Attempt("failed")
    waits = []
    for attempts in range(1, schedule.MOST_ATTEMPTS):
        at = schedule.next_try(tried(attempts), failed, NOW, lambda: 0.5)
        assert at is not None
        waits.append((at - NOW).total_seconds())
    assert waits == sorted(waits)
    assert (waits[0], waits[-1]) == (5, 24 * 3600)
    assert timedelta(days=3) < timedelta(seconds=sum(waits)) < timedelta(days=4)
    assert schedule.next_try(tried(schedule.MOST_ATTEMPTS), failed, NOW) is None


def test_messages_that_failed_together_are_not_tried_again_together() -> None:
    earliest, latest = (schedule.next_try(tried(3), Attempt("failed"), NOW, partial(float, c)) for c in (0.0, 1.0))
    assert earliest is not None
    assert latest is not None
    assert (earliest - NOW, latest - NOW) == (timedelta(seconds=64), timedelta(seconds=96))


def test_a_receiver_that_says_when_is_not_asked_before() -> None:
    at = schedule.next_try(tried(1), Attempt("failed", retry_after_s=3600), NOW)
    assert at == NOW + timedelta(hours=1)


@pytest.mark.parametrize(
    ("said", "seconds"),
    [
        (None, None),
        ("120", 120.0),
        ("99999999999999999", 86400.0),
        ("soon", None),
        ("-5", None),
        ("Wed, 21 Oct 2015 07:28:00 GMT", 0.0),
        ("Fri, 31 Dec 2199 23:59:59 GMT", 86400.0),
        ("Wed, 21 Oct 2015 07:28:00 -0000", None),
    ],
)
def test_when_a_receiver_wants_to_be_asked_again(said: str | None, seconds: float | None) -> None:
    assert _retry_after(said) == seconds


def test_nothing_goes_to_this_machine_where_settings_do_not_say_so(service: Service, robot: RobotCaller) -> None:
    with receiving() as there:
        allow(service)
        webhook = add_webhook(service.operator, there.url)
        robot.upload("0")
        strict = allow(service, outbound=Outbound())
        with delivering(service, strict) as messenger:
            messenger.settle()
        assert there.requests == []
        (shown,) = deliveries_of(service.operator, webhook)
        assert "nothing was sent" in shown["reason"]
        assert "127.0.0.1 leads to" in shown["reason"]


@pytest.mark.usefixtures("messaging")
def test_no_more_than_two_messages_are_under_way_to_one_receiver(service: Service) -> None:
    with receiving() as there:
        webhook = add_webhook(service.operator, there.url)
        for _ in range(5):
            expect(service.operator.request("POST", f"/api/v1/webhooks/{webhook['id']}/test"), 202)
        now = datetime.now(UTC) + timedelta(seconds=1)
        with service.database.write() as tx:
            assert len(deliveries.claim(tx, now, AT_ONCE, PER_RECEIVER)) == PER_RECEIVER
            assert deliveries.claim(tx, now, AT_ONCE, PER_RECEIVER) == []
