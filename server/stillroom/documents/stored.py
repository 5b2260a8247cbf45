"""Semantic maps at rest: one versioned document with upgrade steps, never a dump of our classes.

The newest format is described in docs/formats.md. To change it, count FORMAT up and add a step to UPGRADES; documents that
were written before are brought up when they are read.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import shapely
from shapely import LineString, Polygon

from stillroom.maps.geometry import Point, Pose, as_points
from stillroom.maps.grid import GridFrame
from stillroom.maps.meta import Declined, MapMeta, MetaDivider, MetaOccupancy
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Clutter, Divider, Ids, Phantom, Restriction, Room, SemanticMap, Wall

Json = dict[str, Any]
Rings = list[list[list[float]]]

FORMAT = 5


def _with_anchors(document: Json) -> Json:
    return document | {"rooms": [room | {"anchor": None} for room in document["rooms"]]}


def _with_kinds_and_phantoms(document: Json) -> Json:
    return document | {"rooms": [room | {"kind": None} for room in document["rooms"]], "phantoms": []}


def _with_declined_and_counts(document: Json) -> Json:
    counted = {kind: [{"contradicted": 0} | c for c in document[kind]] for kind in ("meta_occupancy", "meta_dividers")}
    return document | counted | {"declined": []}


def _with_shut_dividers(document: Json) -> Json:
    return document | {"dividers": [divider | {"shut": "never"} for divider in document["dividers"]]}


UPGRADES: tuple[Callable[[Json], Json], ...] = (
    _with_anchors,
    _with_kinds_and_phantoms,
    _with_declined_and_counts,
    _with_shut_dividers,
)
"""UPGRADES[n - 1] makes a document of format n one of format n + 1."""


def encode_map(semantic_map: SemanticMap) -> Json:
    """The map without its ids' counters, which belong to all its versions together."""
    m = semantic_map
    return {
        "format": FORMAT,
        "frame": {
            "resolution": m.frame.resolution,
            "width": m.frame.width,
            "height": m.frame.height,
            "origin": [m.frame.origin.x, m.frame.origin.y, m.frame.origin.yaw],
        },
        "rooms": [
            {
                "id": r.id,
                "name": r.name,
                "segment_id": r.segment_id,
                "polygon": rings(r.polygon),
                "made_by": r.made_by,
                "named_by": r.named_by,
                "derived_from": r.derived_from,
                "last_visited": r.last_visited,
                "pinned": r.pinned,
                "anchor": None if r.anchor is None else rings(r.anchor),
                "kind": r.kind,
            }
            for r in m.rooms
        ],
        "dividers": [
            {
                "id": d.id,
                "line": _line(d.line),
                "kind": d.kind,
                "made_by": d.made_by,
                "rooms": list(d.rooms),
                "shut": d.shut,
            }
            for d in m.dividers
        ],
        "walls": [{"id": w.id, "line": _line(w.line), "kind": w.kind} for w in m.walls],
        "clutter": [{"id": c.id, "polygon": rings(c.polygon)} for c in m.clutter],
        "restrictions": [
            {"id": r.id, "kind": r.kind, "shape": _line(r.shape), "placed": r.placed} for r in m.restrictions
        ],
        "meta_occupancy": [
            {"id": o.id, "polygon": rings(o.polygon), "cell": o.cell, "since": o.since, "contradicted": o.contradicted}
            for o in m.meta.occupancy
        ],
        "meta_dividers": [
            {
                "id": d.id,
                "line": _line(d.line),
                "rooms": list(d.rooms),
                "since": d.since,
                "contradicted": d.contradicted,
            }
            for d in m.meta.dividers
        ],
        "declined": [{"shape": _shape(d.shape), "until": d.until} for d in m.meta.declined],
        "phantoms": [{"id": p.id, "shape": _line(p.shape)} for p in m.phantoms],
    }


def decode_map(document: Json, ids: Ids = Ids()) -> SemanticMap:
    """Raises ValueError for a format of a newer program."""
    d = upgrade(document)
    frame, rooms = d["frame"], d["rooms"]
    polygons = iter(_polygons([one["polygon"] for kind in ("rooms", "clutter", "meta_occupancy") for one in d[kind]]))
    anchors = iter(_polygons([room["anchor"] for room in rooms if room["anchor"] is not None]))
    return SemanticMap(
        frame=GridFrame(frame["resolution"], frame["width"], frame["height"], Pose(*frame["origin"])),
        rooms=tuple(
            Room(**r | {"polygon": next(polygons), "anchor": None if r["anchor"] is None else next(anchors)})
            for r in rooms
        ),
        dividers=tuple(
            Divider(v["id"], _segment(v["line"]), v["kind"], v["made_by"], tuple(v["rooms"]), v["shut"])
            for v in d["dividers"]
        ),
        walls=tuple(Wall(w["id"], _points(w["line"]), w["kind"]) for w in d["walls"]),
        clutter=tuple(Clutter(c["id"], next(polygons)) for c in d["clutter"]),
        restrictions=tuple(
            Restriction(r["id"], r["kind"], _points(r["shape"]), r["placed"]) for r in d["restrictions"]
        ),
        meta=MapMeta(
            tuple(MetaOccupancy(**o | {"polygon": next(polygons)}) for o in d["meta_occupancy"]),
            tuple(
                MetaDivider(v["id"], _segment(v["line"]), tuple(v["rooms"]), v["since"], v["contradicted"])
                for v in d["meta_dividers"]
            ),
            tuple(Declined(_geometry(v["shape"]), v["until"]) for v in d["declined"]),
        ),
        phantoms=tuple(Phantom(p["id"], _points(p["shape"])) for p in d["phantoms"]),
        ids=ids,
    )


def upgrade(document: Json) -> Json:
    """A document of any known format in the newest one."""
    written = document["format"]
    if not 1 <= written <= FORMAT:
        raise ValueError(f"document format {written}; this program reads up to {FORMAT}")
    for step in UPGRADES[written - 1 :]:
        document = step(document)
    return document


def encode_motion(motion: Motion | None) -> Json | None:
    """By its control points; None: nothing moved."""
    if motion is None or not len(motion.source):
        return None
    return {"source": motion.source.tolist(), "target": motion.target.tolist()}


def decode_motion(document: Json | None) -> Motion | None:
    return None if document is None else Motion(as_points(document["source"]), as_points(document["target"]))


def encode_ids(ids: Ids) -> Json:
    return dict(ids.used)


def decode_ids(prefix: str, used: Json) -> Ids:
    return Ids(prefix, tuple(sorted(used.items())))


def rings(polygon: Polygon) -> Rings:
    """Exterior first, then holes; each closed, as GeoJSON has them."""
    if not shapely.get_num_interior_rings(polygon):  # as most, and several times as fast
        return [shapely.get_coordinates(polygon).tolist()]
    return [shapely.get_coordinates(ring).tolist() for ring in (polygon.exterior, *polygon.interiors)]


def _polygons(many: Sequence[Rings]) -> list[Polygon]:
    """All at once, several times as fast as one by one."""
    rings = [ring for polygon in many for ring in polygon]
    if not all(rings):  # of a polygon that is empty
        return [Polygon(shell, holes) for shell, *holes in many]
    points = np.array([point for ring in rings for point in ring], np.float64).reshape(-1, 2)
    lines = shapely.linearrings(points, indices=np.repeat(np.arange(len(rings)), [len(ring) for ring in rings]))
    made: list[Polygon] = shapely.polygons(
        lines, indices=np.repeat(np.arange(len(many)), [len(polygon) for polygon in many])
    ).tolist()
    return made


def _shape(shape: Polygon | LineString) -> Rings | list[list[float]]:
    """A line as its points, a polygon as its rings."""
    return rings(shape) if isinstance(shape, Polygon) else np.asarray(shape.coords)[:, :2].tolist()


def _geometry(coordinates: Any) -> Polygon | LineString:
    is_line = isinstance(coordinates[0][0], float | int)
    return LineString(coordinates) if is_line else Polygon(coordinates[0], coordinates[1:])


def _line(line: tuple[Point, ...]) -> list[list[float]]:
    return [list(point) for point in line]


def _points(line: list[list[float]]) -> tuple[Point, ...]:
    return tuple([(x, y) for x, y in line])


def _segment(line: list[list[float]]) -> tuple[Point, Point]:
    start, end = _points(line)
    return start, end
