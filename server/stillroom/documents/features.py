"""A semantic map as GeoJSON features (RFC 7946, local metres)."""

from collections.abc import Sequence

from stillroom.documents import api, geojson
from stillroom.documents.stored import rings
from stillroom.maps.geometry import Point
from stillroom.maps.grid import GridFrame
from stillroom.maps.semantics import Phantom, Restriction, Room, SemanticMap


def frame(of: GridFrame) -> api.Frame:
    o = of.origin
    return api.Frame(resolution=of.resolution, width=of.width, height=of.height, origin=(o.x, o.y, o.yaw))


def features(m: SemanticMap) -> list[geojson.Feature]:
    dividers = [
        geojson.DividerFeature(
            id=d.id,
            geometry=_line(d.line),
            properties=geojson.DividerProperties(kind=d.kind, made_by=d.made_by, rooms=list(d.rooms)),
        )
        for d in m.dividers
    ]
    walls = [
        geojson.WallFeature(id=w.id, geometry=_line(w.line), properties=geojson.WallProperties(kind=w.kind))
        for w in m.walls
    ]
    clutter = [
        geojson.ClutterFeature(id=c.id, geometry=_polygon(rings(c.polygon)), properties=geojson.ClutterProperties())
        for c in m.clutter
    ]
    meta_dividers = [
        geojson.MetaDividerFeature(
            id=d.id,
            geometry=_line(d.line),
            properties=geojson.MetaDividerProperties(rooms=list(d.rooms), since=d.since),
        )
        for d in m.meta.dividers
    ]
    meta_occupancy = [
        geojson.MetaOccupancyFeature(
            id=o.id,
            geometry=_polygon(rings(o.polygon)),
            properties=geojson.MetaOccupancyProperties(cell=o.cell, since=o.since),
        )
        for o in m.meta.occupancy
    ]
    return [
        *map(room, m.rooms),
        *dividers,
        *walls,
        *clutter,
        *meta_dividers,
        *meta_occupancy,
        *map(_restriction, m.restrictions),
        *map(_phantom, m.phantoms),
    ]


def room(of: Room) -> geojson.RoomFeature:
    return geojson.RoomFeature(
        id=of.id,
        geometry=_polygon(rings(of.polygon)),
        properties=geojson.RoomProperties(
            name=of.name,
            segment_id=of.segment_id,
            area=round(of.polygon.area, 3),
            made_by=of.made_by,
            derived_from=of.derived_from,
            last_visited=of.last_visited,
            pinned=of.pinned,
            kind=of.kind,
        ),
    )


def segments(m: SemanticMap, group: str) -> list[api.Segment]:
    return [api.Segment(id=str(r.segment_id), name=r.name, group=group) for r in m.rooms]


def _phantom(of: Phantom) -> geojson.PhantomFeature:
    return geojson.PhantomFeature(id=of.id, geometry=_ring(of.shape), properties=geojson.PhantomProperties())


def _restriction(of: Restriction) -> geojson.RestrictionFeature:
    is_line = of.kind == "virtual_wall"
    return geojson.RestrictionFeature(
        id=of.id,
        geometry=_line(of.shape) if is_line else _ring(of.shape),
        properties=geojson.RestrictionProperties(kind=of.kind, placement="placed" if of.placed else "unplaced"),
    )


def _line(points: Sequence[Point]) -> geojson.LineString:
    return geojson.LineString(coordinates=list(points))


def _polygon(coordinates: list[list[list[float]]]) -> geojson.Polygon:
    return geojson.Polygon(coordinates=[[(x, y) for x, y in ring] for ring in coordinates])


def _ring(shape: Sequence[Point]) -> geojson.Polygon:
    """A ring whose first point is not repeated, closed."""
    return geojson.Polygon(coordinates=[[*shape, shape[0]]])
