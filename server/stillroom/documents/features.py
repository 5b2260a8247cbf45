"""A semantic map as GeoJSON features (RFC 7946, local metres)."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from stillroom.documents import api, geojson
from stillroom.documents.stored import Json, Rings, encode_map, upgrade
from stillroom.maps.grid import GridFrame
from stillroom.maps.semantics import SemanticMap

Line = Sequence[Sequence[float]]

_MODELS: dict[str, type[geojson.Feature]] = {
    "room": geojson.RoomFeature,
    "divider": geojson.DividerFeature,
    "wall": geojson.WallFeature,
    "clutter": geojson.ClutterFeature,
    "meta_divider": geojson.MetaDividerFeature,
    "meta_occupancy": geojson.MetaOccupancyFeature,
    "restriction": geojson.RestrictionFeature,
    "phantom": geojson.PhantomFeature,
}


def frame(of: GridFrame) -> api.Frame:
    o = of.origin
    return api.Frame(resolution=of.resolution, width=of.width, height=of.height, origin=(o.x, o.y, o.yaw))


def features(m: SemanticMap) -> list[geojson.Feature]:
    return [_MODELS[one["properties"]["semantic"]].model_validate(one) for one in _features(encode_map(m))]


def stored_map(document: Json) -> Json:
    """`frame` and `features` of a stored map as they are sent: each robot asks for them before each mission, so that no shape is made
    on the way."""
    newest = upgrade(document)
    return {"frame": {"unit": "m"} | newest["frame"], "features": list(_features(newest))}


def segments(m: SemanticMap, group: str) -> list[api.Segment]:
    return [api.Segment(id=str(r.segment_id), name=r.name, group=group) for r in m.rooms]


def _features(d: Json) -> Iterator[Json]:
    """Of a document of the newest format."""
    for r in d["rooms"]:
        said = {name: r[name] for name in ("made_by", "derived_from", "last_visited", "pinned", "kind")}
        named = {"name": r["name"], "segment_id": r["segment_id"], "area": _area(r["polygon"])}
        yield _feature("room", r["id"], _polygon(r["polygon"]), **named, **said)
    for v in d["dividers"]:
        yield _feature("divider", v["id"], _line(v["line"]), kind=v["kind"], made_by=v["made_by"], rooms=v["rooms"])
    for w in d["walls"]:
        yield _feature("wall", w["id"], _line(w["line"]), kind=w["kind"])
    for c in d["clutter"]:
        yield _feature("clutter", c["id"], _polygon(c["polygon"]))
    for v in d["meta_dividers"]:
        yield _feature("meta_divider", v["id"], _line(v["line"]), rooms=v["rooms"], since=v["since"])
    for o in d["meta_occupancy"]:
        yield _feature("meta_occupancy", o["id"], _polygon(o["polygon"]), cell=o["cell"], since=o["since"])
    for r in d["restrictions"]:
        shape = _line(r["shape"]) if r["kind"] == "virtual_wall" else _ring(r["shape"])
        placement = "placed" if r["placed"] else "unplaced"
        yield _feature("restriction", r["id"], shape, kind=r["kind"], placement=placement)
    for p in d["phantoms"]:
        yield _feature("phantom", p["id"], _ring(p["shape"]))


def _feature(semantic: str, key: str, geometry: Json, **properties: Any) -> Json:
    return {
        "type": "Feature",
        "id": key,
        "geometry": geometry,
        "properties": {"semantic": semantic} | properties,
    }


def _line(points: Line) -> Json:
    return {"type": "LineString", "coordinates": points}


def _polygon(rings: Rings) -> Json:
    return {"type": "Polygon", "coordinates": rings}


def _ring(shape: Line) -> Json:
    """A ring whose first point is not repeated, closed."""
    return {"type": "Polygon", "coordinates": [[*shape, shape[0]]]}


def _area(rings: Rings) -> float:
    """Square metres."""
    outer, *holes = map(_inside, rings)
    return round(outer - sum(holes), 3)


def _inside(ring: Line) -> float:
    """Area within a closed ring, by triangles from its first point, which costs less than making a shape."""
    (x, y), *_ = ring
    twice = ((a - x) * (d - y) - (c - x) * (b - y) for (a, b), (c, d) in pairwise(ring))
    return abs(sum(twice, 0.0)) / 2
