"""E-mail, as it arrives at a mail server: to addresses that were confirmed, with pictures, and few."""

import re
import socket
from collections.abc import Iterator
from dataclasses import replace
from email.message import EmailMessage
from typing import Any
from urllib.parse import urlsplit

import pytest
import sqlalchemy as sa

from stillroom.maps.mission import Mission
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.update import MapUpdate
from stillroom.service.messages import mail
from stillroom.service.messages.messenger import AT_ONCE
from stillroom.settings import MailServer, Messaging
from stillroom.store import clock, deliveries, receivers
from stillroom.store.deliveries import NewDelivery
from stillroom.store.receivers import NewReceiver
from stillroom.store.tables import delivery
from tests.conflicts import Core, expect, rejected, send
from tests.conftest import Caller, RobotCaller, Service
from tests.homes import pixels
from tests.service.messages.mailbox import ANN, SENDER, MailBox, mail_server, server_of
from tests.telling import PUBLIC_URL, Json, add_webhook, allow, delivering, hasten, owner, receiving, until

# what differs between databases is tested with webhooks
pytestmark = pytest.mark.parametrize("engine", ["sqlite"])


@pytest.fixture
def box() -> Iterator[MailBox]:
    with mail_server() as there:
        yield there


@pytest.fixture
def messaging(service: Service, box: MailBox) -> Messaging:
    return allow(service, mail=server_of(box))


@pytest.fixture
def anns(service: Service) -> RobotCaller:
    robot = service.add_robot("RB-1", ANN)
    robot.upload("0")
    return robot


def text_of(message: EmailMessage, kind: str = "plain") -> str:
    part = message.get_body((kind,))
    assert part is not None
    content: str = part.get_content()
    return content


def link_in(message: EmailMessage, page: str) -> str:
    """Path and query of the link to a page."""
    found = re.search(rf"{PUBLIC_URL}(/email/{page}\?token=\S+)", text_of(message))
    assert found is not None
    return found[1]


def confirmed(service: Service, messaging: Messaging, box: MailBox, email: str = ANN) -> Caller:
    """Somebody who has opened the link that was sent to the address."""
    caller = owner(service, email)
    expect(caller.request("PUT", "/api/v1/notifications/email", json={"address": email}), 202)
    with delivering(service, messaging) as messenger:
        messenger.settle()
    assert service.stranger.request("POST", link_in(box.messages[-1], "confirm")).status_code == 200
    box.messages.clear()
    return caller


def email_of(caller: Caller) -> Json:
    found: Json = expect(caller.get("/api/v1/notifications"))["email"]
    return found


def test_nothing_but_the_link_that_confirms_it_goes_to_an_address_before_it_was_opened(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = owner(service, ANN)
    assert email_of(ann) == {
        "available": True,
        "address": None,
        "confirmed": False,
        "suggested": ANN,
        "kinds": ["conflict", "parked", "room"],
        "trouble": None,
    }
    core.planned |= {"1": rejected("c1"), "2": rejected("c2", rooms=("r2",))}
    with delivering(service, messaging) as messenger:
        expect(ann.request("PUT", "/api/v1/notifications/email", json={"address": "ann@home.example"}), 202)
        send(anns, "1")
        messenger.settle()
        hasten(service)
        messenger.settle()
        (asked,) = box.messages
        assert (asked["To"], asked["From"], asked["Subject"]) == ("ann@home.example", SENDER, "Confirm your address")
        assert box.senders == [(SENDER, ["ann@home.example"])]
        path = link_in(asked, "confirm")
        page = service.stranger.get(path)  # programs that look at links confirm nothing
        assert "<button>Confirm</button>" in page.text
        assert not email_of(ann)["confirmed"]
        done = service.stranger.request("POST", path)
        assert "ann@home.example" in done.text
        assert email_of(ann)["confirmed"]
        assert service.stranger.request("POST", path).status_code == 200  # pressed twice
        send(anns, "2")
        messenger.settle()
        hasten(service)
        messenger.settle()
        assert [m["Subject"] for m in box.messages[1:]] == ["ground: a question about Room r2"]


@pytest.mark.parametrize("change", ["cut", "other", "stop", "old"])
def test_a_link_that_is_not_the_one_that_was_sent_confirms_nothing(
    service: Service, messaging: Messaging, box: MailBox, change: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ann = owner(service, ANN)
    if change == "old":
        monkeypatch.setattr(mail, "CONFIRM_WITHIN", -mail.CONFIRM_WITHIN)
    expect(ann.request("PUT", "/api/v1/notifications/email", json={"address": ANN}), 202)
    with delivering(service, messaging) as messenger:
        messenger.settle()
        path = link_in(box.messages[0], "confirm")
        if change == "cut":
            path = path[:-5]
        if change == "stop":
            path = path.replace("confirm", "stop")
        if change == "other":  # a newer address: the older link says nothing about it
            expect(ann.request("PUT", "/api/v1/notifications/email", json={"address": "new@example.org"}), 202)
        answer = service.stranger.request("POST", path)
    assert answer.status_code == 422
    assert "That did not work" in answer.text
    assert not email_of(ann)["confirmed"]
    assert email_of(ann)["address"] is not None


def test_a_question_comes_with_a_picture_and_a_link_that_opens_it(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    confirmed(service, messaging, box)
    core.planned["1"] = rejected("c1")
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        hasten_after(service, messenger)
    (letter,) = box.messages
    page = f"{PUBLIC_URL}/robots/RB-1/maps/ground/conflicts/c1"
    assert (letter["To"], letter["Subject"]) == (ANN, "ground: a question about Room r1")
    assert letter["Auto-Submitted"] == "auto-generated"
    assert "59 % of Room r1 is gone." in text_of(letter)
    assert "the map stays as it was" in text_of(letter)
    assert page in text_of(letter).splitlines()
    html = text_of(letter, "html")
    assert f'href="{page}"' in html
    for answer, said in (("accept:p1", "Take the new map"), ("accept:p2", "Keep Room r1 as it was")):
        assert f"{said}: {page}?answer={answer}" in text_of(letter).splitlines()
        assert re.search(rf'<a href="{re.escape(page)}\?answer={answer}"[^>]*>{said}</a>', html)
    (cid,) = re.findall(r'src="cid:([^"]+)"', html)
    (picture,) = [part for part in letter.walk() if part.get_content_type() == "image/png"]
    assert picture["Content-ID"] == f"<{cid}>"
    assert picture.get_content_disposition() == "inline"
    height, width = pixels(picture.get_content()).shape[:2]
    assert width > 2 * 400 > height


def test_a_person_is_told_in_the_language_that_they_chose(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = owner(service, ANN)
    expect(ann.request("PUT", "/api/v1/notifications/email", json={"address": ANN, "language": "de"}), 202)
    with delivering(service, messaging) as messenger:
        messenger.settle()
        asked = box.messages.pop()
        assert asked["Subject"] == "Bestätigen Sie Ihre Adresse"
        german = Caller(service.http, {"Accept-Language": "de-AT,de;q=0.9,en;q=0.8"})
        assert "<button>Bestätigen</button>" in german.get(link_in(asked, "confirm")).text
        assert "Adresse bestätigt" in german.request("POST", link_in(asked, "confirm")).text
        core.planned |= {"1": rejected("c1"), "2": rejected("c2", rooms=("r2",))}
        send(anns, "1")
        hasten_after(service, messenger)
        (letter,) = box.messages
        assert letter["Subject"] == "ground: eine Frage zu Room r1"
        assert "59 % von Room r1 sind weg. Antwortet bis" in text_of(letter)
        assert "Room r1 lassen, wie es war" in text_of(letter, "html")
        assert '<html lang="de">' in text_of(letter, "html")
        expect(ann.request("PATCH", "/api/v1/notifications", json={"language": "en"}))
        send(anns, "2")
        hasten_after(service, messenger)
        hasten_after(service, messenger)
        assert box.messages[-1]["Subject"] == "ground: a question about Room r2"


def hasten_after(service: Service, messenger: Any) -> None:
    messenger.settle()
    hasten(service)
    messenger.settle()


def three_questions(previous: SemanticMap, mission: Mission, update: MapUpdate) -> MapUpdate:
    made = rejected("c1")(previous, mission, update)
    others = replace(made.conflicts[0], id="c2", kind="shape"), replace(made.conflicts[0], id="c3", kind="drift")
    return replace(made, conflicts=(*made.conflicts, *others))


def test_many_questions_at_once_are_one_message(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    confirmed(service, messaging, box)
    core.planned["1"] = three_questions
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        messenger.settle()
        assert box.messages == []  # they are gathered
        hasten_after(service, messenger)
        (letter,) = box.messages
        assert letter["Subject"] == "3 questions about your maps"
        for key in ("c1", "c2", "c3"):
            assert f"/conflicts/{key}" in text_of(letter)
        assert len([part for part in letter.walk() if part.get_content_type() == "image/png"]) == 3
        # the next one does not come right behind it
        core.planned["4"] = rejected("c4", kind="room_precision")
        send(anns, "4")
        messenger.settle()
        with service.database.write() as tx:  # gathered long enough
            tx.execute(
                sa.update(delivery).where(delivery.c.state == "waiting").values(due_at=sa.func.current_timestamp())
            )
        messenger.settle()
        assert len(box.messages) == 1
        hasten_after(service, messenger)
        assert [m["Subject"] for m in box.messages[1:]] == ["ground: a question about Room r1"]


def test_what_was_answered_meanwhile_is_left_out(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = confirmed(service, messaging, box)
    core.planned |= {"1": rejected("c1"), "2": rejected("c2", rooms=("r2",))}
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        messenger.settle()
        expect(ann.request("POST", f"{anns.path()}/conflicts/c1/decision", json={"response": "reject"}))
        hasten_after(service, messenger)
        assert box.messages == []
        send(anns, "2")
        hasten_after(service, messenger)
        assert ["c2" in text_of(m) and "c1" not in text_of(m) for m in box.messages] == [True]


def test_who_wants_no_such_messages_gets_none(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = confirmed(service, messaging, box)
    chosen = expect(ann.request("PATCH", "/api/v1/notifications", json={"email": ["parked"]}))
    assert (chosen["email"]["kinds"], chosen["push"]["kinds"]) == (["parked"], ["conflict", "parked", "room"])
    core.planned["1"] = rejected("c1")
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        hasten_after(service, messenger)
    assert box.messages == []


def test_one_click_stops_all_messages(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = confirmed(service, messaging, box)
    core.planned |= {"1": rejected("c1"), "2": rejected("c2", rooms=("r2",))}
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        hasten_after(service, messenger)
        (letter,) = box.messages
        assert letter["List-Unsubscribe-Post"] == "List-Unsubscribe=One-Click"
        url = urlsplit(letter["List-Unsubscribe"].strip("<>"))
        assert service.stranger.get(f"{url.path}?{url.query}").status_code == 200
        assert email_of(ann)["address"] == ANN
        one_click = {"List-Unsubscribe": "One-Click"}
        assert service.stranger.request("POST", f"{url.path}?{url.query}", data=one_click).status_code == 200
        assert email_of(ann)["address"] is None
        send(anns, "2")
        hasten_after(service, messenger)
        assert len(box.messages) == 1


def test_a_mail_server_that_has_trouble_is_asked_again_and_the_message_stays_the_same(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = confirmed(service, messaging, box)
    core.planned["1"] = rejected("c1")
    send(anns, "1")
    box.answer = "451 Try again later"
    with delivering(service, messaging) as messenger:
        hasten_after(service, messenger)
        assert box.messages == []
        assert email_of(ann)["trouble"] == "The mail server answered 451: Try again later"
        box.answer = "250 OK"
        hasten_after(service, messenger)
    (letter,) = box.messages
    with service.database.read() as tx:
        key = tx.execute(sa.select(delivery.c.key).where(delivery.c.kind == "conflict")).scalar_one()
    assert letter["Message-ID"] == f"<{key}@maps.example.org>"
    assert email_of(ann)["trouble"] is None


@pytest.mark.parametrize("said", ["recipient", "content"])
def test_what_the_mail_server_will_never_take_is_not_sent_again(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core, said: str
) -> None:
    ann = confirmed(service, messaging, box)
    core.planned["1"] = rejected("c1")
    send(anns, "1")
    box.to_recipient, box.answer = ("550 No such user", "250 OK") if said == "recipient" else ("250 OK", "554 No")
    with delivering(service, messaging) as messenger:
        hasten_after(service, messenger)
    with service.database.read() as tx:
        state = tx.execute(sa.select(delivery.c.state).where(delivery.c.kind == "conflict")).scalar_one()
    assert state == "dead"
    assert "The mail server answered 55" in email_of(ann)["trouble"]


def test_links_are_not_sent_without_end_to_an_address_that_may_be_another_s(
    service: Service, messaging: Messaging, box: MailBox
) -> None:
    ann = owner(service, ANN)
    with delivering(service, messaging) as messenger:
        for number in range(5):
            body = {"address": f"bob{number}@example.org"}
            expect(ann.request("PUT", "/api/v1/notifications/email", json=body), 202)
            messenger.settle()
        refused = ann.request("PUT", "/api/v1/notifications/email", json={"address": "bob@example.org"})
        messenger.settle()
    assert (refused.status_code, refused.json()["retryable"]) == (429, True)
    assert int(refused.headers["Retry-After"]) > 0
    assert len(box.messages) == 5


def test_names_that_people_gave_can_not_change_what_a_message_is(
    service: Service, messaging: Messaging, box: MailBox, anns: RobotCaller, core: Core
) -> None:
    ann = confirmed(service, messaging, box)
    expect(ann.request("PATCH", anns.path(), json={"name": "<b>Home</b> & more"}))
    core.planned["1"] = rejected("c1")
    send(anns, "1")
    with delivering(service, messaging) as messenger:
        hasten_after(service, messenger)
    (letter,) = box.messages
    assert letter["Subject"] == "<b>Home</b> & more: a question about Room r1"
    assert "&lt;b&gt;Home&lt;/b&gt; &amp; more" in text_of(letter, "html")


def test_a_mail_server_that_hangs_keeps_no_webhook_waiting(service: Service) -> None:
    with socket.create_server(("127.0.0.1", 0)) as hanging, receiving() as there:
        server = MailServer("127.0.0.1", hanging.getsockname()[1], "none", None, None, SENDER)
        with service.database.write() as tx:
            now = clock.now(tx)
            for number in range(2 * sum(AT_ONCE.values())):
                row = receivers.add(tx, NewReceiver("email", f"user:{number}", f"{number}@example.org", now), now)
                assert row is not None
                deliveries.add(tx, [NewDelivery(row.id, "test", {}, now)], now)
        messaging = allow(service, mail=server)
        webhook = add_webhook(service.operator, there.url)
        expect(service.operator.request("POST", f"/api/v1/webhooks/{webhook['id']}/test"), 202)
        with delivering(service, messaging) as messenger:
            until(messenger, lambda: bool(there.requests))
            with service.database.read() as tx:
                tried = sa.select(sa.func.count()).where(delivery.c.kind == "test", delivery.c.attempts > 0)
                assert tx.execute(tried).scalar_one() == AT_ONCE["email"] + 1
            hanging.close()  # those that wait for it are told so
