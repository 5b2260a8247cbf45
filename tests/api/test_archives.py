"""A home as an archive: complete, and the same again where it is brought in."""

import io
import json
import struct
import tracemalloc
import zipfile
import zlib
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.__main__ import main
from stillroom.documents import archives
from stillroom.documents.archives import MOST_OF_ONE, Archive
from stillroom.errors import InvalidInput, TooLarge
from stillroom.service import archiving
from stillroom.service.verifying import verify
from stillroom.store.tables import metadata
from tests.conflicts import expect
from tests.conftest import Caller, RobotCaller, Service
from tests.fuzz.neighbourhood import settle
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
            archive.writestr(f"maps/1/versions/{number:06d}.json", bytes(40 * 2**20), compresslevel=1)
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
    assert out.splitlines()[1:] == ["deleted: 1 maps, 1 missions", "ground: 1 versions, 1 missions"]
    assert "There is no robot nobody." in said
