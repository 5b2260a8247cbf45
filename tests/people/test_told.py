"""Who is told of what happens at a home: its owner and members, as long as they belong to it."""

from datetime import UTC, datetime

from stillroom.store import people, receivers
from stillroom.store.receivers import NewReceiver
from tests.conflicts import Core, rejected, send
from tests.conftest import Service
from tests.people.browsers import ANN, BOB
from tests.service.messages.mailbox import mail_server, server_of
from tests.telling import allow, delivering, hasten

MEL, VERA, OLGA = "mel@example.org", "vera@example.org", "olga@example.org"


def test_members_are_asked_like_the_owner_until_they_leave_and_viewers_are_not(service: Service, core: Core) -> None:
    anns, free = service.add_robot("anns", ANN), service.add_robot("free")
    now = datetime.now(UTC)
    with service.database.write() as tx:
        for email in (ANN, MEL, VERA, BOB, OLGA):
            people.find_or_add(tx, email, now)
            receivers.add(tx, NewReceiver("email", f"user:{email}", email, now), now)
        people.change(tx, OLGA, {"duty": "operator"})
        for email, role in ((MEL, "member"), (VERA, "viewer"), (BOB, "member")):
            people.join(tx, ANN, email, role, now)
    core.planned |= {"1": rejected("c1")}
    with mail_server() as box, delivering(service, allow(service, mail=server_of(box))) as messenger:
        for robot in (anns, free):
            assert robot.upload("0").status_code == 201
            send(robot, "1")
        messenger.settle()  # what is to be told is gathered for a minute
        with service.database.write() as tx:
            (bob,) = (row for row in people.members_of(tx, ANN) if row.email == BOB)
            assert people.part(tx, bob.key, ANN)
        hasten(service)
        messenger.settle()
        assert sorted(str(letter["To"]) for letter in box.messages) == [ANN, MEL, OLGA]
