"""The commands, as a person types them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import cv2
import httpx2
import numpy as np
import pytest

from stillroom import uploading
from stillroom.__main__ import main
from stillroom.documents.exports import ExportFormat
from stillroom.file_commands import FORMATS
from stillroom.settings import Settings
from stillroom.store.database import Database
from stillroom.store.migrate import is_current
from tests.api.test_formats import valetudo
from tests.conftest import RobotCaller, Service, features
from tests.documents.test_umf import umf
from tests.homes import home, pixels, png

YAML = "image: first.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


@pytest.fixture
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("DATABASE_URL", "GRID_STORE_URL", "ADMIN_TOKEN", "URL", "TOKEN"):
        monkeypatch.delenv(f"STILLROOM_{name}", raising=False)
    monkeypatch.setenv("STILLROOM_DATA_DIR", str(tmp_path / "data"))
    return tmp_path


@pytest.fixture
def maps(tmp_path: Path) -> Path:
    """Three missions as files: a map_server pair, and two images that it does not describe."""
    folder = tmp_path / "maps"
    folder.mkdir()
    (folder / "first.yaml").write_text(YAML)
    (folder / "first.pgm").write_bytes(b"P5\n200 120\n255\n" + home()[::-1].tobytes())
    (folder / "second one.png").write_bytes(png(home(shift=(1, 0))))
    (folder / "third.png").write_bytes(png(home(shift=(1, 1))))
    return folder


@pytest.fixture
def online(service: Service, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """`stillroom upload` speaks to the service in this process; answers put into the list come first."""
    planned: list[Any] = []

    class Client(httpx2.Client):
        def __init__(self, **_: Any) -> None:
            super().__init__(transport=httpx2.MockTransport(answer))

    def answer(request: httpx2.Request) -> httpx2.Response:
        if planned:
            first = planned.pop(0)
            if isinstance(first, Exception):
                raise first
            assert isinstance(first, httpx2.Response)
            return first
        headers = {name: value for name, value in request.headers.items() if name != "host"}
        real = service.http.request(
            request.method, request.url.raw_path.decode(), headers=headers, content=request.read()
        )
        return httpx2.Response(real.status_code, headers=dict(real.headers), content=real.content)

    monkeypatch.setattr(httpx2, "Client", Client)
    monkeypatch.setattr("stillroom.uploading.time.sleep", lambda _seconds: None)
    return planned


Upload = Callable[..., int]


@pytest.fixture
def upload(online: list[Any], robot: RobotCaller) -> Upload:
    assert online == []

    def run(*arguments: object) -> int:
        return main(["upload", *map(str, arguments), "--robot", robot.id, "--map", "ground", "--token", robot.token])

    return run


GIVEN = ("--resolution", "0.05", "--origin", "-1", "-2", "0")


def test_upload_sends_a_map_server_file_and_tells_what_came_of_it(
    upload: Upload, maps: Path, robot: RobotCaller, capsys: pytest.CaptureFixture[str]
) -> None:
    assert upload(maps / "first.yaml") == 0
    assert "[1/1] first.yaml: mission first created, version 1." in capsys.readouterr().out
    assert robot.get(f"{robot.path()}/missions/first").json()["sequence"] == 0


def test_upload_takes_many_files_in_their_order(upload: Upload, maps: Path, robot: RobotCaller) -> None:
    assert upload(maps / "first.pgm", maps / "second one.png", maps / "third.png", *GIVEN) == 0
    missions = robot.get(f"{robot.path()}/missions").json()["items"]
    assert [(m["id"], m["sequence"], m["outcome"]) for m in missions] == [
        ("third", 2, "updated"),
        ("second-one", 1, "updated"),
        ("first", 0, "created"),
    ]


def test_upload_of_the_same_file_again_is_the_same_mission(upload: Upload, maps: Path, robot: RobotCaller) -> None:
    assert upload(maps / "first.yaml") == 0
    assert upload(maps / "first.yaml") == 0
    assert len(robot.get(f"{robot.path()}/versions").json()["items"]) == 1


def test_upload_says_with_its_status_that_a_map_was_not_taken(upload: Upload, maps: Path) -> None:
    assert upload(maps / "first.yaml", "--sequence", 5) == 0
    assert upload(maps / "third.png", *GIVEN, "--sequence", 1) == 2


def test_upload_carries_where_the_map_moved_to(upload: Upload, maps: Path, robot: RobotCaller) -> None:
    assert upload(maps / "first.yaml") == 0
    tracking = ("--base-version", 1, "--transform", 0.05, 0.05, 0)
    assert upload(maps / "third.png", *GIVEN, "--sequence", 1, *tracking) == 0
    assert robot.get(f"{robot.path()}/missions/third").json()["warnings"] == []


def test_upload_tries_again_where_the_service_is_away_or_busy(
    upload: Upload, maps: Path, online: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    online += [
        httpx2.ConnectError("connection refused"),
        httpx2.Response(503, headers={"Retry-After": "3"}, json={"title": "Not available now", "detail": "Busy."}),
        httpx2.Response(429),
    ]
    assert upload(maps / "first.yaml") == 0
    told = capsys.readouterr().err
    assert "connection refused; trying again" in told
    assert "Busy.; trying again in 3 s" in told


def test_upload_gives_up_in_the_end(
    upload: Upload, maps: Path, online: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    online += [httpx2.ConnectError("connection refused")] * uploading.ATTEMPTS
    assert upload(maps / "first.yaml") == 1
    assert "gave up" in capsys.readouterr().err


def test_upload_stops_at_a_file_that_is_refused_and_says_why(
    upload: Upload, maps: Path, robot: RobotCaller, capsys: pytest.CaptureFixture[str]
) -> None:
    (maps / "cut.png").write_bytes(png(home())[:100])
    assert upload(maps / "cut.png", maps / "third.png", *GIVEN) == 1
    assert "/grid: cut off or damaged" in capsys.readouterr().err
    assert robot.get(f"{robot.path()}/missions/third").status_code == 404


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.png", None, "no such file"),
        ("text.txt", "hello", "only PNG and PGM"),
        ("lonely.png", "x", "--resolution"),
        ("odd.yaml", "a: [", "odd.yaml"),
        ("other.yaml", "name: x", "names no image"),
    ],
)
def test_upload_says_what_is_wrong_with_a_file(
    upload: Upload, maps: Path, capsys: pytest.CaptureFixture[str], name: str, content: str | None, said: str
) -> None:
    if content is not None:
        (maps / name).write_text(content)
    assert upload(maps / name) == 1
    assert said in capsys.readouterr().err


def test_upload_sends_json_maps_and_says_when_their_rooms_were_not_taken(
    upload: Upload, maps: Path, robot: RobotCaller, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two"):
        (maps / f"{name}.json").write_text(json.dumps(valetudo()))
    assert upload(maps / "one.json") == 0
    assert "as the robot has them" in capsys.readouterr().out
    assert upload(maps / "two.json", "--sequence", 1) == 0
    assert "those in the file were not taken" in capsys.readouterr().err
    rooms = features(robot.get(robot.path()).json(), "room")
    assert "Küche" in {room["properties"]["name"] for room in rooms}


def test_upload_makes_a_map_of_a_umf_document(upload: Upload, maps: Path, robot: RobotCaller) -> None:
    (maps / "umf.json").write_text(json.dumps(umf()))
    assert upload(maps / "umf.json") == 0
    made = robot.get(robot.path()).json()
    assert {room["properties"]["name"] for room in features(made, "room")} == {"Kitchen", "Room 2"}
    assert len(features(made, "divider")) == len(features(made, "restriction")) == 1


def test_upload_takes_the_image_beside_a_yaml_file_that_was_made_on_another_machine(upload: Upload, maps: Path) -> None:
    (maps / "first.yaml").write_text(YAML.replace("first.pgm", "/home/somebody/maps/kitchen.pgm"))
    assert upload(maps / "first.yaml") == 0


@pytest.fixture
def uploaded(upload: Upload, maps: Path) -> Path:
    assert upload(maps / "first.yaml") == 0
    return maps


def export(robot: RobotCaller, *arguments: object) -> int:
    return main(["export", *map(str, arguments), "--robot", robot.id, "--map", "ground", "--token", robot.token])


def test_export_saves_a_version_under_the_name_that_the_service_gives_it(
    uploaded: Path, robot: RobotCaller, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(uploaded)
    assert export(robot, "--format", "geojson") == 0
    assert capsys.readouterr().out.splitlines()[-1] == "RB-1-ground-v1.geojson"
    saved = json.loads((uploaded / "RB-1-ground-v1.geojson").read_text())
    assert saved == robot.get(f"{robot.path()}/versions/1").json()


@pytest.mark.parametrize("kind", FORMATS)
def test_export_knows_every_format_of_the_service(uploaded: Path, robot: RobotCaller, kind: str) -> None:
    assert export(robot, "--format", kind, "--version", 1, "--out", uploaded / "out") == 0
    answer = robot.get(f"{robot.path()}/versions/1/export?format={kind}")
    assert (uploaded / "out").read_bytes() == answer.content
    assert get_args(ExportFormat) == FORMATS


def test_export_says_why_it_can_t(
    uploaded: Path, robot: RobotCaller, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert export(robot, "--format", "png", "--version", 9) == 1
    assert "no version 9" in capsys.readouterr().err
    assert export(robot, "--format", "png", "--out", uploaded / "none" / "x") == 1
    monkeypatch.delenv("STILLROOM_TOKEN", raising=False)
    assert main(["export", "--robot", "RB-1", "--map", "ground", "--format", "png"]) == 1
    assert "STILLROOM_TOKEN" in capsys.readouterr().err


def test_render_draws_maps_of_any_format_and_a_sheet_of_all(
    maps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (maps / "robot.json").write_text(json.dumps(valetudo()))
    (maps / "umf.json").write_text(json.dumps(umf()))
    files = [maps / name for name in ("first.yaml", "third.png", "robot.json", "umf.json")]
    out, sheet = tmp_path / "pictures", tmp_path / "sheet.png"
    assert main(["render", *map(str, files), "--rooms", "--out", str(out), "--sheet", str(sheet)]) == 0
    told = capsys.readouterr().out
    assert "first, 200 x 120, 2 rooms" in told
    drawn = {path.name: pixels(path.read_bytes()).shape for path in out.iterdir()}
    assert sorted(drawn) == ["first.png", "robot.png", "third.png", "umf.png"]
    assert len(pixels(sheet.read_bytes()).shape) == 3
    assert main(["render", str(files[0]), "--out", str(out)]) == 0
    assert (out / "first-2.png").is_file()


def test_render_goes_on_after_a_file_that_can_t_be_read(
    maps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (maps / "cut.png").write_bytes(png(home())[:100])
    files = [str(maps / name) for name in ("cut.png", "none.png", "first.pgm")]
    assert main(["render", *files, "--sheet", str(tmp_path / "sheet.png")]) == 1
    assert (tmp_path / "sheet.png").is_file()
    said = capsys.readouterr().err
    assert "cut off or damaged" in said
    assert "no such file" in said
    assert main(["render", *files]) == 1


def test_segment_writes_labels_geojson_and_a_picture_of_each_map(
    maps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (maps / "robot.json").write_text(json.dumps(valetudo()))
    out = tmp_path / "rooms"
    assert (
        main(["segment", *(str(maps / name) for name in ("first.yaml", "third.png", "robot.json")), "--out", str(out)])
        == 0
    )
    assert "third_rooms.png: 2 rooms" in capsys.readouterr().out
    kinds = ("rooms.png", "rooms.geojson", "picture.png")
    assert {path.name for path in out.iterdir()} == {f"{n}_{k}" for n in ("first", "third", "robot") for k in kinds}
    labels = cv2.imread(str(out / "third_rooms.png"), cv2.IMREAD_UNCHANGED)
    assert labels is not None
    assert labels.dtype == np.uint16
    free = home(shift=(1, 1))[::-1] > 250
    assert labels.shape == free.shape
    assert set(np.unique(labels)) == {0, 1, 2}
    assert (labels[~free] == 0).all()
    assert (labels[free] > 0).mean() > 0.99
    saved = json.loads((out / "third_rooms.geojson").read_text())
    assert saved["frame"]["resolution"] == 0.05
    rooms = {f["properties"]["segment_id"]: f["properties"]["area"] for f in features(saved, "room")}
    assert rooms == {k: pytest.approx((labels == k).sum() * 0.05**2, rel=0.02) for k in (1, 2)}


def test_segment_finds_more_rooms_where_it_is_more_sensitive(maps: Path, tmp_path: Path) -> None:
    found = []
    for sensitivity in (-20, 0.5):
        out = tmp_path / str(sensitivity)
        assert main(["segment", str(maps / "third.png"), "--out", str(out), "--sensitivity", str(sensitivity)]) == 0
        found.append(int(pixels((out / "third_rooms.png").read_bytes()).max()))
    assert found == [1, 2]


def test_segment_goes_on_after_a_file_that_can_t_be_read_and_refuses_two_of_one_name(
    maps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["segment", str(maps / "none.png"), str(maps / "third.png"), "--out", str(tmp_path / "rooms")]) == 1
    assert "no such file" in capsys.readouterr().err
    assert (tmp_path / "rooms" / "third_rooms.png").is_file()
    twice = [str(maps / "first.yaml"), str(maps / "first.pgm")]
    assert main(["segment", *twice, "--out", str(tmp_path / "other")]) == 1
    assert "more than one file is called first" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


@pytest.mark.usefixtures("environment")
def test_upload_needs_a_token(maps: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["upload", str(maps / "first.yaml"), "--robot", "RB-1", "--map", "ground"]) == 1
    assert "STILLROOM_TOKEN" in capsys.readouterr().err


def test_migrate_makes_the_database(environment: Path) -> None:
    assert main(["migrate"]) == 0
    database = Database(Settings.from_environment().database_url)
    with database.read() as tx:
        assert is_current(tx)
    database.dispose()
    assert (environment / "data" / "stillroom.sqlite").is_file()


@pytest.mark.usefixtures("environment")
def test_robots_add_prints_a_token_that_opens_the_door(
    service: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STILLROOM_DATABASE_URL", service.settings.database_url)
    assert main(["robots", "add", "RB-7", "--name", "Hall robot", "--owner", "ann@example.org"]) == 0
    token = capsys.readouterr().out.strip()
    listed = service.http.get("/api/v1/robots", headers={"Authorization": f"Bearer {token}"}).json()["items"]
    assert listed == [
        {"id": "RB-7", "name": "Hall robot", "owner": "ann@example.org", "maps": [], "may": ["read", "upload"]}
    ]
    assert main(["robots", "add", "RB-7"]) == 1
    assert "already" in capsys.readouterr().err
    assert main(["robots", "add", "a b"]) == 1


@pytest.mark.usefixtures("environment")
def test_login_link_prints_a_link_for_an_owner(
    service: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STILLROOM_DATABASE_URL", service.settings.database_url)
    assert main(["login-link", "--owner", "ann@example.org", "--url", "http://stillroom.test/"]) == 0
    link = capsys.readouterr().out.strip()
    assert link.startswith("http://stillroom.test/login?token=")
    service.http.get(link, follow_redirects=False)
    assert service.http.get("/api/v1/session").json()["id"] == "ann@example.org"


def test_openapi_prints_the_schema_and_opens_nothing(environment: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["openapi"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert "/api/v1/robots/{robot}/maps/{map}/edits" in schema["paths"]
    assert not (environment / "data").exists()


@pytest.mark.parametrize("arguments", [[], ["nonsense"], ["serve", "--workers", "-1"], ["robots"]])
def test_a_command_that_is_wrong_shows_how_it_goes(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage: stillroom" in capsys.readouterr().err
