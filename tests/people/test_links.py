"""Invitations and forgotten passwords, by letters that a real mail server is given."""

import json
from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa
from argon2 import PasswordHasher

from stillroom.service.accounts import new_login_link
from stillroom.service.people import passwords
from stillroom.store.tables import link, metadata
from tests.conftest import Service
from tests.people.browsers import ANN, BOB, PASSWORD, Browser, add_account, by_link, posting, secret_in

NEW = "another long passphrase"
MEL = "mel@example.org"


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(passwords, "HASHER", PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))


def test_a_forgotten_password_is_set_anew_by_a_link_that_works_once(service: Service) -> None:
    add_account(service)
    old = Browser(service)
    assert old.sign_in().status_code == 200
    with posting(service) as box:
        asked = Browser(service).post("/api/v1/password-resets", email=ANN.upper())
        assert asked.status_code == 202
        secret = secret_in(box, ANN)
    browser = Browser(service)
    seen = browser.post("/api/v1/links/look", token=secret).json()
    assert (seen["purpose"], seen["email"], seen["needs_password"]) == ("reset", ANN, True)
    assert browser.post("/api/v1/links/use", token=secret, password="short").status_code == 422
    assert browser.post("/api/v1/links/use", token=secret).status_code == 422
    assert browser.post("/api/v1/links/use", token=secret, password=NEW).json() == {"signed_in": True}
    assert browser.is_in()
    assert not old.is_in()
    assert Browser(service).post("/api/v1/links/use", token=secret, password=NEW).status_code == 404
    assert Browser(service).sign_in().status_code == 401
    assert Browser(service).sign_in(password=NEW).status_code == 200


def test_nobody_learns_by_a_forgotten_password_who_has_an_account(service: Service) -> None:
    add_account(service)
    with posting(service) as box:
        answers = [Browser(service).post("/api/v1/password-resets", email=email) for email in (ANN, BOB)]
        assert {(answer.status_code, answer.content) for answer in answers} == {(202, b"")}
        assert [message["To"] for message in box.messages] == [ANN]


def test_nobody_can_fill_a_mailbox_with_links(service: Service) -> None:
    add_account(service)
    with posting(service) as box:
        for n in range(12):
            assert Browser(service, f"192.0.2.{n}").post("/api/v1/password-resets", email=ANN).status_code == 202
        assert len(box.messages) == 3
        many = [Browser(service).post("/api/v1/password-resets", email=f"{n}@example.org") for n in range(22)]
    assert [answer.status_code for answer in many][-1] == 429


def test_a_link_expires_and_a_newer_one_takes_its_place(service: Service) -> None:
    add_account(service)
    with posting(service) as box:
        Browser(service).post("/api/v1/password-resets", email=ANN)
        first = secret_in(box, ANN)
        Browser(service).post("/api/v1/password-resets", email=ANN)
        second = secret_in(box, ANN)
    browser = Browser(service)
    assert browser.post("/api/v1/links/look", token=first).status_code == 404
    assert browser.post("/api/v1/links/look", token=second).status_code == 200
    with service.database.write() as tx:
        tx.execute(sa.update(link).values(expires_at=datetime.now(UTC) - timedelta(seconds=1)))
    assert browser.post("/api/v1/links/look", token=second).status_code == 404
    assert browser.post("/api/v1/links/use", token=second, password=NEW).status_code == 404


def test_links_that_sign_in_are_not_for_what_letters_are_for_nor_the_other_way_round(service: Service) -> None:
    add_account(service)
    sign_in = new_login_link(service.database, ANN)
    assert Browser(service).post("/api/v1/links/use", token=sign_in, password=NEW).status_code == 404
    with posting(service) as box:
        Browser(service).post("/api/v1/password-resets", email=ANN)
        reset = secret_in(box, ANN)
    assert Browser(service).get(f"/login?token={reset}").status_code == 401
    assert Browser(service).post("/api/v1/links/look", token=reset).status_code == 200


def test_an_owner_invites_people_who_see_the_home_until_they_are_sent_away(service: Service) -> None:
    robot = service.add_robot("anns", ANN)
    assert robot.upload("0").status_code == 201
    ann = by_link(service, ANN)
    with posting(service) as box:
        made = ann.post("/api/v1/household/invitations", email="Mel@Example.org", role="viewer")
        assert made.status_code == 201, made.text
        assert [one["email"] for one in made.json()["invitations"]] == [MEL]
        letter = box.messages[-1]
        assert ANN in str(letter.get_body(("plain",)))
        secret = secret_in(box, MEL)
    mel = Browser(service)
    assert mel.get(robot.path()).status_code == 401
    seen = mel.post("/api/v1/links/look", token=secret).json()
    assert (seen["home"], seen["role"], seen["needs_password"]) == (ANN, "viewer", True)
    assert mel.post("/api/v1/links/use", token=secret, password=PASSWORD).json() == {"signed_in": True}
    assert mel.get(robot.path()).status_code == 200
    assert mel.request("PATCH", robot.path(), json={"name": "Mine"}).status_code == 403
    (member,) = ann.get("/api/v1/household").json()["people"]
    changed = ann.request("PATCH", f"/api/v1/household/people/{member['id']}", json={"role": "member"})
    assert changed.json()["people"][0]["role"] == "member"
    assert mel.request("PATCH", robot.path(), json={"name": "Ours"}).status_code == 200
    assert mel.get("/api/v1/household").json()["homes"][0]["home"] == ANN
    assert ann.request("DELETE", f"/api/v1/household/people/{member['id']}").status_code == 204
    assert mel.get(robot.path()).status_code == 403


def test_somebody_who_has_an_account_joins_with_it_and_leaves_by_themselves(service: Service) -> None:
    add_account(service, MEL)
    ann = by_link(service, ANN)
    with posting(service) as box:
        assert ann.post("/api/v1/household/invitations", email=MEL, role="member").status_code == 201
        secret = secret_in(box, MEL)
    mel = Browser(service)
    assert mel.post("/api/v1/links/look", token=secret).json()["needs_password"] is False
    # a letter that went astray makes nobody somebody else, and sets no password
    assert mel.post("/api/v1/links/use", token=secret, password=NEW).json() == {"signed_in": False}
    assert not mel.is_in()
    assert mel.sign_in(MEL, NEW).status_code == 401
    assert mel.sign_in(MEL).status_code == 200
    (home,) = mel.get("/api/v1/household").json()["homes"]
    again = ann.post("/api/v1/household/invitations", email=MEL, role="member")
    assert again.status_code == 503  # no mail server any more: said before anything is made
    assert mel.request("DELETE", f"/api/v1/household/people/{home['id']}").status_code == 204
    assert ann.get("/api/v1/household").json()["people"] == []


def test_people_and_invitations_of_another_home_are_not_there(service: Service) -> None:
    add_account(service, MEL)
    ann, bob = by_link(service, ANN), by_link(service, BOB)
    with posting(service) as box:
        for email in (MEL, "nobody@example.org"):
            assert ann.post("/api/v1/household/invitations", email=email, role="member").status_code == 201
        Browser(service).post("/api/v1/links/use", token=secret_in(box, MEL))
    home = ann.get("/api/v1/household").json()
    (member,), (invitation,) = home["people"], home["invitations"]
    calls = [
        ("PATCH", f"/api/v1/household/people/{member['id']}", {"role": "viewer"}),
        ("DELETE", f"/api/v1/household/people/{member['id']}", None),
        ("DELETE", f"/api/v1/household/invitations/{invitation['id']}", None),
    ]
    for method, path, body in calls:
        assert bob.request(method, path, json=body).status_code == 404, path
    mel = Browser(service)
    mel.sign_in(MEL)
    assert mel.request("PATCH", calls[0][1], json={"role": "viewer"}).status_code == 404  # not one's own role
    assert ann.get("/api/v1/household").json() == home
    assert ann.request("DELETE", calls[2][1]).status_code == 204


def test_an_invitation_that_the_mail_server_does_not_take_is_none(service: Service) -> None:
    ann = by_link(service, ANN)
    with posting(service) as box:
        box.to_recipient = "550 no such mailbox"
        assert ann.post("/api/v1/household/invitations", email=MEL, role="member").status_code == 503
    assert ann.get("/api/v1/household").json()["invitations"] == []


def test_an_operator_gives_accounts_and_duties_and_sees_links_only_where_no_mail_is_sent(service: Service) -> None:
    operator = by_link(service, None)
    shown = operator.post("/api/v1/accounts/invitations", email="olga@example.org", duty="operator")
    assert shown.status_code == 201, shown.text
    assert shown.headers["Cache-Control"] == "no-store"
    secret = shown.json()["url"].partition("/invitation#")[2]
    olga = Browser(service)
    assert olga.post("/api/v1/links/use", token=secret, password=PASSWORD).json() == {"signed_in": True}
    assert olga.get("/api/v1/session").json()["kind"] == "operator"
    with posting(service) as box:
        posted = olga.post("/api/v1/accounts/invitations", email="erik@example.org", duty="engineer")
        assert posted.json()["url"] is None
        erik = Browser(service)
        erik.post("/api/v1/links/use", token=secret_in(box, "erik@example.org"), password=PASSWORD)
        assert erik.get("/api/v1/session").json()["may"] == ["account", "figures", "household", "messages", "triage"]
        accounts = {one["email"]: one for one in olga.get("/api/v1/accounts").json()["items"]}
        reset = olga.post(f"/api/v1/accounts/{accounts['erik@example.org']['id']}/password-reset")
        assert reset.json()["url"] is None
        assert box.messages[-1]["To"] == "erik@example.org"
    mine = accounts["olga@example.org"]["id"]
    assert olga.request("PATCH", f"/api/v1/accounts/{mine}", json={"duty": None}).status_code == 422
    taken = operator.request("PATCH", f"/api/v1/accounts/{mine}", json={"duty": None})
    assert taken.json()["duty"] is None
    assert olga.get("/api/v1/accounts").status_code == 403


def test_every_secret_is_kept_as_a_hash_and_written_to_no_log(
    service: Service, capfd: pytest.CaptureFixture[str]
) -> None:
    add_account(service)
    ann = Browser(service)
    ann.sign_in()
    sign_in = new_login_link(service.database, ANN)
    robot = service.add_robot("anns", ANN)
    token = ann.post("/api/v1/account/tokens", name="mine", scopes=["maps:read"]).json()["token"]
    with posting(service) as box:
        Browser(service).post("/api/v1/password-resets", email=ANN)
        box.answer = "451 not now"
        Browser(service).post("/api/v1/password-resets", email=ANN)
        reset = secret_in(box, ANN)
    Browser(service).get(f"/login?token={reset}")
    Browser(service).get(f"/login?token={sign_in}")
    Browser(service).post("/api/v1/links/use", token=reset, password="short")
    code = ann.post("/api/v1/robots/anns/release").json()["claim_code"]
    secrets = [PASSWORD, sign_in, reset, token, code, robot.token, ann.session, ann.cookies["stillroom_device"]]
    with service.database.read() as tx:
        rows = [tx.execute(sa.select(table)).all() for table in metadata.tables.values()]
    kept, logged = str(rows), "".join(capfd.readouterr())
    assert "not now" in logged
    for secret in secrets:
        assert secret not in kept
        assert secret not in logged
    assert json.dumps(PASSWORD) not in logged
