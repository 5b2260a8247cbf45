"""What strangers and broken robots send: refused as the contract says, in bounded memory, and nothing is stored."""

import json
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.conftest import RobotCaller, Service, features
from tests.documents.test_valetudo import FLOOR, document, entity, layer
from tests.homes import FREE, UNEXPLORED, home, pixels, png

MIB = 2**20
MOST_MEMORY = 600 * MIB
"""What one upload may add to the process at most, its sender's copies of the body included."""


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png_of(width: int, height: int, body: bytes, depth: int = 8, colours: int = 0, extra: bytes = b"") -> bytes:
    header = struct.pack(">IIBBBBB", width, height, depth, colours, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + extra + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@cache
def zeros(count: int) -> bytes:
    """So many zeros, deflated: a small part of their size."""
    packer = zlib.compressobj(1)
    block = bytes(MIB)
    parts = [packer.compress(block) for _ in range(count // MIB)]
    return b"".join([*parts, packer.compress(bytes(count % MIB)), packer.flush()])


@dataclass(frozen=True)
class Case:
    name: str
    media_type: str
    status: int
    content: Callable[[], bytes]


PNG, PGM, JSON = "image/png", "image/x-portable-graymap", "application/json"


def bomb() -> bytes:
    return b"name\0\0" + zeros(700 * MIB)


def coloured() -> bytes:
    return cv2.imencode(".png", np.tile(np.array([[[9, 99, 250]]], np.uint8), (9, 9, 1)))[1].tobytes()


def deep_colour() -> bytes:
    return cv2.imencode(".png", np.full((40, 40), 60_000, np.uint16))[1].tobytes()


ONE = zlib.compress(bytes(20))
IMAGES = (
    Case("cut off", PNG, 422, lambda: png(home())[:100]),
    Case("without its end", PNG, 422, lambda: png(home())[:-12]),
    Case("20,000 x 20,000", PNG, 413, lambda: png_of(20_000, 20_000, zeros(20_001 * 20_000))),
    Case("says 20,000 x 20,000", PNG, 413, lambda: png_of(20_000, 20_000, ONE)),
    Case("says 0 x 0", PNG, 422, lambda: png_of(0, 0, ONE)),
    Case("says 2^31 x 2^31", PNG, 413, lambda: png_of(2**31, 2**31, ONE)),
    Case("just too many cells", PGM, 413, lambda: b"P5 5000 4001 255\n"),
    Case("fewer pixels than it says", PNG, 422, lambda: png_of(4000, 4000, ONE)),
    Case("a text that unpacks to 700 MiB", PNG, 422, lambda: png_of(4, 4, ONE, extra=chunk(b"zTXt", bomb()))),
    Case("a profile that unpacks to 700 MiB", PNG, 422, lambda: png_of(4, 4, ONE, extra=chunk(b"iCCP", bomb()))),
    Case("pixels that unpack to 700 MiB", PNG, 422, lambda: png_of(4, 4, zeros(700 * MIB))),
    Case("16 bit", PNG, 422, deep_colour),
    Case("16 bit PGM", PGM, 422, lambda: b"P5 2 2 65535\n" + bytes(8)),
    Case("colours", PNG, 422, coloured),
    Case("all unexplored", PNG, 422, lambda: png(np.full((50, 50), 205, np.uint8))),
    Case("all occupied", PNG, 422, lambda: png(np.zeros((50, 50), np.uint8))),
    Case("another format", "image/gif", 415, lambda: b"GIF89a" + bytes(100)),
    Case("no type", "", 415, lambda: png(home())),
    Case("not what it says", JSON, 422, lambda: png(home())),
    Case("a number without end", PGM, 422, lambda: b"P2 2 2 255\n" + b"9" * 10 * MIB),
    Case("many numbers", PGM, 422, lambda: b"P2 2 2 255\n" + b"9999 " * 5_000_000),
)


def dumped(content: Any) -> Callable[[], bytes]:
    return lambda: json.dumps(content).encode()


def message(data: bytes, width: int, height: int) -> bytes:
    return b'{"info": {"resolution": 0.05, "width": %d, "height": %d}, "data": [%s]}' % (width, height, data)


def areas(*points: float) -> Any:
    return document(FLOOR, entities=(entity("no_go_area", *points),))


DOCUMENTS = (
    Case("10 million levels", JSON, 422, lambda: b"[" * 10_000_000),
    Case("levels of objects", JSON, 422, lambda: b'{"a":' * 5_000_000),
    Case("10 million lists", JSON, 422, lambda: b"[" + b"[]," * 10_000_000 + b"0]"),
    Case("6 million words", JSON, 422, lambda: b"[" + b'"ab",' * 6_000_000 + b"0]"),
    Case("no kind", JSON, 422, dumped({"a": 1})),
    Case("no layers", JSON, 422, dumped({"__class": "ValetudoMap", "pixelSize": 5})),
    Case("layers without pixels", JSON, 422, dumped(document(layer("floor", [])))),
    Case("huge numbers", JSON, 422, dumped(document(FLOOR | {"pixels": [1, 10**300]}))),
    Case("far apart", JSON, 413, dumped(document(layer("floor", [0, 0, 1, 10**6, 10**6, 1])))),
    Case("a run without end", JSON, 422, dumped(document(layer("floor", [0, 0, 10**9])))),
    Case("endless overlap", JSON, 413, dumped(document(layer("floor", [0, 0, 1_000_000] * 1000)))),
    Case("a polygon of 2 points", JSON, 422, dumped(areas(0, 0, 9, 9))),
    Case("a polygon of nothing", JSON, 422, dumped(areas())),
    Case("no size", JSON, 422, dumped(document(FLOOR) | {"pixelSize": 0})),
    Case("a negative size", JSON, 422, dumped(document(FLOOR) | {"pixelSize": -5})),
    Case(
        "a word among numbers", JSON, 422, lambda: message(b'"' + b"x" * 8 * MIB + b'"' + b",0" * 999_999, 1000, 1000)
    ),
    Case("10^10 cells", JSON, 413, lambda: message(b"", 10**5, 10**5)),
    Case("no resolution", JSON, 422, lambda: message(b"0", 1, 1).replace(b"0.05", b"NaN")),
    Case("more cells than it says", JSON, 422, lambda: message(b"0," * 15_000_000 + b"0", 1, 1)),
    Case("floats", JSON, 422, lambda: message(b"1.5," * 7_499_999 + b"1.5", 3000, 2500)),
)

GOOD: dict[str, Any] = {"sequence": 1, "resolution": 0.05, "origin": [0, 0, 0]}
CHANGES: tuple[tuple[str, Any], ...] = (
    ("sequence", float("nan")),
    ("sequence", 1e300),
    ("sequence", -1),
    ("resolution", float("nan")),
    ("resolution", 1e300),
    ("resolution", -0.05),
    ("resolution", 0),
    ("origin", [1e300, 0, 0]),
    ("origin", [0, 0, float("inf")]),
    ("origin", [0, 0]),
    ("tracking", {"rooms": {"r1": [[0, 0], [1e300, 0]]}}),
    ("tracking", {"rooms": {"r1": [0] * 1_000_000}}),
    ("tracking", {"rooms": {str(n): 0 for n in range(300_000)}}),
    ("tracking", {"transform": [0, 0]}),
    ("occupied_thresh", 2),
    ("started_at", "yesterday"),
)
METAS: tuple[tuple[str, Callable[[], bytes]], ...] = (
    *((f"{name} {value!s:.30}", dumped(GOOD | {name: value})) for name, value in CHANGES),
    ("10 million levels", lambda: b"[" * 10_000_000),
    ("900 levels", lambda: b'{"sequence": 1, "x": ' + b"[" * 900 + b"]" * 900 + b"}"),
    ("10 million lists", lambda: b"[" + b"[]," * 10_000_000 + b"0]"),
    ("a million infinities", lambda: b'{"sequence": 1, "x": [' + b"1e999," * 600_000 + b"0]}"),
    ("20 MiB", lambda: b'{"sequence": 1, "x": "' + b"x" * 20 * MIB + b'"}'),
    ("no text", lambda: b"\xff\xfe"),
)


@contextmanager
def bounded_memory() -> Iterator[None]:
    """Fails where the process meanwhile took more than MOST_MEMORY at any moment."""

    def memory(kind: str) -> int:
        lines = Path("/proc/self/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(kind))

    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far (proc(5))
    before = memory("VmRSS")
    yield
    assert memory("VmHWM") - before < MOST_MEMORY


def upload(robot: RobotCaller, grid: bytes, grid_type: str, meta: bytes) -> Any:
    files = {"meta": ("m", meta, "application/json"), "grid": ("g", grid, grid_type)}
    with bounded_memory():
        return robot.request("PUT", f"{robot.path()}/missions/6", {"Prefer": "wait=30"}, files=files)


def check_refused(service: Service, robot: RobotCaller, answer: Any, status: int) -> None:
    """A problem document, a service that goes on, and nothing stored."""
    assert answer.status_code == status, answer.text[:500]
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert len(answer.content) < 100_000
    assert robot.get(f"{robot.path()}/missions/6").status_code == 404
    assert robot.get("/api/v1/robots").json()["items"][0]["maps"] == []
    assert [path for path in Path(service.settings.grid_store_url).rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("case", IMAGES + DOCUMENTS, ids=lambda case: case.name)
def test_a_grid_that_can_t_be_read_is_refused_in_bounded_memory(
    service: Service, robot: RobotCaller, case: Case
) -> None:
    is_json = case.media_type == JSON
    meta = {"sequence": 1} if is_json else GOOD
    answer = upload(robot, case.content(), case.media_type, json.dumps(meta).encode())
    check_refused(service, robot, answer, case.status)


@pytest.mark.parametrize(("name", "content"), METAS, ids=[name for name, _ in METAS])
def test_meta_that_can_t_be_used_is_refused_in_bounded_memory(
    service: Service, robot: RobotCaller, name: str, content: Callable[[], bytes]
) -> None:
    answer = upload(robot, png(home()), PNG, content())
    check_refused(service, robot, answer, 422)
    assert answer.json()["errors"][0]["pointer"].startswith("/meta"), name


def many_parts(boundary: bytes, count: int) -> bytes:
    part = b"--" + boundary + b'\r\nContent-Disposition: form-data; name="more"\r\n\r\n1\r\n'
    return part * count + b"--" + boundary + b"--\r\n"


@pytest.mark.parametrize(
    ("boundary", "body"),
    [(b"b", many_parts(b"b", 17)), (b"b" * 5000, many_parts(b"b" * 5000, 1)), (b"b", b"--b\r\n"), (b"b", b"")],
)
def test_a_multipart_body_that_can_t_be_an_upload_is_refused(robot: RobotCaller, boundary: bytes, body: bytes) -> None:
    headers = {"Content-Type": f"multipart/form-data; boundary={boundary.decode()}"}
    answer = robot.request("PUT", f"{robot.path()}/missions/0", headers, content=body)
    assert (answer.status_code, answer.json()["title"]) == (422, "The input can't be used"), answer.text


def test_a_body_of_50_mb_is_refused(service: Service, robot: RobotCaller) -> None:
    check_refused(service, robot, upload(robot, bytes(50_000_000), PNG, json.dumps(GOOD).encode()), 413)


@pytest.mark.parametrize(
    "body", [b"[" * 10_000_000, b'{"operations": ' + b"[" * 10_000_000, b"", b"\xff", b'{"operations": [1e999]}']
)
def test_an_edit_that_is_no_json_is_refused(service: Service, mapped: RobotCaller, body: bytes) -> None:
    headers = {"If-Match": '"v1"', "Content-Type": "application/json"}
    answer = service.operator.request("POST", f"{mapped.path()}/edits", headers, content=body)
    assert answer.status_code in (413, 422)
    assert answer.headers["Content-Type"] == "application/problem+json"


@pytest.mark.parametrize(
    "operation",
    [
        {"op": "add_restriction", "kind": "no_go", "shape": [[0, 0], [1, 1]]},
        {"op": "add_restriction", "kind": "no_go", "shape": []},
        {"op": "add_restriction", "kind": "no_go", "shape": [[0, 0], [1, 0], [1e300, 1]]},
        {"op": "add_divider", "line": [[0, 0]]},
    ],
)
def test_a_shape_of_too_few_points_is_refused_and_the_map_stays(
    service: Service, mapped: RobotCaller, operation: dict[str, Any]
) -> None:
    assert service.operator.edit(mapped.path(), 1, operation).status_code == 422
    assert mapped.get(mapped.path()).json()["version"] == 1


# -- what is odd but allowed ---------------------------------------------------------------------------------------


def coloured_alike(alpha: bool) -> bytes:
    grey = home()[::-1]
    channels = [grey, grey, grey]
    if alpha:
        channels.append(np.where(grey == UNEXPLORED, 0, 255).astype(np.uint8))
    return cv2.imencode(".png", cv2.merge(channels))[1].tobytes()


@pytest.mark.parametrize("alpha", [False, True])
def test_equal_channels_are_grey_and_what_is_transparent_is_unexplored(robot: RobotCaller, alpha: bool) -> None:
    answer = robot.upload("0", coloured_alike(alpha))
    assert answer.json()["outcome"] == "created"
    assert np.array_equal(pixels(robot.get(f"{robot.path()}/versions/1/cells.png").content), home())


def test_a_few_marks_in_colour_are_taken_as_unexplored(robot: RobotCaller) -> None:
    marked = np.repeat(home()[::-1, :, None], 3, axis=2)
    marked[60, 60] = (255, 0, 0)
    answer = robot.upload("0", cv2.imencode(".png", marked)[1].tobytes())
    assert answer.json()["outcome"] == "created"
    cells = pixels(robot.get(f"{robot.path()}/versions/1/cells.png").content)
    assert np.argwhere(cells != home()).tolist() == [[59, 60]]


def test_one_free_cell_is_a_map_without_rooms(robot: RobotCaller) -> None:
    for number, content in enumerate((png(np.full((1, 1), FREE, np.uint8)), b"P5 1 1 255\n\xfe")):
        answer = robot.upload("0", content, map_name=f"m{number}", grid_type=(PNG, PGM)[number])
        assert answer.json()["outcome"] == "created"
        document_ = robot.get(robot.path(f"m{number}")).json()
        assert features(document_, "room") == []
        assert (document_["frame"]["width"], document_["frame"]["height"]) == (1, 1)


def test_tracking_of_what_the_map_does_not_have_is_ignored_with_a_warning(mapped: RobotCaller) -> None:
    tracking = {
        "rooms": {"r99": [[0, 0], [1, 0], [1, 1]], "r1": [[0, 0], [1, 1]]},
        "dividers": {"nobody": [[0, 0], [1, 1]]},
    }
    mission = mapped.upload("1", base_version=1, tracking=tracking).json()
    assert mission["outcome"] == "updated"
    for name in ("r99", "r1", "nobody"):
        assert any(name in warning for warning in mission["warnings"])
