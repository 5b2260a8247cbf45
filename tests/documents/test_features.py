"""A map as GeoJSON: what is sent of a stored one is what its contract says."""

import pytest
from hypothesis import given
from pydantic import TypeAdapter

from stillroom.documents.api import Frame
from stillroom.documents.features import features, frame, stored_map
from stillroom.documents.geojson import Feature
from stillroom.documents.stored import decode_map, encode_map, rings
from stillroom.maps.semantics import SemanticMap
from tests.documents.test_stored import maps

FEATURES = TypeAdapter(list[Feature])


@given(maps)
def test_a_stored_map_is_sent_as_the_contract_says(any_map: SemanticMap) -> None:
    sent = stored_map(encode_map(any_map))
    assert Frame.model_validate(sent["frame"]).model_dump(mode="json") == sent["frame"]
    assert Frame.model_validate(sent["frame"]) == frame(any_map.frame)
    plain = FEATURES.dump_python(FEATURES.validate_python(sent["features"]), mode="json")
    assert plain == sent["features"]
    assert FEATURES.dump_python(features(any_map), mode="json") == sent["features"]


@given(maps)
def test_features_have_the_shapes_of_the_map(any_map: SemanticMap) -> None:
    sent = stored_map(encode_map(any_map))["features"]
    of = {kind: [f for f in sent if f["properties"]["semantic"] == kind] for kind in ("room", "restriction", "wall")}
    for room, feature in zip(any_map.rooms, of["room"], strict=True):
        assert feature["geometry"] == {"type": "Polygon", "coordinates": rings(room.polygon)}
        assert feature["properties"]["area"] == pytest.approx(room.polygon.area, abs=1e-3)
    for wall, feature in zip(any_map.walls, of["wall"], strict=True):
        assert feature["geometry"] == {"type": "LineString", "coordinates": [list(p) for p in wall.line]}
    for restriction, feature in zip(any_map.restrictions, of["restriction"], strict=True):
        shape = [list(p) for p in restriction.shape]
        is_line = restriction.kind == "virtual_wall"
        assert feature["geometry"]["coordinates"] == (shape if is_line else [[*shape, shape[0]]])


def test_a_map_of_the_first_format_is_sent_like_any_other() -> None:
    first = {
        "format": 1,
        "frame": {"resolution": 0.05, "width": 4, "height": 4, "origin": [0, 0, 0]},
        "rooms": [
            {
                "id": "r1",
                "name": "Room 1",
                "segment_id": 1,
                "polygon": [[[0, 0], [1, 0], [1, 1], [0, 0]]],
                "made_by": "algorithm",
                "named_by": "algorithm",
                "derived_from": None,
                "last_visited": None,
                "pinned": False,
            }
        ],
        **{kind: [] for kind in ("dividers", "walls", "clutter", "restrictions", "meta_occupancy", "meta_dividers")},
    }
    (room,) = stored_map(first)["features"]
    assert (room["properties"]["kind"], room["properties"]["area"]) == (None, 0.5)
    assert FEATURES.dump_python(features(decode_map(first)), mode="json") == [room]
