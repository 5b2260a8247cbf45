"""Every reader of what strangers send, fed with what almost is what it reads: it takes it or refuses it, in bounded time and memory."""

import io
import json
import os
import resource
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from time import monotonic, thread_time
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser

from stillroom.api.multipart import _Reader
from stillroom.documents.archives import Archive
from stillroom.documents.checking import check_map, check_motion
from stillroom.documents.grids import read_mission_map
from stillroom.documents.images import Reading
from stillroom.documents.json_text import load_json
from stillroom.documents.missions import parse_meta
from stillroom.documents.nav2 import read_yaml
from stillroom.documents.operations import OperationDocument
from stillroom.documents.stored import encode_map
from stillroom.documents.umf import is_umf, read_umf
from stillroom.errors import StillroomError
from stillroom.maps.geometry import Pose
from stillroom.maps.semantics import Ids
from stillroom.pipeline.update import create_semantic_map
from tests.api.test_formats import valetudo
from tests.documents.test_umf import umf
from tests.homes import home, png

SECONDS = float(os.environ.get("STILLROOM_FUZZ_S", "0"))
EXAMPLES = 25
SLOWEST_S = 20.0
MOST_KIB = 2 * 2**20
"""That the process may grow by."""
READING = Reading(0.05, Pose(0.0, 0.0, 0.0))
META = {
    "sequence": 1, "firmware": "3.2.1", "started_at": "2026-11-22T08:00:00Z", "resolution": 0.05, "origin": [0.0, 0.0, 0.0],
    "base_version": 1, "tracking": {"rooms": {"r1": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]}, "transform": [0.0, 0.0, 0.0],
    "submaps": [{"from": [0.0, 0.0, 0.0], "to": [0.1, 0.0, 0.0]}]},
}  # fmt: skip
OPERATIONS = [
    {"op": "add_divider", "line": [[4.0, 1.5], [8.0, 1.5]], "kind": "door"},
    {"op": "merge_rooms", "ids": ["r1", "r2"]},
    {"op": "add_restriction", "kind": "no_go", "shape": [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0]]},
]
YAML = b"image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
OCCUPANCY = {
    "header": {"frame_id": "map"},
    "info": {"resolution": 0.05, "width": 3, "height": 2, "origin": {"position": {"x": 0, "y": 0, "z": 0},
    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}},
    "data": [0, 100, -1, 0, 0, 100],
}  # fmt: skip
MULTIPART = (
    b'--b\r\nContent-Disposition: form-data; name="meta"\r\nContent-Type: application/json\r\n\r\n{}\r\n--b--\r\n'
)


def _stored() -> bytes:
    grid, _ = read_mission_map(png(home()), READING)
    made = create_semantic_map(grid, "0", Ids()).candidate
    assert made is not None
    return json.dumps(encode_map(made)).encode()


def _archive() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("robot.json", '{"id": "RB-1"}')
        archive.writestr(
            "manifest.json",
            '{"format": 1, "service": "x", "robot": "RB-1", "made_at": "2026-11-22T08:00:00Z", "files": []}',
        )
    return out.getvalue()


def _read_multipart(content: bytes) -> None:
    parser = MultipartParser(b"b", _Reader().callbacks())  # type: ignore[arg-type]
    parser.write(content)
    parser.finalize()


def _read_umf(content: bytes) -> None:
    document = load_json(content, "")
    if is_umf(document):
        read_umf(document)


def _stored_map(content: bytes) -> None:
    document = load_json(content, "")
    if isinstance(document, dict):
        check_map(document, "")
        check_motion(document, "")


READERS: Mapping[str, tuple[Callable[[bytes], object], tuple[Callable[[], bytes], ...], bytes]] = {
    "grid": (
        lambda content: read_mission_map(content, READING),
        (
            lambda: png(home()),
            lambda: b"P5\n# a remark\n200 120\n255\n" + home().tobytes(),
            lambda: b"P2 3 2 15\n0 1 2\n3 4 15\n",
            lambda: json.dumps(valetudo()).encode(),
            lambda: json.dumps(OCCUPANCY).encode(),
        ),
        b'{"__class": "ValetudoMap", "layers": [{"compressedPixels": [',
    ),
    "meta": (parse_meta, (lambda: json.dumps(META).encode(),), b'{"sequence": 1, "tracking": {"rooms": '),
    "operations": (
        lambda content: TypeAdapter(list[OperationDocument]).validate_json(content),
        (lambda: json.dumps(OPERATIONS).encode(),),
        b'[{"op": ',
    ),
    "umf": (_read_umf, (lambda: json.dumps(umf()).encode(),), b'{"maps": [{'),
    "yaml": (read_yaml, (lambda: YAML,), b"image: &a [*a, "),
    "stored map": (_stored_map, (_stored,), b'{"format": 5, "rooms": [{"id": '),
    "archive": (lambda content: Archive(io.BytesIO(content)), (_archive,), b"PK\x05\x06"),
    "multipart": (_read_multipart, (lambda: MULTIPART,), b"--b\r\n"),
}
REFUSALS = (StillroomError, ValidationError, FormParserError)
ODD = (
    b"",
    b"\0",
    b"\xff" * 4,
    b"1e999",
    b"-1",
    b"99999999999999999999",
    b"NaN",
    b"null",
    b"[]",
    b"{}",
    b'""',
    b"[" * 2000,
    b"\x7f\xff\xff\xff",
)


@st.composite
def spoilt(draw: st.DrawFn, samples: list[bytes], beginning: bytes) -> bytes:
    """A sample with some things put in, taken out, doubled or turned; or nothing but noise behind a good beginning."""
    if not draw(st.integers(0, 7)):
        return beginning + draw(st.binary(max_size=300))
    content = bytearray(draw(st.sampled_from(samples)))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(content)))
        many = draw(st.integers(1, 40))
        match draw(st.integers(0, 5)):
            case 0:
                content[at : at + many] = draw(st.sampled_from(ODD))
            case 1:
                del content[at : at + many]
            case 2:
                content[at:at] = content[at : at + many] * draw(st.integers(1, 50))
            case 3:
                del content[at:]
            case 4 if at < len(content):
                content[at] ^= 1 << draw(st.integers(0, 7))
            case _:
                content[at:at] = draw(st.binary(max_size=20))
    return bytes(content)


@pytest.mark.parametrize("reader", READERS)
def test_a_reader_takes_or_refuses_whatever_it_is_fed(reader: str) -> None:
    read, make, beginning = READERS[reader]
    samples = [sample() for sample in make]
    for sample in samples:
        _feed(read, sample)
    before, until, turn = _grown(), monotonic() + SECONDS / len(READERS), 0
    while turn == 0 or monotonic() < until:
        _round(read, samples, beginning, turn)
        turn += 1
    assert _grown() - before < MOST_KIB


def _round(read: Callable[[bytes], object], samples: list[bytes], beginning: bytes, turn: int) -> None:
    @seed(turn)
    @settings(max_examples=EXAMPLES, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
    @given(spoilt(samples, beginning))
    def feed(content: bytes) -> None:
        _feed(read, content)

    feed()


def _feed(read: Callable[[bytes], Any], content: bytes) -> None:
    began = thread_time()
    with suppress(*REFUSALS):
        read(content)
    assert thread_time() - began < SLOWEST_S, content[:500]


def _grown() -> int:
    """KiB that this process has ever needed."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
