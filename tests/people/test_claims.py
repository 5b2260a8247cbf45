"""Robots change hands: claimed, given up, sold on; and their tokens."""

from typing import Any

from tests.conftest import Service
from tests.homes import changed
from tests.people.browsers import ANN, BOB, Browser, by_link

Json = dict[str, Any]
OPEN, CODE = "/api/v1/claims", "claim_code"


def register(service: Service, robot_id: str = "RB-1") -> Json:
    made = service.operator.request("POST", "/api/v1/robots", json={"id": robot_id, "name": "Hall"})
    found: Json = made.json()
    return found


def ids(browser: Browser) -> list[str]:
    return [robot["id"] for robot in browser.get("/api/v1/robots").json()["items"]]


def test_a_robot_is_claimed_by_its_code_however_it_is_typed_once(service: Service) -> None:
    made, ann, bob = register(service), by_link(service, ANN), by_link(service, BOB)
    claimed = ann.post(OPEN, claim_code=made["claim_code"].lower().replace("-", " "))
    assert claimed.status_code == 201, claimed.text
    assert (claimed.json()["id"], claimed.json()["owner"]) == ("RB-1", ANN)
    assert ids(ann) == ["RB-1"]
    assert bob.post(OPEN, claim_code=made["claim_code"]).status_code == 404
    assert bob.post(OPEN, claim_code="AAAA-AAAA-AAAA").status_code == 404


def test_codes_cannot_be_guessed_in_numbers(service: Service) -> None:
    made, ann = register(service), by_link(service, ANN)
    statuses = [ann.post(OPEN, claim_code=f"AAAA-AAAA-{n:04}").status_code for n in range(12)]
    assert statuses == [404] * 10 + [429] * 2
    assert ann.post(OPEN, claim_code=made["claim_code"]).status_code == 429


def test_a_robot_that_is_sold_on_takes_nothing_of_the_old_home_along(service: Service) -> None:
    robot = service.add_robot("RB-1", ANN)
    assert robot.upload("0").status_code == 201
    ann, bob = by_link(service, ANN), by_link(service, BOB)
    old_map = ann.get(robot.path()).json()
    given_up = ann.post("/api/v1/robots/RB-1/release")
    assert given_up.status_code == 200, given_up.text
    # the old owner keeps what was mapped, and has nothing to do with the robot any more
    (kept,) = ids(ann)
    assert kept.startswith("RB-1.kept-")
    assert ann.get(robot.path()).status_code == 403
    there = ann.get(f"/api/v1/robots/{kept}/maps/ground").json()
    assert there["features"] == old_map["features"]
    assert ann.get(there["grid"]).status_code == 200
    assert ann.post(f"/api/v1/robots/{kept}/token").status_code == 409
    assert ann.post(f"/api/v1/robots/{kept}/release").status_code == 409
    # whoever has it meanwhile is told nothing, and sends nothing
    assert robot.upload("1").status_code == 403
    assert robot.get(robot.path()).status_code == 403
    assert service.operator.get(robot.path()).status_code == 404
    assert service.operator.get(f"/api/v1/robots/{kept}/maps/ground").status_code == 403
    # the new owner begins anew
    assert bob.post(OPEN, claim_code=given_up.json()["claim_code"]).status_code == 201
    assert ids(bob) == ["RB-1"]
    assert bob.get(robot.path()).status_code == 404
    assert bob.get("/api/v1/robots/RB-1/views").json()["items"] == []
    assert robot.upload("0").status_code == 201
    assert bob.get(robot.path()).json()["version"] == 1
    assert ann.get(robot.path()).status_code == 403
    assert ids(ann) == [kept]
    registered = service.operator.get("/api/v1/registry").json()["items"]
    assert [(one["id"], one["owner"]) for one in registered] == [("RB-1", BOB)]


def test_nothing_of_the_old_home_comes_out_of_a_browsers_cache(service: Service) -> None:
    """Two owners of a robot may share a browser, and addresses of maps stay what they are."""
    robot = service.add_robot("RB-1", ANN)
    assert robot.upload("0").status_code == 201
    ann = by_link(service, ANN)
    paths = [robot.path() + end for end in ("", "/versions/1", "/missions/0", "/segments")]
    pictures = [robot.path() + end for end in ("/versions/1/grid.png", "/versions/1/cells.png", "/missions/0/grid.png")]
    for path in paths:
        assert ann.get(path).headers["Cache-Control"] == "no-store", path
    tags = {path: ann.get(path).headers["ETag"] for path in pictures}
    code = ann.post("/api/v1/robots/RB-1/release").json()["claim_code"]
    bob = by_link(service, BOB)
    assert bob.post(OPEN, claim_code=code).status_code == 201
    assert robot.upload("0", changed("other floor")).status_code == 201
    for path, tag in tags.items():
        assert bob.request("GET", path, {"If-None-Match": tag}).status_code == 200, path
        assert ann.request("GET", path, {"If-None-Match": tag}).status_code == 403, path


def test_a_token_that_an_owner_was_shown_ends_with_that_owner(service: Service) -> None:
    robot, other = service.add_robot("RB-1", ANN), service.add_robot("RB-2", ANN)
    ann, bob = by_link(service, ANN), by_link(service, BOB)
    written_down = {"Authorization": f"Bearer {ann.post('/api/v1/robots/RB-1/token').json()['token']}"}
    for one in (robot, other):
        code = ann.post(f"/api/v1/robots/{one.id}/release").json()["claim_code"]
        assert bob.post(OPEN, claim_code=code).status_code == 201
    assert other.upload("0").status_code == 201, "nobody but the robot has ever had its token"
    assert service.http.get("/api/v1/robots", headers=written_down).status_code == 401
    assert bob.get("/api/v1/robots/RB-1").json()["token_made_at"] is None
    new = bob.post("/api/v1/robots/RB-1/token").json()["token"]
    assert service.http.get("/api/v1/robots", headers={"Authorization": f"Bearer {new}"}).status_code == 200


def test_what_was_being_processed_when_a_robot_was_given_up_stays_with_the_old_home(service: Service) -> None:
    robot = service.add_robot("RB-1", ANN)
    assert robot.upload("0").status_code == 201
    service.worker.paused = True
    assert robot.upload("1", wait=None).status_code == 202
    ann, bob = by_link(service, ANN), by_link(service, BOB)
    code = ann.post("/api/v1/robots/RB-1/release").json()["claim_code"]
    assert bob.post(OPEN, claim_code=code).status_code == 201
    service.worker.resume()
    (kept,) = ids(ann)
    assert ann.get(f"/api/v1/robots/{kept}/maps/ground/missions/1").json()["status"] == "done"
    assert bob.get(robot.path() + "/missions").status_code == 404
    assert bob.get("/api/v1/conflicts").json()["items"] == []


def test_a_robot_that_never_mapped_anything_leaves_nothing_behind(service: Service) -> None:
    service.add_robot("RB-1", ANN)
    ann = by_link(service, ANN)
    assert ann.post("/api/v1/robots/RB-1/release").status_code == 200
    assert ids(ann) == []


def test_a_new_token_takes_the_place_of_the_old_one_and_a_revoked_one_shuts_the_robot_out(service: Service) -> None:
    robot = service.add_robot("RB-1", ANN)
    ann = by_link(service, ANN)
    made = ann.post("/api/v1/robots/RB-1/token")
    assert (made.status_code, made.headers["Cache-Control"]) == (200, "no-store")
    assert robot.upload("0").status_code == 401
    robot.headers = {"Authorization": f"Bearer {made.json()['token']}"}
    assert robot.upload("0").status_code == 201
    assert service.operator.request("POST", "/api/v1/robots/RB-1/token").status_code == 403  # it reads Ann's maps
    assert service.operator.request("DELETE", "/api/v1/robots/RB-1/token").status_code == 204
    assert robot.upload("1").status_code == 401
    assert ann.get("/api/v1/robots/RB-1").json()["token_made_at"] is None
    assert ann.get(robot.path()).status_code == 200


def test_a_lost_code_is_replaced_by_an_operator_of_a_robot_that_is_nobodys(service: Service) -> None:
    made, ann = register(service), by_link(service, ANN)
    path = "/api/v1/robots/RB-1/claim-code"
    new = service.operator.request("POST", path).json()["claim_code"]
    assert ann.post(OPEN, claim_code=made["claim_code"]).status_code == 404
    assert ann.post(OPEN, claim_code=new).status_code == 201
    assert service.operator.request("POST", path).status_code == 409
