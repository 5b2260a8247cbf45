"""Every error is application/problem+json."""

from typing import Any

import pytest

from stillroom import errors
from stillroom.api.problems import STATUS_CODES
from tests.conftest import RobotCaller, Service


@pytest.mark.parametrize(
    ("method", "path", "status", "slug"),
    [
        ("GET", "/api/v1/nothing", 404, "not-found"),
        ("PUT", "/api/v1/nothing", 404, "not-found"),
        ("DELETE", "/api/v1/robots", 405, "method-not-allowed"),
        ("GET", "/api/v1/robots?limit=0", 422, "invalid-input"),
        ("GET", "/api/v1/robots/a%20b/maps/ground", 422, "invalid-input"),
        ("GET", "/assets/nothing.js", 404, "not-found"),
    ],
)
def test_errors_of_the_framework_are_problems_too(
    service: Service, method: str, path: str, status: int, slug: str
) -> None:
    answer = service.operator.request(method, path)
    problem = answer.json()
    assert (answer.status_code, answer.headers["Content-Type"]) == (status, "application/problem+json")
    assert (problem["type"], problem["status"]) == (f"/problems/{slug}", status)
    assert {"title", "detail", "errors", "retryable"} <= problem.keys()


def test_a_method_that_is_not_there_names_those_that_are(service: Service) -> None:
    assert service.operator.request("DELETE", "/api/v1/robots").headers["Allow"] == "GET, POST"
    assert service.operator.request("POST", "/api/v1/robots/a/maps/b").headers["Allow"] == "GET, PATCH"


def test_json_that_is_broken_is_a_problem(service: Service) -> None:
    headers = {"Content-Type": "application/json"}
    answer = service.operator.request("POST", "/api/v1/robots", headers, content=b'{"id": ')
    assert (answer.status_code, answer.headers["Content-Type"]) == (422, "application/problem+json")


def test_an_error_nobody_thought_of_is_a_problem_and_tells_nothing_of_the_inside(
    mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stillroom.service.maps.stored_map", lambda *_: 1 / 0)
    answer = mapped.get(mapped.path())
    assert (answer.status_code, answer.json()["type"]) == (500, "/problems/internal")
    assert "division" not in answer.text


@pytest.mark.parametrize(
    "path", ["/rooms/%00", "/rooms/a%00b", "/missions/%00", "/versions/%00", "/missions?cursor=%00"]
)
def test_characters_that_no_database_keeps_are_nobodys_name(mapped: RobotCaller, path: str) -> None:
    assert mapped.get(mapped.path() + path).status_code in (404, 422)
    assert mapped.get("/api/v1/events?robot=%00").status_code == 422
    assert mapped.get("/api/v1/events?map=%00").status_code == 422


def test_fields_that_are_kept_and_ignored_may_hold_any_text(robot: RobotCaller) -> None:
    odd: dict[str, Any] = {"note": "\x00 \U0001f916", "more": {"\x00": [10**30, -0.0, 1e300]}}
    made = robot.upload("0", **odd)
    assert (made.status_code, robot.upload("0", **odd).status_code) == (201, 200), made.text


def test_a_busy_database_says_when_to_come_again(robot: RobotCaller, monkeypatch: pytest.MonkeyPatch) -> None:
    def busy(*_: object) -> None:
        raise errors.Unavailable("The database does not answer at the moment.")

    monkeypatch.setattr("stillroom.service.uploads.maps.get_or_add", busy)
    answer = robot.upload("0")
    assert (answer.status_code, answer.json()["retryable"], answer.headers["Retry-After"]) == (503, True, "5")


def kinds(of: type[errors.StillroomError]) -> list[type[errors.StillroomError]]:
    return [of, *(deeper for kind in of.__subclasses__() for deeper in kinds(kind))]


@pytest.mark.parametrize("kind", kinds(errors.StillroomError)[1:])
def test_every_error_has_a_status_and_a_page_that_explains_it(
    service: Service, kind: type[errors.StillroomError]
) -> None:
    assert any(known in kind.__mro__ for known in STATUS_CODES)
    page = service.stranger.get(f"/problems/{kind.slug}")
    assert (page.status_code, page.headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    assert kind.title.replace("'", "&#x27;") in page.text


def test_errors_have_slugs_of_their_own() -> None:
    slugs = [kind.slug for kind in kinds(errors.StillroomError)]
    assert len(slugs) == len(set(slugs))


@pytest.mark.parametrize("robot_id", ["", "a b", "-a", "a/b", "ä", "a" * 65])
def test_a_robots_id_keeps_to_what_paths_can_carry(service: Service, robot_id: str) -> None:
    answer = service.operator.request("POST", "/api/v1/robots", json={"id": robot_id})
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, "/id")


def test_a_robot_that_exists_is_not_made_again(service: Service, robot: RobotCaller) -> None:
    again = service.operator.request("POST", "/api/v1/robots", json={"id": robot.id, "name": "Other"})
    assert (again.status_code, again.json()["type"]) == (409, "/problems/already-exists")
    assert robot.get("/api/v1/robots").json()["items"][0]["name"] == robot.id
