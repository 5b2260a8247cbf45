"""A robot uploads missions."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import cv2
import numpy as np
import pytest
import sqlalchemy as sa

from stillroom.api.missions import wait_preference
from stillroom.store import missions, tables
from tests.conftest import RobotCaller, Service, features
from tests.homes import home, pixels, png


def test_the_first_mission_makes_the_map(robot: RobotCaller) -> None:
    answer = robot.upload("17", started_at="2026-11-22T08:00:00Z")
    mission = answer.json()
    assert answer.status_code == 201
    assert answer.headers["Location"] == f"{robot.path()}/missions/17"
    assert answer.headers["Preference-Applied"] == "wait=30"
    assert (mission["status"], mission["outcome"], mission["version"]) == ("done", "created", 1)
    assert (mission["base_version"], mission["ablation"]) == (None, None)
    assert {"decode", "create", "total"} <= mission["timings_ms"].keys()
    assert mission["started_at"] == "2026-11-22T08:00:00Z"
    assert robot.get(f"{robot.path()}/missions/17").json() == mission


def test_the_map_of_the_first_mission_has_its_rooms(mapped: RobotCaller) -> None:
    document = mapped.get(mapped.path()).json()
    assert (document["cause"], document["made_by"], document["mission"]) == ("created", "robot:RB-1", "0")
    assert len(features(document, "room")) == 2
    assert len(features(document, "divider")) == 1


def test_without_a_wish_to_wait_the_answer_comes_at_once(service: Service, robot: RobotCaller) -> None:
    service.worker.paused = True
    answer = robot.upload("0", wait=None)
    assert (answer.status_code, answer.json()["status"], answer.json()["outcome"]) == (202, "queued", None)
    assert answer.headers["Location"] == f"{robot.path()}/missions/0"
    service.worker.resume()
    assert robot.get(answer.headers["Location"]).json()["outcome"] == "created"


def test_a_wait_that_is_too_short_ends_with_202(service: Service, robot: RobotCaller) -> None:
    service.worker.paused = True
    assert robot.upload("0", wait=0).status_code == 202


def test_who_waits_is_told_and_need_not_look_now_and_then(robot: RobotCaller, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stillroom.api.missions._RECHECK_S", 600.0)
    assert [robot.upload(str(number), wait=20).status_code for number in range(3)] == [201, 201, 201]


def test_the_same_upload_again_is_the_same_mission(mapped: RobotCaller) -> None:
    again = mapped.upload("0")
    assert again.status_code == 200
    assert again.json() == mapped.get(f"{mapped.path()}/missions/0").json()
    assert len(mapped.get(f"{mapped.path()}/versions").json()["items"]) == 1


def test_the_same_upload_again_is_the_same_mission_whatever_program_took_the_first_one(
    service: Service, mapped: RobotCaller
) -> None:
    with service.database.write() as tx:
        tx.execute(sa.update(tables.mission).values(meta_digest="as another program makes it"))
    assert mapped.upload("0").status_code == 200
    assert mapped.upload("0", firmware="another").status_code == 409


def test_the_same_upload_five_times_at_once_is_one_mission_and_one_version(robot: RobotCaller) -> None:
    with ThreadPoolExecutor(5) as pool:
        answers = list(pool.map(lambda _: robot.upload("0"), range(5)))
    assert sorted(answer.status_code for answer in answers) == [200, 200, 200, 200, 201]
    assert len({json.dumps(answer.json(), sort_keys=True) for answer in answers}) == 1
    assert len(robot.get(f"{robot.path()}/missions").json()["items"]) == 1
    assert len(robot.get(f"{robot.path()}/versions").json()["items"]) == 1


@pytest.mark.parametrize(
    "changed",
    [
        {"origin": [-1, -2, 0]},
        {"started_at": "2026-11-22T09:00:00+01:00"},
        {"epoch": 0, "tracking": {}, "firmware": None},
    ],
)
def test_meta_that_says_the_same_in_other_words_is_the_same(robot: RobotCaller, changed: dict[str, Any]) -> None:
    first = robot.upload("0", started_at="2026-11-22T08:00:00Z")
    again = robot.upload("0", **({"started_at": "2026-11-22T08:00:00Z"} | changed))
    assert (first.status_code, again.status_code) == (201, 200)


@pytest.mark.parametrize("changed", [{"sequence": 1}, {"firmware": "2"}, {"battery": 80}])
def test_the_same_id_with_other_meta_is_refused_and_the_first_stays(
    mapped: RobotCaller, changed: dict[str, Any]
) -> None:
    answer = mapped.upload("0", **changed)
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/mission-conflict")
    assert mapped.upload("0").status_code == 200


def test_the_same_id_with_other_bytes_is_refused_even_where_they_decode_to_the_same_cells(mapped: RobotCaller) -> None:
    other = cv2.imencode(".png", home()[::-1], [cv2.IMWRITE_PNG_COMPRESSION, 0])[1].tobytes()
    assert mapped.upload("0", other).status_code == 409


def test_a_late_mission_is_stored_and_scored_and_changes_nothing(mapped: RobotCaller) -> None:
    assert mapped.upload("5", home(shift=(1, 0))).json()["outcome"] == "updated"
    before = mapped.get(mapped.path()).json()
    late = mapped.upload("late", home(shift=(2, 1)), sequence=3).json()
    assert (late["outcome"], late["ablation"], late["succeeded_at"]) == ("superseded", None, None)
    assert len(late["rooms"]) == 2
    assert late["version"] == before["version"]
    assert mapped.get(mapped.path()).json() == before
    raw = mapped.get(f"{mapped.path()}/missions/late/grid.png")
    assert np.array_equal(pixels(raw.content), home(shift=(2, 1)))


def test_a_robot_that_was_reset_starts_a_new_epoch(mapped: RobotCaller) -> None:
    mapped.upload("5")
    reset = mapped.upload("after-reset", home(shift=(1, 1)), sequence=0, epoch=1).json()
    assert reset["outcome"] == "updated"
    old = mapped.upload("6").json()
    assert old["outcome"] == "superseded"


def test_missions_that_came_in_the_wrong_order_are_processed_in_order(service: Service, mapped: RobotCaller) -> None:
    service.worker.paused = True
    for mission in ("2", "1", "3"):
        mapped.upload(mission, wait=None)
    service.worker.resume()
    versions = mapped.get(f"{mapped.path()}/versions").json()["items"]
    assert [version["mission"] for version in versions] == ["3", "2", "1", "0"]


def test_missions_are_listed_by_outcome_and_page_by_page(mapped: RobotCaller) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    mapped.upload("2", home(shift=(0, 1)))
    listed = mapped.get(f"{mapped.path()}/missions?outcome=created").json()
    assert [mission["id"] for mission in listed["items"]] == ["0"]
    first = mapped.get(f"{mapped.path()}/missions?limit=2")
    assert [mission["id"] for mission in first.json()["items"]] == ["2", "1"]
    rest = mapped.get(first.headers["Link"].partition(">")[0].removeprefix("<"))
    assert [mission["id"] for mission in rest.json()["items"]] == ["0"]
    assert rest.json()["next"] is None
    assert "Link" not in rest.headers


@pytest.mark.parametrize("cursor", ["x", "-1", "1e3", "9" * 30])
def test_a_cursor_that_was_never_given_out_is_refused(mapped: RobotCaller, cursor: str) -> None:
    assert mapped.get(f"{mapped.path()}/missions?cursor={cursor}").status_code == 422


def test_the_grid_of_a_mission_comes_back_as_it_was_sent(robot: RobotCaller) -> None:
    image = home()
    image[30:34, 40:44] = 240
    robot.upload("0", image)
    answer = robot.get(f"{robot.path()}/missions/0/grid.png")
    assert answer.headers["Content-Type"] == "image/png"
    assert np.array_equal(pixels(answer.content), image)


def test_a_pgm_gives_the_same_map_and_comes_back_as_png(robot: RobotCaller) -> None:
    image = home()
    content = b"P5\n# made by hand\n200 120\n255\n" + image[::-1].tobytes()
    made = robot.upload("0", content, grid_type="image/x-portable-graymap")
    assert (made.status_code, made.json()["outcome"]) == (201, "created")
    assert np.array_equal(pixels(robot.get(f"{robot.path()}/versions/1/grid.png").content), image)


def test_cells_say_what_greys_mean_whatever_the_robot_calls_them(robot: RobotCaller) -> None:
    trinary = home()
    negated = np.where(trinary == 205, 100, 255 - trinary).astype(np.uint8)
    made = robot.upload("0", negated, negate=True)
    assert made.json()["outcome"] == "created"
    document = robot.get(robot.path()).json()
    assert np.array_equal(pixels(robot.get(document["cells"]).content), trinary)
    assert np.array_equal(pixels(robot.get(document["grid"]).content), negated)


@pytest.mark.parametrize(
    ("image", "grid_type", "status", "slug"),
    [
        (png(home())[:60], "image/png", 422, "invalid-grid"),
        (png(home())[:-20], "image/png", 422, "invalid-grid"),
        (b"", "image/png", 422, "invalid-grid"),
        (b"hello", "image/png", 422, "invalid-grid"),
        (png(home()), "image/x-portable-graymap", 422, "invalid-grid"),
        (cv2.imencode(".png", np.zeros((4, 4), np.uint16))[1].tobytes(), "image/png", 422, "invalid-grid"),
        (png(np.full((20, 20), 205, np.uint8)), "image/png", 422, "invalid-grid"),
        (b"P5\n10000 10000\n255\n", "image/x-portable-graymap", 413, "too-large"),
        (b'{"__class": "ValetudoMap"}', "application/json", 422, "invalid-grid"),
        (png(home()), "application/json", 422, "invalid-grid"),
        (b"{}", "image/png", 422, "invalid-grid"),
        (b"", "text/plain", 415, "unsupported-format"),
        (png(home()), "image/jpeg", 415, "unsupported-format"),
    ],
)
def test_a_grid_that_cannot_be_read_is_refused_and_leaves_no_mission(
    robot: RobotCaller, image: bytes, grid_type: str, status: int, slug: str
) -> None:
    answer = robot.upload("6", image, grid_type=grid_type)
    assert (answer.status_code, answer.json()["type"]) == (status, f"/problems/{slug}"), answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert robot.get(f"{robot.path()}/missions/6").status_code == 404
    assert robot.get("/api/v1/robots").json()["items"][0]["maps"] == []


@pytest.mark.parametrize(
    ("meta", "pointer"),
    [
        ('{"sequence": NaN}', "/meta/sequence"),
        ('{"sequence": 1, "tracking": {"rooms": {"r1": [[0, 0], [1, Infinity]]}}}', "/meta/tracking/rooms/r1/1/1"),
        ('{"sequence": 1, "tracking": {"rooms": {"r/1~": [[0, 1e999]]}}}', "/meta/tracking/rooms/r~11~0/0/1"),
        ('{"sequence": 1, "something": [1, -Infinity]}', "/meta/something/1"),
        ('{"resolution": 0.05}', "/meta/sequence"),
        ('{"sequence": -1}', "/meta/sequence"),
        ('{"sequence": "1"}', "/meta/sequence"),
        ('{"sequence": 1}', "/meta/resolution"),
        ('{"sequence": 1, "resolution": 0, "origin": [0, 0, 0]}', "/meta/resolution"),
        ('{"sequence": 1, "resolution": 0.05, "origin": [0, 0]}', "/meta/origin/2"),
        ('{"sequence": 1, "resolution": 0.05, "origin": [0, 1e9, 0]}', "/meta/origin/1"),
        ('{"sequence": 1, "started_at": "2026-11-22T08:00:00"}', "/meta/started_at"),
        ('{"sequence": 1, "ended_at": "0001-01-01T00:00:00+14:00"}', "/meta/ended_at"),
        (
            '{"sequence": 1, "resolution": 0.05, "origin": [0, 0, 0], "free_thresh": 0.7, "occupied_thresh": 0.6}',
            "/meta/free_thresh",
        ),
        ("[]", "/meta"),
        ("{", "/meta"),
        ("", "/meta"),
        ("[" * 5000, "/meta"),
    ],
)
def test_meta_that_cannot_be_used_is_refused_with_a_pointer_to_the_fault(
    robot: RobotCaller, meta: str, pointer: str
) -> None:
    answer = robot.request(
        "PUT",
        f"{robot.path()}/missions/6",
        files={"meta": ("m", meta, "application/json"), "grid": ("g", png(home()), "image/png")},
    )
    assert answer.status_code == 422, answer.text
    assert pointer in [error["pointer"] for error in answer.json()["errors"]], answer.text
    assert robot.get(f"{robot.path()}/missions/6").status_code == 404


def test_parts_are_told_by_name_and_need_no_file_name(robot: RobotCaller) -> None:
    body = (
        b'--x\r\nContent-Disposition: form-data; name="grid"\r\nContent-Type: image/png\r\n\r\n'
        + png(home())
        + b'\r\n--x\r\nContent-Disposition: form-data; name="meta"\r\n\r\n'
        + b'{"sequence": 0, "resolution": 0.05, "origin": [-1, -2, 0]}\r\n--x--\r\n'
    )
    headers = {"Content-Type": "multipart/form-data; boundary=x", "Prefer": "wait=30"}
    answer = robot.request("PUT", f"{robot.path()}/missions/0", headers, content=body)
    assert answer.status_code == 201, answer.text
    cut = robot.request("PUT", f"{robot.path()}/missions/1", headers, content=body[:-30])
    assert (cut.status_code, robot.get(f"{robot.path()}/missions/1").status_code) == (422, 404)


def test_an_upload_without_a_part_or_of_another_kind_is_refused(robot: RobotCaller) -> None:
    target = f"{robot.path()}/missions/0"
    missing = robot.request("PUT", target, files={"grid": ("g", png(home()), "image/png")})
    assert (missing.status_code, missing.json()["errors"][0]["pointer"]) == (422, "/meta")
    assert robot.request("PUT", target, json={}).status_code == 415
    assert robot.request("PUT", target, content=b"").status_code == 415


def test_a_body_over_32_mib_is_refused_whether_it_says_its_length_or_not(robot: RobotCaller) -> None:
    target, chunk = f"{robot.path()}/missions/0", bytes(2**20)
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    start = b'--x\r\nContent-Disposition: form-data; name="grid"\r\n\r\n'
    told = robot.request("PUT", target, headers, content=start + chunk * 33)
    untold = robot.request("PUT", target, headers, content=iter([start, *[chunk] * 33]))
    for answer in (told, untold):
        assert (answer.status_code, answer.json()["type"]) == (413, "/problems/too-large")
        assert answer.headers["Content-Type"] == "application/problem+json"


@pytest.mark.parametrize("mission", ["a" * 65, "a b", "ä", "a%2Fb"])
def test_an_id_outside_of_the_contract_is_refused(robot: RobotCaller, mission: str) -> None:
    assert robot.upload(mission).status_code in (404, 405, 422)


def test_tracking_from_a_version_that_is_not_known_is_ignored_with_a_warning(mapped: RobotCaller) -> None:
    mission = mapped.upload("1", home(shift=(1, 0)), base_version=99, tracking={"transform": [9.0, 0.0, 0.0]}).json()
    assert mission["outcome"] == "updated"
    assert any("99" in warning for warning in mission["warnings"])


def test_a_mission_that_the_core_cannot_digest_is_kept_as_reverted_and_the_lane_goes_on(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError("a secret of the inside")

    with monkeypatch.context() as patch:
        patch.setattr("stillroom.service.gathering.update_map", fail)
        failed = mapped.upload("1").json()
    assert (failed["outcome"], failed["version"]) == ("reverted", 1)
    assert "secret" not in json.dumps(failed)
    with service.database.read() as tx:
        kept = missions.traceback(tx, 2)
    assert kept is not None
    assert "a secret of the inside" in kept
    assert mapped.upload("2", home(shift=(1, 0))).json()["outcome"] == "updated"


def test_a_first_mission_that_fails_leaves_the_map_to_the_next(
    robot: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("stillroom.service.gathering.create_semantic_map", lambda *_, **__: 1 / 0)
        failed = robot.upload("5").json()
    assert (failed["outcome"], failed["version"]) == ("reverted", None)
    assert robot.get(robot.path()).status_code == 404
    assert robot.upload("4").json()["outcome"] == "created"


@pytest.mark.parametrize(
    ("prefer", "seconds"),
    [
        ([], None),
        (["wait=10"], 10),
        (["respond-async, wait=10"], 10),
        (["respond-async", 'WAIT = "5"'], 5),
        (["wait=600"], 60),
        (["wait=-1"], None),
        (["await=3"], None),
        (["wait=soon"], None),
    ],
)
def test_the_wish_to_wait_is_read_as_rfc_7240_says(prefer: list[str], seconds: float | None) -> None:
    assert wait_preference(prefer) == seconds
