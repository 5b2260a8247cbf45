"""Who may do what: every route, every kind of caller, every robot."""

from datetime import UTC, datetime
from urllib.parse import quote

import pytest
import sqlalchemy as sa

from stillroom.api.context import SESSION_COOKIE
from stillroom.errors import Forbidden
from stillroom.service.access import OPERATOR, Person, Principal, Robot, authorise, authorise_service
from stillroom.service.accounts import new_login_link
from stillroom.store import people, robots
from stillroom.store.database import Database
from stillroom.store.rows import RobotRow
from stillroom.store.tables import metadata
from tests.conftest import Caller, RobotCaller, Service

ROBOT = "/api/v1/robots/{robot}"
MAP = ROBOT + "/maps/{map}"
INSPECTED = "/api/v1/fleet/robots/{robot}/maps/{map}/missions"
HOOK = "/api/v1/webhooks/{webhook}"
WHO = {
    "read": "robot owner member viewer caretaker",
    "upload": "robot",
    "edit": "owner member caretaker",
    "manage": "owner caretaker",
    "archive": "owner caretaker person",
    "rekey": "owner caretaker",
    "disconnect": "owner caretaker operator",
    "release": "owner",
    "any": "robot person engineer operator",
    "list": "robot person engineer operator",
    "household": "person",
    "account": "person operator",
    "messages": "person operator",
    "figures": "engineer operator",
    "triage": "engineer operator",
    "register": "operator",
    "accounts": "operator",
}
OF_ROBOTS = {
    f"GET {ROBOT}": "read",
    f"PATCH {ROBOT}": "manage",
    f"GET {ROBOT}/views": "manage",
    f"GET {ROBOT}/test": "manage",
    f"PUT {ROBOT}/test": "manage",
    f"DELETE {ROBOT}/maps": "manage",
    f"GET {ROBOT}/archive": "archive",
    f"POST {ROBOT}/archive": "manage",
    f"GET {ROBOT}/log": "manage",
    f"GET {MAP}": "read",
    f"PATCH {MAP}": "edit",
    f"GET {MAP}/versions": "read",
    f"GET {MAP}/versions/{{version}}": "read",
    f"GET {MAP}/versions/{{version}}/grid.png": "read",
    f"GET {MAP}/versions/{{version}}/cells.png": "read",
    f"GET {MAP}/versions/{{version}}/export": "read",
    f"GET {MAP}/versions/{{version}}/diff/{{other}}": "read",
    f"POST {MAP}/versions/{{version}}/restore": "edit",
    f"POST {MAP}/versions/{{version}}/undo": "edit",
    f"PATCH {MAP}/versions/{{version}}": "edit",
    f"PUT {MAP}/pin": "edit",
    f"DELETE {MAP}/pin": "edit",
    f"POST {MAP}/edits": "edit",
    f"GET {MAP}/edits/suggested": "read",
    f"GET {MAP}/rooms/{{room}}": "read",
    f"GET {MAP}/segments": "read",
    f"PUT {MAP}/missions/{{mission}}": "upload",
    f"GET {MAP}/missions": "read",
    f"GET {MAP}/missions/{{mission}}": "read",
    f"GET {MAP}/missions/{{mission}}/grid.png": "read",
    f"GET {MAP}/missions/{{mission}}/cells.png": "read",
    f"POST {MAP}/missions/{{mission}}/placement": "edit",
    f"GET {MAP}/conflicts": "read",
    f"GET {MAP}/conflicts/{{conflict}}": "read",
    f"GET {MAP}/conflicts/{{conflict}}/proposals/{{proposal}}": "read",
    f"GET {MAP}/conflicts/{{conflict}}/sensed": "read",
    f"POST {MAP}/conflicts/{{conflict}}/decision": "edit",
    f"POST {MAP}/conflicts/decision": "edit",
}
CHANGING_HANDS = {
    f"DELETE {ROBOT}/token": "disconnect",
    f"POST {ROBOT}/token": "rekey",
    f"POST {ROBOT}/release": "release",
}
"""Each on robots of its own: afterwards others may do other things to them."""
OF_THE_SERVICE = {
    "GET /api/v1/robots": "list",
    "POST /api/v1/robots": "register",
    "GET /api/v1/registry": "register",
    f"POST {ROBOT}/claim-code": "register",
    "POST /api/v1/claims": "household",
    "DELETE /api/v1/home": "household",
    "GET /api/v1/home/archive": "archive",
    "POST /api/v1/home/archive": "household",
    "GET /api/v1/home/retention": "household",
    "PUT /api/v1/home/retention": "household",
    "GET /api/v1/conflicts": "list",
    "GET /api/v1/session": "any",
    "GET /api/v1/grants": "messages",
    "POST /api/v1/fleet/grants": "triage",
    "GET /api/v1/notifications": "messages",
    "PATCH /api/v1/notifications": "messages",
    "PUT /api/v1/notifications/email": "messages",
    "DELETE /api/v1/notifications/email": "messages",
    "POST /api/v1/notifications/push/subscriptions": "messages",
    "DELETE /api/v1/notifications/push/subscriptions/{subscription}": "messages",
    "POST /api/v1/notifications/push/subscriptions/{subscription}/test": "messages",
    "GET /api/v1/webhooks": "messages",
    "POST /api/v1/webhooks": "messages",
    f"GET {HOOK}": "messages",
    f"PATCH {HOOK}": "messages",
    f"DELETE {HOOK}": "messages",
    f"POST {HOOK}/secret": "messages",
    f"POST {HOOK}/test": "messages",
    f"GET {HOOK}/deliveries": "messages",
    f"POST {HOOK}/deliveries/{{delivery}}/replay": "messages",
    "GET /api/v1/fleet/alerts": "figures",
    "POST /api/v1/fleet/alerts": "triage",
    "DELETE /api/v1/fleet/alerts/{alert}": "triage",
    "GET /api/v1/fleet/causes": "figures",
    "GET /api/v1/fleet/causes/{cause}": "figures",
    "PUT /api/v1/fleet/causes/{cause}/mute": "triage",
    "DELETE /api/v1/fleet/causes/{cause}/mute": "triage",
    "GET /api/v1/fleet/failure-rates": "figures",
    "GET /api/v1/fleet/failure-rates.csv": "figures",
    "GET /api/v1/fleet/failure-rates.parquet": "figures",
    "GET /api/v1/fleet/filters": "figures",
    "GET /api/v1/fleet/missions": "figures",
    "GET /api/v1/fleet/replays": "figures",
    "POST /api/v1/fleet/replays": "triage",
    "GET /api/v1/fleet/replays/{replay}": "figures",
    "GET /api/v1/fleet/replays/{replay}/missions": "figures",
    "GET /api/v1/fleet/robots": "figures",
    "GET /api/v1/fleet/rollouts": "figures",
    "GET /api/v1/fleet/rollouts/{rollout}": "figures",
    "GET /api/v1/fleet/rollouts/{rollout}/maps": "figures",
    "POST /api/v1/fleet/rollouts": "triage",
    "POST /api/v1/fleet/rollouts/{rollout}/advance": "triage",
    "POST /api/v1/fleet/rollouts/{rollout}/end": "triage",
    "POST /api/v1/fleet/rollouts/{rollout}/revert": "triage",
    "GET /api/v1/fleet/unprocessed": "figures",
    f"GET {INSPECTED}": "figures",
    f"GET {INSPECTED}/{{mission}}": "figures",
    f"POST {INSPECTED}/{{mission}}/run": "triage",
    "GET /api/v1/account": "account",
    "PUT /api/v1/account/password": "account",
    "POST /api/v1/account/login-links": "account",
    "GET /api/v1/account/sessions": "account",
    "DELETE /api/v1/account/sessions/{session}": "account",
    "GET /api/v1/account/tokens": "account",
    "POST /api/v1/account/tokens": "account",
    "DELETE /api/v1/account/tokens/{token}": "account",
    "GET /api/v1/household": "household",
    "POST /api/v1/household/invitations": "household",
    "DELETE /api/v1/household/invitations/{invitation}": "household",
    "PATCH /api/v1/household/people/{member}": "household",
    "DELETE /api/v1/household/people/{member}": "household",
    "GET /api/v1/accounts": "accounts",
    "GET /api/v1/accounts/invitations": "accounts",
    "POST /api/v1/accounts/invitations": "accounts",
    "DELETE /api/v1/accounts/invitations/{invitation}": "accounts",
    "PATCH /api/v1/accounts/{account}": "accounts",
    "POST /api/v1/accounts/{account}/password-reset": "accounts",
}
TOLD_APART_ELSEWHERE = {
    "GET /api/v1/events",  # a stream without an end: tests/api/test_events.py
    "DELETE /api/v1/session",  # ends what the walk needs: below
    "DELETE /api/v1/account/sessions",  # so does this: tests/people/test_signing_in.py
    "POST /api/v1/grants/{grant}/answer",  # whose they are: tests/api/test_inspection.py
    "DELETE /api/v1/grants/{grant}",
    f"GET {INSPECTED}/{{mission}}/figure",
    f"GET {INSPECTED}/{{mission}}/cells.png",
}
PUBLIC = {
    "GET /healthz",
    "GET /readyz",
    "GET /metrics",
    "GET /api/v1/sign-in",
    "POST /api/v1/session",
    "POST /api/v1/password-resets",
    "POST /api/v1/links/look",
    "POST /api/v1/links/use",
}
NAMES = {
    "map": "ground", "version": "1", "other": "1", "room": "r1", "mission": "0", "conflict": "c1", "proposal": "p1",
    "webhook": "webhook_1", "delivery": "1", "subscription": "push_1", "cause": "0" * 16, "replay": "again",
    "rollout": "bare", "alert": "doors", "session": "session_1", "token": "token_1", "invitation": "link_1",
    "member": "member_1", "account": "account_1",
}  # fmt: skip
ANN = "ann@example.org"
TARGETS = {"free": None, "anns": ANN, "bobs": "bob@example.org"}
ROLES: dict[str, tuple[dict[str, str], set[str]]] = {
    # towards robots, and in the service
    "operator": ({"free": "caretaker"}, {"operator"}),
    "olga": ({"free": "caretaker"}, {"operator", "person"}),
    "erik": ({}, {"engineer", "person"}),
    "ann": ({"anns": "owner"}, {"person"}),
    "mel": ({"anns": "member"}, {"person"}),
    "vera": ({"anns": "viewer"}, {"person"}),
    "bob": ({"bobs": "owner"}, {"person"}),
    "free": ({"free": "robot"}, {"robot"}),
    "anns": ({"anns": "robot"}, {"robot"}),
    "bobs": ({"bobs": "robot"}, {"robot"}),
    "homeless": ({}, {"robot"}),
}
NOBODY = ("stranger", "wrong token", "wrong person", "wrong session")


@pytest.fixture
def callers(service: Service) -> dict[str, Caller]:
    """Everybody, and three robots with a map: nobody's, Ann's and Bob's."""
    mapped = {name: service.add_robot(name, owner) for name, owner in TARGETS.items()}
    for robot in mapped.values():
        assert robot.upload("0").status_code == 201
    lost = service.add_robot("homeless", ANN)
    with service.database.write() as tx:
        now = datetime.now(UTC)
        for name, duty in (("olga", "operator"), ("erik", "engineer"), ("mel", None), ("vera", None)):
            people.find_or_add(tx, f"{name}@example.org", now)
            people.change(tx, f"{name}@example.org", {"duty": duty})
        people.join(tx, ANN, "mel@example.org", "member", now)
        people.join(tx, ANN, "vera@example.org", "viewer", now)
        robots.change(tx, "homeless", {"owner": None, "released_at": now})
    signed = {name: signed_in(service, f"{name}@example.org") for name in ("olga", "erik", "ann", "mel", "vera", "bob")}
    return {
        "operator": service.operator,
        **signed,
        **mapped,
        "homeless": lost,
        "stranger": service.stranger,
        "wrong token": Caller(service.http, {"Authorization": "Bearer srt_wrong"}),
        "wrong person": Caller(service.http, {"Authorization": "Bearer stp_wrong"}),
        "wrong session": Caller(service.http, {"Cookie": f"{SESSION_COOKIE}=wrong", "Sec-Fetch-Site": "same-origin"}),
    }


def signed_in(service: Service, owner: str | None = None) -> Caller:
    answer = service.http.get(f"/login?token={new_login_link(service.database, owner)}", follow_redirects=False)
    assert answer.status_code == 303
    cookie = answer.cookies[SESSION_COOKIE]
    service.http.cookies.clear()
    return Caller(service.http, {"Cookie": f"{SESSION_COOKIE}={cookie}", "Sec-Fetch-Site": "same-origin"})


def refused(caller: Caller, route: str, robot: str = "anns") -> int | None:
    """401 or 403 where the caller may not; None where the request got past that."""
    method, path = route.split()
    status = caller.request(method, path.format(robot=robot, **NAMES)).status_code
    assert status not in (405, 500), route
    return status if status in (401, 403) else None


@pytest.mark.parametrize("engine", ["sqlite"])  # what differs between engines is elsewhere
def test_each_route_of_a_robot_lets_pass_those_and_only_those_who_may(callers: dict[str, Caller]) -> None:
    for route, action in OF_ROBOTS.items():
        for target in TARGETS:
            for name, caller in callers.items():
                if name in NOBODY and target != "anns":
                    continue
                towards = {} if name in NOBODY else ROLES[name][0]
                allowed = towards.get(target, "nothing") in WHO[action].split()
                expected = None if allowed else 401 if name in NOBODY else 403
                assert refused(caller, route, target) == expected, (name, route, target)


@pytest.mark.parametrize("engine", ["sqlite"])  # what differs between engines is elsewhere
def test_each_route_of_the_service_lets_pass_those_and_only_those_who_may(callers: dict[str, Caller]) -> None:
    for route, action in OF_THE_SERVICE.items():
        for name, caller in callers.items():
            if name in ("free", "bobs", "bob", "vera"):  # in the service like others
                continue
            allowed = name not in NOBODY and bool(ROLES[name][1] & set(WHO[action].split()))
            expected = None if allowed else 401 if name in NOBODY else 403
            assert refused(caller, route) == expected, (name, route)


@pytest.mark.parametrize("engine", ["sqlite"])
@pytest.mark.parametrize("route", CHANGING_HANDS)
def test_those_and_only_those_who_may_change_whose_a_robot_is(
    service: Service, callers: dict[str, Caller], route: str
) -> None:
    for target, owner in TARGETS.items():
        for name, caller in callers.items():
            other = f"{target}-{name.replace(' ', '-')}"
            if name in TARGETS and name == target:
                caller = service.add_robot(other, owner)  # a robot about itself
            else:
                service.add_robot(other, owner)
            roles = set() if name in NOBODY else {ROLES[name][0].get(target, "nothing"), *ROLES[name][1]} - {"person"}
            allowed = roles & (set(WHO[CHANGING_HANDS[route]].split()) - {"robot"})
            expected = None if allowed else 401 if name in NOBODY else 403
            assert refused(caller, route, other) == expected, (name, route, target)


def test_the_tables_above_name_every_route_that_is_not_public(service: Service) -> None:
    spec = service.http.get("/openapi.json").json()["paths"]
    routes = {f"{method.upper()} {path}" for path, methods in spec.items() for method in methods}
    assert routes == {*OF_ROBOTS, *CHANGING_HANDS, *OF_THE_SERVICE, *TOLD_APART_ELSEWHERE, *PUBLIC}
    for route in TOLD_APART_ELSEWHERE:
        assert refused(service.stranger, route.replace("{grant}", "grant_1")) == 401, route


def test_everybody_sees_the_robots_they_may_read_and_no_others(callers: dict[str, Caller]) -> None:
    def seen(name: str) -> list[str]:
        return [robot["id"] for robot in callers[name].get("/api/v1/robots").json()["items"]]

    assert seen("operator") == ["free", "homeless"]
    assert seen("olga") == ["free", "homeless"]
    assert seen("ann") == seen("mel") == seen("vera") == ["anns"]
    assert seen("erik") == []
    assert seen("bobs") == ["bobs"]
    assert callers["stranger"].get("/api/v1/robots").status_code == 401


def test_the_list_of_robots_says_what_may_be_done_to_each(callers: dict[str, Caller]) -> None:
    actions = ("read", "upload", "edit", "manage", "archive", "rekey", "disconnect", "release")
    for name in ROLES:
        for robot in callers[name].get("/api/v1/robots").json()["items"]:
            if robot["id"] == "homeless" and name == "homeless":
                continue
            roles = {ROLES[name][0].get(robot["id"], "caretaker"), *ROLES[name][1]} - {"person"}
            if name not in TARGETS:
                roles -= {"robot"}
            assert robot["may"] == [action for action in actions if roles & set(WHO[action].split())], (name, robot)


def test_the_service_says_whom_it_takes_the_caller_for(callers: dict[str, Caller]) -> None:
    def told(name: str) -> tuple[str, str | None]:
        caller = callers[name].get("/api/v1/session").json()
        return caller["kind"], caller["id"]

    assert told("operator") == ("operator", None)
    assert told("olga") == ("operator", "olga@example.org")
    assert told("erik") == ("engineer", "erik@example.org")
    assert told("ann") == ("person", ANN)
    assert told("bobs") == ("robot", "bobs")


def test_only_operators_learn_that_a_robot_is_not_there(callers: dict[str, Caller]) -> None:
    path = MAP.format(robot="nobody", map="ground")
    assert callers["operator"].get(path).status_code == 404
    assert callers["ann"].get(path).status_code == 403
    assert callers["free"].get(path).status_code == 403


def test_a_refusal_says_how_to_identify_oneself(service: Service) -> None:
    answer = service.stranger.get("/api/v1/robots")
    assert answer.headers["WWW-Authenticate"].startswith("Bearer")
    assert answer.json()["type"] == "/problems/unauthenticated"
    assert service.http.get("/api/v1/robots", headers={"Authorization": "Basic eDp5"}).status_code == 401


def test_a_sign_in_link_works_once_and_gives_a_cookie_that_scripts_cannot_read(service: Service) -> None:
    link = f"/login?token={new_login_link(service.database)}"
    first = service.http.get(link, follow_redirects=False)
    assert (first.status_code, first.headers["Location"]) == (303, "/")
    assert {"HttpOnly", "SameSite=lax"} <= set(first.headers["Set-Cookie"].split("; "))
    service.http.cookies.clear()
    assert service.http.get(link, follow_redirects=False).status_code == 401
    browser = service.http.get(link, headers={"Accept": "text/html"}, follow_redirects=False)
    assert (browser.status_code, browser.headers["Location"]) == (303, "/")
    assert "Set-Cookie" not in browser.headers


QUESTION = "/robots/RB%201/maps/ground/conflicts/c1?answer=accept:p1"


@pytest.mark.parametrize(
    ("wanted", "page"),
    [
        (QUESTION, QUESTION),
        ("", "/"),
        ("questions", "/"),
        ("//evil.test", "/"),
        ("///evil.test", "/"),
        ("/\\evil.test", "/"),
        ("\\\\evil.test", "/"),
        ("/\t/evil.test", "/"),
        ("/questions\r\nSet-Cookie: a=b", "/"),
        ("https://evil.test/", "/"),
        ("javascript:alert(1)", "/"),
        ("/é", "/"),
        ("/" + "a" * 1001, "/"),
    ],
)
def test_signing_in_leads_on_to_a_page_of_this_service_and_nowhere_else(
    service: Service, wanted: str, page: str
) -> None:
    link = f"/login?token={new_login_link(service.database)}"
    cookie = f"stillroom_next={quote(wanted, safe='')}"
    answer = service.http.get(link, headers={"Cookie": cookie}, follow_redirects=False)
    assert (answer.status_code, answer.headers["Location"]) == (303, page)
    forgets = [value for value in answer.headers.get_list("Set-Cookie") if value.startswith("stillroom_next=")]
    assert ["Max-Age=0" in value and "Path=/login" in value for value in forgets] == [True]


def test_a_session_ends_when_its_owner_signs_out(service: Service) -> None:
    person = signed_in(service)
    assert person.get("/api/v1/robots").status_code == 200
    assert person.request("DELETE", "/api/v1/session").status_code == 204
    assert person.get("/api/v1/robots").status_code == 401


@pytest.mark.parametrize(
    ("headers", "allowed"),
    [
        ({"Sec-Fetch-Site": "same-origin"}, True),
        ({"Sec-Fetch-Site": "none"}, True),
        ({"Sec-Fetch-Site": "same-site"}, False),
        ({"Sec-Fetch-Site": "cross-site"}, False),
        ({"Origin": "http://stillroom.test"}, True),
        ({"Origin": "http://evil.test"}, False),
        ({"Origin": "null"}, False),
        ({"Sec-Fetch-Site": "cross-site", "Origin": "http://stillroom.test"}, False),
        ({}, False),
    ],
)
def test_another_site_cannot_make_a_browser_change_anything(
    service: Service, mapped: RobotCaller, headers: dict[str, str], allowed: bool
) -> None:
    cookie = signed_in(service).headers["Cookie"]
    browser = Caller(service.http, {"Cookie": cookie} | headers)
    assert browser.get(mapped.path()).status_code == 200
    assert browser.request("PATCH", mapped.path(), json={"name": "Mine"}).status_code == (200 if allowed else 403)


def test_secrets_are_kept_as_hashes_only(service: Service, robot: RobotCaller) -> None:
    link = new_login_link(service.database)
    with service.database.read() as tx:
        content = str([tx.execute(sa.select(table)).all() for table in metadata.tables.values()])
    assert robot.id in content
    assert robot.token not in content
    assert link not in content


def test_what_nobody_has_allowed_is_refused(database: Database) -> None:
    with database.write() as tx:
        robots.add(tx, RobotRow("RB-1", "RB-1", ANN, datetime.now(UTC)), "t", "c")
    principals: list[Principal] = [OPERATOR, Person(ANN), Robot("RB-1"), Robot("RB-1", homeless=True)]
    for principal in principals:
        with pytest.raises(KeyError):
            authorise(database, principal, "burn", "RB-1")  # type: ignore[arg-type]
    with pytest.raises(Forbidden):
        authorise_service(Person(None), "list")
