"""Signing in by password, and what people try against it."""

from datetime import timedelta

import pytest
from argon2 import PasswordHasher

from stillroom.service.accounts import new_login_link
from stillroom.service.people import passwords
from tests.conftest import Service
from tests.people.browsers import ANN, BOB, PASSWORD, Browser, add_account, by_link, later


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The work is counted, not waited for."""
    monkeypatch.setattr(passwords, "HASHER", PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))


def test_a_password_signs_in_and_the_cookie_is_new_whatever_was_sent_before(service: Service) -> None:
    add_account(service)
    browser = Browser(service, cookies={"stillroom_session": "planted-by-somebody"})
    answer = browser.sign_in(" Ann@Example.ORG".strip())
    assert answer.status_code == 200, answer.text
    first = browser.session
    assert first != "planted-by-somebody"
    assert browser.get("/api/v1/session").json()["id"] == ANN
    assert not Browser(service, cookies={"stillroom_session": "planted-by-somebody"}).is_in()
    for said in answer.headers.get_list("Set-Cookie"):
        assert {"HttpOnly", "SameSite=lax", "Path=/"} <= set(said.split("; ")), said
    assert browser.sign_in().status_code == 200
    assert browser.session != first
    assert not Browser(service, cookies={"stillroom_session": first}).is_in()


def test_cookies_are_for_https_alone_where_the_service_is_reached_by_it(service: Service) -> None:
    add_account(service)
    plain = Browser(service).sign_in()
    assert all("Secure" not in said for said in plain.headers.get_list("Set-Cookie"))
    service.http.base_url = "https://stillroom.test"
    safe = Browser(service).sign_in()
    assert len(safe.headers.get_list("Set-Cookie")) == 2
    assert all("Secure" in said.split("; ") for said in safe.headers.get_list("Set-Cookie"))


@pytest.mark.parametrize(
    "headers",
    [
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Sec-Fetch-Site": "", "Origin": "http://evil.test"},
    ],
)
def test_no_other_site_signs_anybody_in_or_out_or_changes_an_account(service: Service, headers: dict[str, str]) -> None:
    add_account(service)
    browser = by_link(service, ANN)
    calls = [
        ("POST", "/api/v1/session", {"email": ANN, "password": PASSWORD}),
        ("POST", "/api/v1/password-resets", {"email": ANN}),
        ("POST", "/api/v1/links/look", {"token": "x"}),
        ("POST", "/api/v1/links/use", {"token": "x"}),
        ("DELETE", "/api/v1/session", None),
        ("PUT", "/api/v1/account/password", {"current": PASSWORD, "new": "another long passphrase"}),
        ("POST", "/api/v1/account/tokens", {"name": "evil", "scopes": ["maps:edit"]}),
        ("POST", "/api/v1/account/login-links", None),
        ("DELETE", "/api/v1/account/sessions", None),
        ("POST", "/api/v1/household/invitations", {"email": BOB, "role": "member"}),
        ("POST", "/api/v1/claims", {"claim_code": "AAAA-BBBB-CCCC"}),
    ]
    for method, path, body in calls:
        assert browser.request(method, path, headers, json=body).status_code == 403, path
    assert browser.is_in()


def test_it_takes_the_same_work_and_gives_the_same_answer_whether_somebody_has_an_account_or_not(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_account(service)
    add_account(service, BOB, password=None)
    work: list[tuple[int, int, int]] = []
    hasher = passwords.HASHER

    class Counting:
        def verify(self, password_hash: str, password: str) -> bool:
            work.append((hasher.time_cost, hasher.memory_cost, len(password)))
            return hasher.verify(password_hash, password)

    monkeypatch.setattr(passwords, "HASHER", Counting())
    answers = [Browser(service).sign_in(email, "wrong passphrase") for email in (ANN, BOB, "nobody@example.org")]
    assert [answer.status_code for answer in answers] == [401, 401, 401]
    assert len({answer.content for answer in answers}) == 1
    assert all("Set-Cookie" not in answer.headers for answer in answers)
    assert len(work) == 3
    assert len(set(work)) == 1


def test_the_password_of_nobody_takes_the_work_of_everybodys() -> None:
    assert not PasswordHasher().check_needs_rehash(passwords._OF_NOBODY)


def test_guessing_is_slowed_down_for_who_guesses_and_for_nobody_else(service: Service) -> None:
    add_account(service)
    home = Browser(service, "198.51.100.20")
    assert home.sign_in().status_code == 200
    attacker = Browser(service, "203.0.113.66")
    statuses = [attacker.sign_in(password=f"guess number {n} of many").status_code for n in range(7)]
    assert statuses == [401, 401, 401, 401, 401, 429, 429]
    refused = attacker.sign_in()  # also the right one, while it has to wait
    assert refused.status_code == 429
    assert 0 < int(refused.headers["Retry-After"]) <= 16
    assert Browser(service, "198.51.100.21").sign_in().status_code == 200
    later(service, timedelta(seconds=20))
    assert attacker.sign_in(password="guess number 8 of many").status_code == 401
    assert int(attacker.sign_in().headers["Retry-After"]) > 16
    later(service, timedelta(hours=3))
    assert attacker.sign_in().status_code == 200


def test_nobody_is_shut_out_of_a_browser_of_theirs_by_others(service: Service) -> None:
    add_account(service)
    known = Browser(service, "203.0.113.66")
    assert known.sign_in().status_code == 200
    assert known.request("DELETE", "/api/v1/session").status_code == 204
    for n in range(106):  # from everywhere, and from where the person is
        Browser(service, known.source if n < 6 else f"192.0.2.{n}").sign_in(password="guess of a passphrase")
    assert Browser(service, "198.51.100.9").sign_in().status_code == 429
    assert known.sign_in().status_code == 200
    assert Browser(service, known.source, {"stillroom_device": "made.up"}).sign_in().status_code == 429


def test_a_known_browser_is_known_to_one_person_alone(service: Service) -> None:
    add_account(service)
    add_account(service, BOB)
    attacker = Browser(service)
    assert attacker.sign_in(BOB).status_code == 200
    statuses = [attacker.sign_in(password=f"guess number {n} of many").status_code for n in range(6)]
    assert statuses == [401] * 5 + [429]


def test_an_account_that_is_switched_off_works_no_more(service: Service) -> None:
    add_account(service)
    browser = Browser(service)
    assert browser.sign_in().status_code == 200
    operator = by_link(service, None)
    (account,) = operator.get("/api/v1/accounts").json()["items"]
    token = browser.post("/api/v1/account/tokens", name="mine", scopes=["maps:read"]).json()["token"]
    off = operator.request("PATCH", f"/api/v1/accounts/{account['id']}", json={"disabled": True})
    assert off.json()["disabled_at"] is not None
    assert not browser.is_in()
    assert Browser(service).sign_in().status_code == 401
    assert service.http.get("/api/v1/robots", headers={"Authorization": f"Bearer {token}"}).status_code == 401
    on = operator.request("PATCH", f"/api/v1/accounts/{account['id']}", json={"disabled": False})
    assert on.json()["disabled_at"] is None
    later(service, timedelta(hours=3))
    assert Browser(service).sign_in().status_code == 200


def test_a_new_password_signs_all_other_browsers_out(service: Service) -> None:
    add_account(service)
    mine, other = Browser(service), Browser(service)
    assert mine.sign_in().status_code == other.sign_in().status_code == 200
    before = mine.session
    change = {"current": "not that one", "new": "another long passphrase"}
    assert mine.request("PUT", "/api/v1/account/password", json=change).status_code == 403
    change["current"] = PASSWORD
    assert mine.request("PUT", "/api/v1/account/password", json=change).status_code == 204
    assert [mine.is_in(), other.is_in(), mine.session == before] == [True, False, False]
    assert Browser(service).sign_in().status_code == 401
    assert Browser(service).sign_in(password="another long passphrase").status_code == 200


@pytest.mark.parametrize(
    ("password", "detail"), [("short", "shorter"), ("a" * 20, "different"), (f"x {ANN} x", "address")]
)
def test_a_password_that_is_guessed_at_once_is_refused(service: Service, password: str, detail: str) -> None:
    answer = by_link(service, ANN).request("PUT", "/api/v1/account/password", json={"new": password})
    assert answer.status_code == 422
    (fault,) = answer.json()["errors"]
    assert fault["pointer"] == "/new"
    assert detail in fault["detail"]


def test_a_password_that_was_kept_with_weaker_parameters_is_kept_anew(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_account(service)
    monkeypatch.setattr(passwords, "HASHER", PasswordHasher(time_cost=2, memory_cost=16, parallelism=1))
    assert Browser(service).sign_in().status_code == 200
    assert passwords.rehashed(_kept(service), PASSWORD) is None
    assert Browser(service).sign_in().status_code == 200


def _kept(service: Service) -> str:
    from stillroom.store import people

    with service.database.read() as tx:
        found = people.find(tx, ANN)
    assert found is not None
    assert found.password_hash is not None
    return found.password_hash


def test_people_see_which_browsers_are_signed_in_and_sign_them_out(service: Service) -> None:
    add_account(service)
    mine, phone, bobs = by_link(service, ANN), by_link(service, ANN), by_link(service, BOB)
    items = mine.get("/api/v1/account/sessions").json()["items"]
    assert [item["current"] for item in items].count(True) == 1
    assert len(items) == 2
    other = next(item for item in items if not item["current"])
    assert bobs.request("DELETE", f"/api/v1/account/sessions/{other['id']}").status_code == 404
    assert phone.is_in()
    assert mine.request("DELETE", f"/api/v1/account/sessions/{other['id']}").status_code == 204
    assert not phone.is_in()
    assert mine.request("DELETE", "/api/v1/account/sessions").status_code == 204
    assert mine.is_in()
    assert bobs.is_in()


def test_a_link_for_another_browser_signs_it_in_as_the_same_person(service: Service) -> None:
    made = by_link(service, ANN).post("/api/v1/account/login-links").json()
    phone = Browser(service)
    assert phone.get(made["url"].removeprefix("https://maps.example.org")).status_code == 303
    assert phone.get("/api/v1/session").json()["id"] == ANN


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_link_on_another_site_signs_nobody_in_as_somebody_else_unasked(service: Service, site: str) -> None:
    """Else whoever lures somebody to a link of their own sees what is done then: the robot that is claimed, say."""
    link, ann = f"/login?token={new_login_link(service.database, BOB)}", by_link(service, ANN)
    for language, question in (("en", "Sign in?"), ("de", "Anmelden?")):
        asked = ann.request("GET", link, {"Sec-Fetch-Site": site, "Accept-Language": language})
        assert (asked.status_code, asked.headers["Cache-Control"]) == (200, "no-store")
        assert question in asked.text
        assert BOB in asked.text
    assert ann.get("/api/v1/session").json()["id"] == ANN
    assert ann.request("POST", link, {"Sec-Fetch-Site": site}).status_code == 403
    assert ann.get("/api/v1/session").json()["id"] == ANN
    assert ann.request("POST", link).status_code == 303
    assert ann.get("/api/v1/session").json()["id"] == BOB
    used = ann.request("GET", link, {"Sec-Fetch-Site": site, "Accept": "text/html"})
    assert (used.status_code, used.headers["Location"]) == (303, "/")


SCOPED = {
    "maps:read": {"GET /api/v1/robots": 200, "PATCH {map}": 403, "GET /api/v1/fleet/causes": 403},
    "maps:edit": {"GET /api/v1/robots": 200, "PATCH {map}": 200, "POST /api/v1/robots/anns/release": 403},
    "archives": {
        "GET /api/v1/home/archive": 200,
        "GET /api/v1/robots/anns/archive": 200,
        "POST /api/v1/robots/anns/archive": 403,
        "POST /api/v1/home/archive": 403,
        "GET /api/v1/robots/anns/log": 403,
        "GET {map}": 403,
        "DELETE /api/v1/home": 403,
    },
    "messages": {"GET /api/v1/webhooks": 200, "GET {map}": 403, "GET /api/v1/robots": 403},
}


def test_a_token_may_do_what_it_is_for_and_nothing_of_the_account(service: Service) -> None:
    robot = service.add_robot("anns", ANN)
    assert robot.upload("0").status_code == 201
    ann, bob = by_link(service, ANN), by_link(service, BOB)
    for scope, calls in SCOPED.items():
        made = ann.post("/api/v1/account/tokens", name=scope, scopes=[scope]).json()
        assert made["token"].startswith("stp_")
        bearer = {"Authorization": f"Bearer {made['token']}"}
        for call, expected in calls.items():
            method, path = call.format(map=robot.path()).split()
            body = {"name": "Ground floor"} if method == "PATCH" else None
            assert service.http.request(method, path, headers=bearer, json=body).status_code == expected, call
        for path in ("/api/v1/account", "/api/v1/account/tokens", "/api/v1/household", "/api/v1/accounts"):
            assert service.http.get(path, headers=bearer).status_code == 403, path
        assert bob.request("DELETE", f"/api/v1/account/tokens/{made['id']}").status_code == 404
        assert ann.request("DELETE", f"/api/v1/account/tokens/{made['id']}").status_code == 204
        assert service.http.get("/api/v1/session", headers=bearer).status_code == 401
    refused = ann.post("/api/v1/account/tokens", name="too much", scopes=["fleet:read"])
    assert refused.status_code == 422
