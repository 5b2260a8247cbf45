"""A home as an archive: complete, and the same again where it is brought in."""

import io
import json
import struct
import tracemalloc
import zipfile
import zlib
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.__main__ import main
from stillroom.api.privacy import READING, WRITING
from stillroom.documents import archives
from stillroom.documents.archives import MOST_OF_ONE, Archive
from stillroom.errors import InvalidInput, TooLarge
from stillroom.service import archiving, importing
from stillroom.service.verifying import verify
from stillroom.store.tables import metadata, mission
from tests.conflicts import expect
from tests.conftest import Caller, RobotCaller, Service
from tests.fuzz.neighbourhood import PRIVATE, settle, signed_in
from tests.homes import changed

Json = dict[str, Any]


def archive_of(caller: Caller, robot: str) -> bytes:
    answer = caller.get(f"/api/v1/robots/{robot}/archive")
    assert (answer.status_code, answer.headers["Content-Type"]) == (200, "application/zip")
    return answer.content


def bring_in(caller: Caller, robot: str, content: bytes) -> Any:
    return caller.request(
        "POST", f"/api/v1/robots/{robot}/archive", {"Content-Type": "application/zip"}, content=content
    )


def files(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


def history(caller: Caller, robot: str, name: str = "ground") -> list[Json]:
    """Every version and mission as the API shows them, but for whose they are."""
    path = f"/api/v1/robots/{robot}/maps/{name}"
    listed = expect(caller.get(f"{path}/versions"))["items"]
    versions = [expect(caller.get(f"{path}/versions/{one['version']}")) for one in listed]
    missions = [one | {"conflicts": [], "decision": None} for one in expect(caller.get(f"{path}/missions"))["items"]]
    found: list[Json] = json.loads(
        json.dumps([versions, listed, missions]).replace(robot, "X").replace("robot:bobs", "robot:X")
    )
    return found


def test_an_archive_brought_into_another_service_is_the_same_map_with_all_its_versions(service: Service) -> None:
    neighbours = settle(service)
    bob, ann = neighbours.callers["neighbour"], neighbours.callers["owner"]
    content = archive_of(bob, "bobs")
    there = files(content)
    manifest = json.loads(there.pop("manifest.json"))
    assert {entry["path"]: entry["sha256"] for entry in manifest["files"]} == {
        path: sha256(file).hexdigest() for path, file in there.items()
    }
    kinds = {path.rsplit(".", 1)[-1] for path in there if "/current/" in path}
    assert kinds == {"geojson", "yaml", "pgm", "json", "png"}
    assert {"robot.json", "log.jsonl", "maps/1/decisions.jsonl", "maps/1/events.jsonl"} <= there.keys()
    assert sum(path.startswith("grids/") for path in there) == 3

    other = service.add_robot("other", "ann@example.org")
    made = expect(bring_in(ann, other.id, content), 201)
    assert made == {"robot": "other", "maps": ["ground"], "versions": 4, "missions": 3}
    assert history(ann, other.id) == history(bob, "bobs")
    for number in (1, 2, 3, 4):
        path = f"maps/ground/versions/{number}/grid.png"
        assert ann.get(f"/api/v1/robots/other/{path}").content == bob.get(f"/api/v1/robots/bobs/{path}").content
    assert bring_in(ann, other.id, content).status_code == 409, "it has such a map now"
    assert files(archive_of(ann, "other"))["maps/1/versions/000003.json"] == there["maps/1/versions/000003.json"]
    goes_on(other)
    report = verify(service.database, service.grids)
    assert report.holds, report.examples


def test_a_home_is_one_archive_of_all_its_robots_and_of_what_was_chosen_for_it(service: Service) -> None:
    callers = settle(service).callers
    ann, bob = callers["owner"], callers["neighbour"]
    second = service.add_robot("anns-second", "ann@example.org")
    expect(second.upload("0", changed("other floor"), map_name="upstairs"), 201)
    expect(ann.request("PUT", "/api/v1/home/retention", json={"days": 90}))
    expect(ann.request("PATCH", "/api/v1/notifications", json={"language": "de", "email": ["conflict"]}))
    answer = ann.get("/api/v1/home/archive")
    assert (answer.status_code, answer.headers["Content-Type"]) == (200, "application/zip")
    there = files(answer.content)
    home = json.loads(there["home.json"])
    assert {one["email"]: one["role"] for one in home["people"]} == {
        "mel@example.org": "member",
        "vera@example.org": "viewer",
    }
    assert (home["owner"], home["retention"]["days"]) == ("ann@example.org", 90)
    assert (home["messages"]["language"], home["messages"]["kinds"]) == ("de", {"email": ["conflict"]})
    assert [one["label"] for one in home["messages"]["to"]] == ["Diele hook"]
    robots = {json.loads(there[f"robots/{number}/robot.json"])["id"] for number in (1, 2)}
    assert robots == {"anns", "anns-second"}
    assert {
        "robots/1/log.jsonl",
        "robots/1/grants.jsonl",
        "robots/1/maps/1/current/map.pgm",
        "robots/2/maps/1/map.json",
    } <= there.keys()
    for secret in (PRIVATE.encode(), b"secret", b"token"):
        assert not [path for path, file in there.items() if secret in file and path != "README.txt"], secret
    looked = expect(ann.get("/api/v1/robots/anns/log"))["items"]
    assert "home archive" in [entry["what"] for entry in looked]

    # in another home: what is of robots that are not there is kept without them
    made = expect(bring_home_in(bob, answer.content), 201)["robots"]
    assert [(one["maps"], one["versions"], one["missions"]) for one in made] == [
        (["ground"], 4, 3),
        (["upstairs"], 1, 1),
    ]
    kept = made[0]["robot"]
    assert kept.startswith("anns.kept-")
    assert json.loads(json.dumps(history(bob, kept)).replace("robot:anns", "robot:X")) == history(ann, "anns")
    assert bob.request("POST", f"/api/v1/robots/{kept}/token").status_code == 409
    assert ann.get(f"/api/v1/robots/{kept}").status_code == 403
    # in one's own, robots that have no such maps any more get them back
    expect(ann.request("DELETE", "/api/v1/robots/anns/maps?confirm=anns"))
    assert bring_home_in(ann, answer.content).status_code == 409, "the second has its maps still"
    expect(ann.request("DELETE", "/api/v1/robots/anns-second/maps?confirm=anns-second"))
    again = expect(bring_home_in(ann, answer.content), 201)["robots"]
    assert [one["robot"] for one in again] == ["anns", "anns-second"]
    report = verify(service.database, service.grids)
    assert report.holds, report.examples


def bring_home_in(caller: Caller, content: bytes) -> Any:
    return caller.request("POST", "/api/v1/home/archive", {"Content-Type": "application/zip"}, content=content)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_a_hostile_archive_of_a_home_is_refused_and_leaves_nothing_behind(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = service.add_robot("anns", "ann@example.org")
    expect(robot.upload("0"), 201)
    ann = signed_in(service, "ann@example.org")
    content = ann.get("/api/v1/home/archive").content
    there = files(content)
    grid = next(path for path in there if path.startswith("grids/"))
    doubled = {path.replace("robots/1/", "robots/2/"): file for path, file in there.items() if "robots/1/" in path}
    hostile = {
        "a robot of another's": ("robots/1/robot.json", there["robots/1/robot.json"].replace(b"anns", b"../anns")),
        "a robot without a name": ("robots/1/robot.json", b"{}"),
        "no robot's file": ("robots/1/robot.json", None),
        "the same grid as another file": (grid.replace(".png", ".pgm"), there[grid]),
        "a folder out": ("robots/../robot.json", b"{}"),
        "a zero": ("robots/0/robot.json", b"{}"),
    }
    expect(ann.request("DELETE", "/api/v1/robots/anns/maps?confirm=anns"))
    before = counts(service)
    for name, (path, file) in hostile.items():
        changed_there = {key: value for key, value in there.items() if key != path} | (
            {} if file is None else {path: file}
        )
        answer = bring_home_in(ann, packed(changed_there))
        assert answer.status_code == 422, (name, answer.text)
    assert bring_home_in(ann, packed(there | doubled)).status_code == 422, "the same robot twice"
    assert bring_in(ann, "anns", packed(there | doubled)).status_code == 422, "of a home, for a robot"
    assert counts(service) == before
    monkeypatch.setattr(importing, "MOST_KEPT", 1)
    bob = signed_in(service, "bob@example.org")
    expect(bring_home_in(bob, content), 201)
    assert bring_home_in(bob, content).status_code == 422, "kept robots are bounded"


def test_what_is_given_up_while_it_is_saved_tells_nothing_of_the_next_home(service: Service) -> None:
    robots = [service.add_robot(name, "ann@example.org") for name in ("anns", "anns-second")]
    for robot in robots:
        expect(robot.upload("0"), 201)
    ann, bob = (signed_in(service, f"{name}@example.org") for name in ("ann", "bob"))
    pieces = archiving.archive_home(service.database, service.grids, "ann@example.org")
    began = [next(pieces) for _ in range(3)]
    code = expect(ann.request("POST", "/api/v1/robots/anns-second/release"))["claim_code"]
    expect(bob.request("POST", "/api/v1/claims", json={"claim_code": code}), 201)
    expect(robots[1].upload("0", changed("other floor")), 201)
    there = files(b"".join([*began, *pieces]))
    assert [path for path in there if path.startswith("robots/2")] == []
    assert "robots/1/maps/1/map.json" in there


def test_an_archive_of_a_home_leaves_out_what_is_damaged(service: Service, mapped: RobotCaller) -> None:
    expect(mapped.upload("1", changed("annex"), base_version=1, tracking={"transform": [0.0, 0.0, 0.0]}), 201)
    with service.database.read() as tx:
        key = tx.execute(sa.select(mission.c.grid).where(mission.c.key == "0")).scalar_one()
    service.grids.delete([key])
    content = archive_of(service.operator, mapped.id)
    assert sum(path.startswith("grids/") for path in files(content)) == 1
    service.add_robot("RB-2")
    assert expect(bring_in(service.operator, "RB-2", content), 201)["missions"] == 2


def goes_on(robot: RobotCaller) -> None:
    """With ids that were not given out before."""
    again = expect(robot.upload("0", firmware="3.2.1", model="S9", tracking={"transform": [0.0, 0.0, 0.0]}))
    assert again["outcome"] == "created", "the same upload is the same mission"
    following = expect(
        robot.upload("5", changed("annex"), base_version=4, tracking={"transform": [0.0, 0.0, 0.0]}), 201
    )
    assert following["outcome"] in ("updated", "resolved")


@pytest.mark.parametrize("engine", ["sqlite"])
def test_a_second_map_of_a_robot_has_other_ids_everywhere(service: Service, mapped: RobotCaller) -> None:
    person = service.operator
    expect(person.edit(mapped.path(), 1, {"op": "rename_room", "id": "r1", "name": "Kitchen"}))
    target = service.add_robot("RB-2")
    expect(target.upload("0", changed("other floor"), map_name="upstairs"), 201)
    expect(bring_in(person, "RB-2", archive_of(person, mapped.id)), 201)
    before, after = (expect(person.get(f"/api/v1/robots/{robot}/maps/ground")) for robot in (mapped.id, "RB-2"))
    ids = [[feature["id"] for feature in document["features"]] for document in (before, after)]
    assert [one.replace("2-", "", 1) for one in ids[1]] == ids[0]
    assert all("2-" in one for one in ids[1] if one[0] != "w")
    assert [f["geometry"] for f in after["features"]] == [f["geometry"] for f in before["features"]]
    rooms = next(f["properties"]["rooms"] for f in after["features"] if f["properties"]["semantic"] == "divider")
    assert set(rooms) <= set(ids[1])


def packed(content: dict[str, bytes], *more: tuple[zipfile.ZipInfo | str, bytes], sign: bool = True) -> bytes:
    """An archive of these files; with the hashes that they have, if it is signed."""
    out, there = io.BytesIO(), dict(content)
    if sign:
        manifest = json.loads(there.pop("manifest.json"))
        entries = list(there.items())
        manifest["files"] = [
            {"path": path, "size": len(file), "sha256": sha256(file).hexdigest()} for path, file in entries
        ]
        there["manifest.json"] = json.dumps(manifest).encode()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, file in there.items():
            archive.writestr(path, file)
        for name, file in more:
            archive.writestr(name, file)
    return out.getvalue()


def link(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.external_attr = 0o120777 << 16
    return info


def changed_version(there: dict[str, bytes], **changes: Any) -> dict[str, bytes]:
    path = "maps/1/versions/000001.json"
    return there | {path: json.dumps(json.loads(there[path]) | changes).encode()}


@pytest.mark.parametrize("engine", ["sqlite"])
def test_hostile_archives_are_refused_and_leave_nothing_behind(service: Service, mapped: RobotCaller) -> None:
    there = files(archive_of(service.operator, mapped.id))
    service.add_robot("RB-2")
    grid = next(path for path in there if path.startswith("grids/"))
    document = json.loads(there["maps/1/versions/000001.json"])["document"]
    crossed = document | {"rooms": [document["rooms"][0] | {"polygon": [[[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]]}]}
    of_map = json.loads(there["maps/1/map.json"])
    mission = next(path for path in there if "/missions/" in path)
    bomb = packed(there, ("maps/1/events.jsonl.bomb", b""), sign=False)
    with pytest.warns(UserWarning, match="Duplicate name"):
        twice = packed(there, ("robot.json", b"{}"), sign=False)
    hostile = {
        "no zip": b"PK\x03\x04 and then nothing",
        "empty": b"",
        "cut off": packed(there)[:-30],
        "another name": bomb,
        "a path out": packed(there, ("../../etc/passwd", b"root"), sign=False),
        "an absolute path": packed(there, ("/etc/passwd", b"root"), sign=False),
        "a backslash": packed(there, ("maps\\1\\map.json", b"{}"), sign=False),
        "a link": packed({k: v for k, v in there.items() if k != "log.jsonl"}, (link("log.jsonl"), b"/etc/passwd")),
        "twice": twice,
        "not in the manifest": packed(there, ("maps/1/versions/000009.json", b"{}"), sign=False),
        "missing": packed({path: file for path, file in there.items() if path != grid}, sign=False),
        "another hash": packed(there | {"robot.json": there["robot.json"] + b" "}, sign=False),
        "no manifest": packed({path: file for path, file in there.items() if path != "manifest.json"}, sign=False),
        "a grid that is no image": packed(there | {grid: b"\x89PNG\r\n\x1a\nbut no more"}),
        "a grid of another name": packed({**there, f"grids/{chr(48) * 64}.png": there[grid]}),
        "a huge picture": packed(there | {grid: png_header(60_000, 60_000)}),
        "a version too many": packed(there | {"maps/1/versions/000007.json": there["maps/1/versions/000001.json"]}),
        "a parent of its own": packed(changed_version(there, parent=1)),
        "not finite": packed(changed_version(there, motion={"source": [[1e999, 0]], "target": [[0, 0]]})),
        "a room that crosses itself": packed(changed_version(there, document=crossed)),
        "more than there is": packed(changed_version(there, document=document | {"more": 1})),
        "a name that is none": packed(changed_version(there, document={**document, "rooms": [{**document["rooms"][0], "name": {}}]})),
        "a newer format": packed(changed_version(there, document=document | {"format": 99})),
        "nested": packed(there | {"maps/1/map.json": b"[" * 100_000}),
        "a map that is called ..": packed(there | {"maps/1/map.json": json.dumps(of_map | {"name": "../x"}).encode()}),
        "other rooms": packed(there | {"maps/1/map.json": json.dumps(of_map | {"rooms": []}).encode()}),
        "a mission without its grid": packed(there | {mission: there[mission].replace(b'"grid":"', b'"grid":"0')}),
    }  # fmt: skip
    before = counts(service)
    for name, content in hostile.items():
        answer = bring_in(service.operator, "RB-2", content)
        assert answer.status_code in (413, 422), (name, answer.status_code, answer.text)
    assert counts(service) == before
    assert expect(bring_in(service.operator, "RB-2", packed(there)), 201)["maps"] == ["ground"]


def counts(service: Service) -> list[int]:
    with service.database.read() as tx:
        return [
            tx.execute(sa.select(sa.func.count()).select_from(table)).scalar_one() for table in metadata.sorted_tables
        ]


def png_header(width: int, height: int) -> bytes:
    """A picture of that size, in a few bytes."""
    header = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header)) + b"\0" * 40


def test_a_bomb_is_refused_by_its_list_of_contents_before_anything_is_unpacked() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(1, 11):
            archive.writestr(f"grids/{number:064x}.json", bytes(40 * 2**20), compresslevel=1)
    assert len(out.getvalue()) < 4 * 2**20
    tracemalloc.start()
    with pytest.raises(TooLarge, match="too much for an archive"):
        Archive(out)
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()
    single = io.BytesIO()
    with zipfile.ZipFile(single, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("manifest.json", bytes(MOST_OF_ONE + 1), compresslevel=1)
    with pytest.raises(InvalidInput):
        Archive(single)


def test_a_list_of_contents_that_is_too_long_is_not_even_read() -> None:
    entry = b"PK\x01\x02" + bytes(42)
    contents = entry * (archives.MOST_OF_CONTENTS // len(entry) + 1)
    end = struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, 9, 9, len(contents), 0, 0)
    file = io.BytesIO(contents + end)
    tracemalloc.start()
    with pytest.raises(TooLarge, match="files"):
        Archive(file)
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()


@pytest.mark.parametrize("path", ["robots/1/robot.json", "maps/1/map.json", "maps/1/versions/000001.json"])
def test_a_document_that_would_become_too_many_objects_is_refused_by_its_size(path: str) -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(path, bytes(archives.MOST_OF_DOCUMENT + 1), compresslevel=1)
    with pytest.raises(InvalidInput) as refused:
        Archive(out)
    assert [fault.pointer for fault in refused.value.faults] == [f"/{path}"]


@pytest.mark.parametrize("engine", ["sqlite"])
def test_only_so_many_archives_are_in_hand_at_once(service: Service, mapped: RobotCaller) -> None:
    content = archive_of(service.operator, mapped.id)
    path = f"/api/v1/robots/{mapped.id}/archive"
    with ExitStack() as others:
        for turns, most in ((READING, 2), (WRITING, 8)):
            for _ in range(most):
                others.enter_context(turns.turn())
        for refused in (service.operator.get(path), bring_in(service.operator, mapped.id, content)):
            assert refused.status_code == 503
            assert int(refused.headers["Retry-After"]) > 0
    assert archive_of(service.operator, mapped.id)
    assert bring_in(service.operator, mapped.id, content).status_code == 409


def test_an_archive_has_not_too_many_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archives, "MOST_FILES", 3)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for number in range(4):
            archive.writestr(f"maps/1/versions/{number:06d}.json", b"{}")
    with pytest.raises(TooLarge, match="at most 3 files"):
        Archive(out)


def test_an_archive_is_written_while_it_is_sent(service: Service, mapped: RobotCaller) -> None:
    pieces = list(archiving.archive(service.database, service.grids, mapped.id))
    there = files(b"".join(pieces))
    assert len(pieces) >= len(there)
    assert max(map(len, pieces)) < max(map(len, there.values())) + 4096, "one file at a time"


@pytest.mark.parametrize("engine", ["sqlite"])
def test_the_command_line_saves_brings_in_and_deletes(
    service: Service,
    mapped: RobotCaller,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("STILLROOM_DATABASE_URL", service.settings.database_url)
    monkeypatch.setenv("STILLROOM_GRID_STORE_URL", service.settings.grid_store_url)
    before = expect(mapped.get(mapped.path()))
    file = tmp_path / "home.zip"
    assert main(["archive", mapped.id, "--out", str(file)]) == 0
    assert main(["import", mapped.id, str(file)]) == 1, "it has the map"
    assert main(["erase", mapped.id]) == 1, "nobody has confirmed it"
    assert main(["erase", mapped.id, "--confirm", mapped.id]) == 0
    assert mapped.get(mapped.path()).status_code == 404
    assert main(["import", mapped.id, str(tmp_path / "none.zip")]) == 1
    assert main(["import", mapped.id, str(file)]) == 0
    assert expect(mapped.get(mapped.path())) == before
    assert main(["archive", "nobody"]) == 1
    out, said = capsys.readouterr()
    assert out.splitlines()[1:] == ["deleted: 1 maps, 1 missions", f"{mapped.id}: ground, 1 versions, 1 missions"]
    assert "There is no robot nobody." in said
