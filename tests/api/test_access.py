"""Who may do what: every route, every kind of caller."""

from datetime import UTC, datetime
from urllib.parse import quote

import pytest
import sqlalchemy as sa

from stillroom.api.context import SESSION_COOKIE
from stillroom.errors import Forbidden
from stillroom.service.accounts import Operator, Owner, Principal, Robot, authorise, new_login_link
from stillroom.store.rows import RobotRow
from stillroom.store.tables import metadata
from tests.conftest import Caller, RobotCaller, Service

MAP = "/api/v1/robots/{robot}/maps/ground"
PUBLIC = {"/healthz", "/readyz", "/metrics", "/openapi.json", "/problems/{slug}", "/login", "/{path:path}"}
OWN = {
    ("GET", f"{MAP}"): "read",
    ("PATCH", f"{MAP}"): "edit",
    ("GET", f"{MAP}/versions"): "read",
    ("GET", f"{MAP}/versions/1"): "read",
    ("GET", f"{MAP}/versions/1/grid.png"): "read",
    ("GET", f"{MAP}/versions/1/cells.png"): "read",
    ("GET", f"{MAP}/versions/1/export"): "read",
    ("POST", f"{MAP}/versions/1/restore"): "edit",
    ("POST", f"{MAP}/versions/1/undo"): "edit",
    ("PATCH", f"{MAP}/versions/1"): "edit",
    ("GET", f"{MAP}/versions/1/diff/1"): "read",
    ("PUT", f"{MAP}/pin"): "edit",
    ("DELETE", f"{MAP}/pin"): "edit",
    ("POST", f"{MAP}/edits"): "edit",
    ("GET", f"{MAP}/edits/suggested"): "read",
    ("GET", f"{MAP}/rooms/r1"): "read",
    ("GET", f"{MAP}/segments"): "read",
    ("PUT", f"{MAP}/missions/1"): "upload",
    ("GET", f"{MAP}/missions"): "read",
    ("GET", f"{MAP}/missions/0"): "read",
    ("GET", f"{MAP}/missions/0/grid.png"): "read",
    ("POST", f"{MAP}/missions/0/placement"): "edit",
    ("GET", f"{MAP}/conflicts"): "read",
    ("GET", f"{MAP}/conflicts/c1"): "read",
    ("GET", f"{MAP}/conflicts/c1/proposals/p1"): "read",
    ("GET", f"{MAP}/conflicts/c1/sensed"): "read",
    ("POST", f"{MAP}/conflicts/c1/decision"): "edit",
    ("POST", f"{MAP}/conflicts/decision"): "edit",
    ("GET", f"{MAP}/missions/0/cells.png"): "read",
}
MAY = {"robot": {"read", "upload"}, "person": {"read", "edit"}}


@pytest.fixture
def callers(service: Service) -> dict[str, Caller]:
    """Everybody, and three robots with a map: nobody's, Ann's and Bob's."""
    robots = {
        name: service.add_robot(name, owner)
        for name, owner in (("free", None), ("anns", "ann@example.org"), ("bobs", "bob@example.org"))
    }
    for robot in robots.values():
        assert robot.upload("0").status_code == 201
    return {
        "operator": service.operator,
        "ann": signed_in(service, "ann@example.org"),
        "stranger": service.stranger,
        "wrong token": Caller(service.http, {"Authorization": "Bearer srt_wrong"}),
        "wrong session": Caller(service.http, {"Cookie": f"{SESSION_COOKIE}=wrong", "Sec-Fetch-Site": "same-origin"}),
        **robots,
    }


def signed_in(service: Service, owner: str | None = None) -> Caller:
    answer = service.http.get(f"/login?token={new_login_link(service.database, owner)}", follow_redirects=False)
    assert answer.status_code == 303
    cookie = answer.cookies[SESSION_COOKIE]
    service.http.cookies.clear()
    return Caller(service.http, {"Cookie": f"{SESSION_COOKIE}={cookie}", "Sec-Fetch-Site": "same-origin"})


def refused(caller: Caller, method: str, path: str) -> int | None:
    """401 or 403 where the caller may not; None where the request got past that."""
    status = caller.request(method, path).status_code
    assert status != 500
    return status if status in (401, 403) else None


@pytest.mark.parametrize(("route", "action"), OWN.items(), ids=lambda value: str(value))
def test_a_route_of_a_map_lets_pass_those_and_only_those_who_may(
    callers: dict[str, Caller], route: tuple[str, str], action: str
) -> None:
    method, template = route
    for target in ("free", "anns", "bobs"):
        path = template.format(robot=target)
        allowed = {
            target: action in MAY["robot"],
            "operator": target == "free" and action in MAY["person"],
            "ann": target == "anns" and action in MAY["person"],
        }
        for name, caller in callers.items():
            status = refused(caller, method, path)
            if name in ("stranger", "wrong token", "wrong session"):
                assert status == 401, (name, method, path)
            else:
                assert (status is None) == allowed.get(name, False), (name, method, path, status)


def test_the_table_above_names_every_route_that_is_not_public(service: Service) -> None:
    spec = service.http.get("/openapi.json").json()["paths"]
    people = ("/api/v1/notifications", "/api/v1/webhooks", "/api/v1/fleet", "/api/v1/grants")
    whose = {path for path in spec if path.startswith(people) or path.endswith(("/views", "/test"))}
    of_maps = {
        (method.upper(), path)
        for path, methods in spec.items()
        for method in methods
        if "/maps/{map}" in path and path not in whose
    }
    listed = {
        (
            method,
            path.format(robot="{robot}")
            .replace("ground", "{map}")
            .replace("diff/1", "diff/{other}")
            .replace("/1/", "/{version}/")
            .replace("versions/1", "versions/{version}")
            .replace("rooms/r1", "rooms/{room}")
            .replace("missions/1", "missions/{mission}")
            .replace("missions/0", "missions/{mission}")
            .replace("conflicts/c1", "conflicts/{conflict}")
            .replace("proposals/p1", "proposals/{proposal}"),
        )
        for method, path in OWN
    }
    assert listed == of_maps
    others = {path for path in spec if "/maps/{map}" not in path} - PUBLIC - whose
    assert others == {"/api/v1/robots", "/api/v1/session", "/api/v1/events", "/api/v1/conflicts"}
    for path in whose:  # whose they are, is in their own tests; here: nobody without a credential, and no robot
        for method in spec[path]:
            there = path.format(webhook="webhook_1", delivery=1, subscription="push_1", cause="0" * 16,
                robot="RB-1", map="ground", mission="0", grant="grant_1", replay="again")  # fmt: skip
            assert refused(service.stranger, method.upper(), there) == 401, path


def test_robots_are_made_by_operators_alone(callers: dict[str, Caller]) -> None:
    for name, caller in callers.items():
        answer = caller.request("POST", "/api/v1/robots", json={"id": f"new-{len(name)}"})
        expected = {"operator": 201, "stranger": 401, "wrong token": 401, "wrong session": 401}.get(name, 403)
        assert answer.status_code == expected, name


def test_everybody_sees_the_robots_they_may_read_and_no_others(callers: dict[str, Caller]) -> None:
    def seen(name: str) -> list[str]:
        return [robot["id"] for robot in callers[name].get("/api/v1/robots").json()["items"]]

    assert seen("operator") == ["free"]
    assert seen("ann") == ["anns"]
    assert seen("bobs") == ["bobs"]
    assert callers["stranger"].get("/api/v1/robots").status_code == 401


def test_the_service_says_whom_it_takes_the_caller_for(callers: dict[str, Caller]) -> None:
    def told(name: str) -> tuple[str, str | None]:
        caller = callers[name].get("/api/v1/session").json()
        return caller["kind"], caller["id"]

    assert told("operator") == ("operator", None)
    assert told("ann") == ("owner", "ann@example.org")
    assert told("bobs") == ("robot", "bobs")


def test_only_operators_learn_that_a_robot_is_not_there(callers: dict[str, Caller]) -> None:
    path = MAP.format(robot="nobody")
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


def test_what_nobody_has_allowed_is_refused() -> None:
    row = RobotRow("RB-1", "RB-1", "ann@example.org", datetime.now(UTC))
    principals: list[Principal] = [Operator(), Owner("ann@example.org"), Robot("RB-1")]
    for principal in principals:
        with pytest.raises(Forbidden):
            authorise(principal, "delete", "RB-1", lambda: row)  # type: ignore[arg-type]
