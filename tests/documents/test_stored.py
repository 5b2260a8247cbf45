"""Maps at rest: what goes in comes out, in every format that was ever written."""

import json
from dataclasses import replace
from typing import TypeVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Polygon

from stillroom.documents import stored
from stillroom.documents.stored import decode_ids, decode_map, decode_motion, encode_ids, encode_map, encode_motion
from stillroom.maps.geometry import Pose, as_points
from stillroom.maps.grid import GridFrame
from stillroom.maps.meta import Declined, MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Clutter, Divider, Ids, Phantom, Restriction, Room, SemanticMap, Wall

T = TypeVar("T")
coordinate = st.floats(-1000, 1000)
point = st.tuples(coordinate, coordinate)
line = st.tuples(point, point)
name = st.text(min_size=1, max_size=12)
made_by = st.sampled_from(["algorithm", "user"])


@st.composite
def polygons(draw: st.DrawFn) -> Polygon:
    x, y = draw(point)
    width, height = (draw(st.floats(0.5, 20)) for _ in range(2))
    shell = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    hole = [(x + width * u, y + height * v) for u, v in ((0.2, 0.2), (0.2, 0.4), (0.4, 0.4), (0.4, 0.2))]
    return Polygon(shell, [hole] if draw(st.booleans()) else [])


def several(strategy: st.SearchStrategy[T]) -> st.SearchStrategy[tuple[T, ...]]:
    return st.lists(strategy, max_size=3).map(tuple)


maps = st.builds(
    SemanticMap,
    frame=st.builds(
        GridFrame,
        st.floats(0.01, 1),
        st.integers(1, 4000),
        st.integers(1, 4000),
        st.builds(Pose, coordinate, coordinate, coordinate),
    ),
    rooms=several(
        st.builds(
            Room,
            name,
            name,
            st.integers(0, 10**6),
            polygons(),
            made_by,
            made_by,
            st.none() | name,
            st.none() | name,
            st.booleans(),
            st.none() | polygons(),
            st.sampled_from([None, "kitchen", "hall"]),
        )
    ),
    dividers=several(
        st.builds(
            Divider, name, line, st.sampled_from(["open", "door"]), made_by, st.lists(name, max_size=2).map(tuple)
        )
    ),
    walls=several(
        st.builds(Wall, name, st.lists(point, min_size=2, max_size=5).map(tuple), st.sampled_from(["wall", "open"]))
    ),
    clutter=several(st.builds(Clutter, name, polygons())),
    restrictions=several(
        st.builds(
            Restriction,
            name,
            st.sampled_from(["no_go", "no_mop", "virtual_wall"]),
            st.lists(point, min_size=3, max_size=5).map(tuple),
            st.booleans(),
        )
    ),
    meta=st.builds(
        MapMeta,
        several(st.builds(MetaOccupancy, name, polygons(), st.sampled_from(["occupied", "free"]), name)),
        several(st.builds(MetaDivider, name, line, st.lists(name, max_size=2).map(tuple), name)),
        several(
            st.builds(
                Declined,
                polygons() | line.map(LineString),
                st.none() | st.just("2026-11-29T08:41:00Z"),
            )
        ),
    ),
    phantoms=several(st.builds(Phantom, name, st.lists(point, min_size=3, max_size=5).map(tuple))),
    ids=st.builds(Ids, st.just("2-"), st.just((("d", 4), ("r", 7)))),
)


@given(maps)
def test_a_map_comes_back_from_json_as_it_was_vertex_for_vertex(semantic_map: SemanticMap) -> None:
    written = json.loads(json.dumps(encode_map(semantic_map)))
    back = decode_map(written, semantic_map.ids)
    assert back == semantic_map
    assert json.loads(json.dumps(encode_map(back))) == written


@given(st.lists(st.tuples(point, point), max_size=5))
def test_a_motion_comes_back_as_it_was(pairs: list[tuple[tuple[float, float], tuple[float, float]]]) -> None:
    motion = Motion(as_points([source for source, _ in pairs]), as_points([target for _, target in pairs]))
    back = decode_motion(json.loads(json.dumps(encode_motion(motion))))
    if not pairs:
        assert back is None
    else:
        assert back is not None
        assert back.source.tolist() == motion.source.tolist()
        assert back.target.tolist() == motion.target.tolist()


def test_counters_of_ids_come_back_whatever_their_order() -> None:
    ids = Ids("2-", (("d", 4), ("r", 7)))
    assert decode_ids("2-", encode_ids(ids)) == ids
    assert decode_ids("2-", {"r": 7, "d": 4}) == ids


def test_a_document_of_an_older_format_is_brought_up_step_by_step(monkeypatch: pytest.MonkeyPatch) -> None:
    newest = encode_map(SemanticMap(GridFrame(0.05, 2, 3)))
    oldest = {key: value for key, value in newest.items() if key not in ("walls", "clutter")} | {"format": 1}
    monkeypatch.setattr(stored, "FORMAT", 3)
    monkeypatch.setattr(stored, "UPGRADES", (lambda d: d | {"walls": []}, lambda d: d | {"clutter": []}))
    assert decode_map(oldest) == decode_map(newest | {"format": 3})
    assert decode_map(newest | {"format": 2}).clutter == ()


@pytest.mark.parametrize("written", [0, stored.FORMAT + 1, 99])
def test_a_document_of_a_format_that_is_not_known_is_refused(written: int) -> None:
    document = encode_map(SemanticMap(GridFrame(0.05, 2, 3))) | {"format": written}
    with pytest.raises(ValueError, match="format"):
        decode_map(document)


def test_there_is_a_step_for_every_format_but_the_newest() -> None:
    assert len(stored.UPGRADES) == stored.FORMAT - 1


def test_the_format_that_was_written_first_is_read_for_ever() -> None:
    """Never change this document: databases hold such ones."""
    document = {
        "format": 1,
        "frame": {"resolution": 0.05, "width": 200, "height": 120, "origin": [-1.0, -2.0, 0.0]},
        "rooms": [
            {
                "id": "r1",
                "name": "Kitchen",
                "segment_id": 1,
                "polygon": [[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 0.0]]],
                "made_by": "algorithm",
                "named_by": "user",
                "derived_from": None,
                "last_visited": "17",
                "pinned": False,
            }
        ],
        "dividers": [
            {"id": "d1", "line": [[0.0, 0.0], [0.0, 1.0]], "kind": "door", "made_by": "user", "rooms": ["r1"]}
        ],
        "walls": [{"id": "w1", "line": [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], "kind": "wall"}],
        "clutter": [{"id": "k1", "polygon": [[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 1.0]]]}],
        "restrictions": [{"id": "z1", "kind": "virtual_wall", "shape": [[0.0, 0.0], [1.0, 1.0]], "placed": True}],
        "meta_occupancy": [
            {"id": "o1", "polygon": [[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 1.0]]], "cell": "free", "since": "16"}
        ],
        "meta_dividers": [{"id": "m1", "line": [[0.0, 0.0], [0.0, 1.0]], "rooms": ["r1"], "since": "16"}],
    }
    semantic_map = decode_map(document)
    assert semantic_map.rooms[0].name == "Kitchen"
    assert (semantic_map.rooms[0].anchor, semantic_map.rooms[0].kind) == (None, None)
    assert semantic_map.phantoms == ()
    assert semantic_map.meta.dividers[0].since == "16"
    assert replace(semantic_map, ids=Ids()) == semantic_map
    assert json.loads(json.dumps(encode_map(semantic_map))) == stored.upgrade(document) | {"format": stored.FORMAT}
