"""Archives of which single documents say what no service would write, with hashes that are right: brought in and of use, or refused."""

import io
import json
import os
import zipfile
from contextlib import suppress
from hashlib import sha256
from random import Random
from time import monotonic, process_time
from typing import Any, get_args

from stillroom.documents.archives import Archive
from stillroom.documents.exports import ExportFormat
from stillroom.errors import StillroomError
from stillroom.service.erasing import erase_robot
from stillroom.service.importing import import_archive
from tests.conflicts import expect
from tests.conftest import RobotCaller, Service
from tests.fuzz.neighbourhood import settle
from tests.homes import home

SECONDS = float(os.environ.get("STILLROOM_FUZZ_S", "0"))
TURNS = 8
SLOWEST_S = 20.0
ODD: tuple[Any, ...] = (
    None, True, 0, 1, -1, 2**31, 2**63, 2**80, 1e308, 1e-320, 0.5, "", "\0", "x" * 500, "r1", "r2", "d1", "\ud800", "2026-11-22T08:00:00Z",
    "0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-12:00", "../x", [], {}, [[]], [0, 0], [[0.0, 0.0], [0.0, 0.0]],
)  # fmt: skip


def spoilt(document: Any, by: Random) -> Any:
    """With one value, wherever it stands, that is another one, missing, doubled, or that of another place."""
    places = list(_places(document))
    if not places:
        return by.choice(ODD)
    holder, key = by.choice(places)
    match by.randrange(5):
        case 0:
            other, at = by.choice(places)
            holder[key] = json.loads(json.dumps(other[at]))
        case 1 if isinstance(holder, list):
            holder.insert(key, json.loads(json.dumps(holder[key])))
        case 2:
            del holder[key]
        case 3 if isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
            holder[key] += by.choice((-1, 1, 0.1, 1e-9, 1000))
        case _:
            holder[key] = by.choice(ODD)
    return document


def _places(value: Any) -> list[tuple[Any, Any]]:
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else []
    return [place for key in keys for place in ((value, key), *_places(value[key]))]


def packed(files: dict[str, bytes]) -> io.BytesIO:
    manifest = json.loads(files["manifest.json"])
    rest = {path: content for path, content in files.items() if path != "manifest.json"}
    manifest["files"] = [
        {"path": path, "size": len(content), "sha256": sha256(content).hexdigest()} for path, content in rest.items()
    ]
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for path, content in rest.items():
            archive.writestr(path, content)
        archive.writestr("manifest.json", json.dumps(manifest))
    return out


def test_an_archive_that_says_what_nobody_would_write_is_of_use_or_refused(service: Service) -> None:
    callers = settle(service).callers
    answer = callers["neighbour"].get("/api/v1/robots/bobs/archive")
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        files = {path: archive.read(path) for path in archive.namelist()}
    targets = [path for path in files if path.endswith(".json") and "/current/" not in path and path != "manifest.json"]
    to = service.add_robot("to")
    until, turn, taken = monotonic() + SECONDS, 0, 0
    while turn < TURNS or monotonic() < until:
        by, there = Random(turn), dict(files)
        for path in by.sample(targets, by.choice((1, 1, 2))):
            there[path] = json.dumps(spoilt(json.loads(there[path]), by)).encode()
        taken += _brought_in(service, to, packed(there), turn)
        turn += 1
    assert 0 < taken < turn, "some of it does no harm"


def _brought_in(service: Service, to: RobotCaller, archive: io.BytesIO, turn: int) -> bool:
    began = process_time()
    made = None
    with suppress(StillroomError):
        made = import_archive(service.database, service.grids, to.id, Archive(archive))
    if made is not None:
        for name in made.maps:
            _use(service, to, name)
        erase_robot(service.database, service.grids, to.id, to.id)
    assert process_time() - began < SLOWEST_S, turn
    return made is not None


def _use(service: Service, to: RobotCaller, name: str) -> None:
    """Everything that is shown of a map, and a mission on it: the application raises what it did not expect."""
    path = to.path(name)
    shown = to.get(path)
    assert shown.status_code in (200, 404), shown.text
    for kind in ("missions", "versions", "segments", "conflicts"):
        expect(to.get(f"{path}/{kind}"))
    for mission in expect(to.get(f"{path}/missions"))["items"]:
        for end in ("", "/grid.png", "/cells.png"):
            assert to.get(f"{path}/missions/{mission['id']}{end}").status_code in (200, 404)
    for version in expect(to.get(f"{path}/versions"))["items"]:
        for kind in get_args(ExportFormat):
            answer = to.get(f"{path}/versions/{version['version']}/export?format={kind}")
            assert answer.status_code in (200, 404, 422), answer.text
    if shown.status_code == 200:
        number = shown.json()["version"]
        edit = {"op": "add_restriction", "kind": "no_go", "shape": [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0]]}
        assert service.operator.edit(path, number, edit, dry_run=True).status_code in (200, 422)
        assert service.operator.get(f"{path}/edits/suggested?sensitivity=0.5").status_code in (200, 422)
        assert service.operator.get(f"{path}/versions/1/diff/{number}").status_code == 200
    done = to.upload("new", home(shift=(1, 0)), map_name=name, tracking={"transform": [0.0, 0.0, 0.0]}, sequence=9)
    assert done.status_code == 201, done.text
    assert "Processing failed" not in done.json()["reason"], done.text
