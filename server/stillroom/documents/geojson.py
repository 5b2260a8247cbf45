"""Features of a map as GeoJSON (RFC 7946, with coordinates in local metres by prior arrangement)."""

from typing import Literal

from pydantic import BaseModel, ConfigDict

from stillroom.maps.semantics import DividerKind, MadeBy, RestrictionKind, RoomKind, WallKind

Position = tuple[float, float]


class Document(BaseModel):
    model_config = ConfigDict(frozen=True)


class Polygon(Document):
    type: Literal["Polygon"] = "Polygon"
    coordinates: list[list[Position]]
    """Exterior ring first, then holes; each closed."""


class LineString(Document):
    type: Literal["LineString"] = "LineString"
    coordinates: list[Position]


class RoomProperties(Document):
    semantic: Literal["room"] = "room"
    name: str
    segment_id: int
    area: float
    """Square metres."""
    made_by: MadeBy
    derived_from: str | None
    last_visited: str | None
    """Id of the newest mission that saw it."""
    pinned: bool
    """It changes only when a person agrees."""
    kind: RoomKind | None
    """What it is used for, where a person said so."""


class DividerProperties(Document):
    semantic: Literal["divider"] = "divider"
    kind: DividerKind
    made_by: MadeBy
    rooms: list[str]


class WallProperties(Document):
    semantic: Literal["wall"] = "wall"
    kind: WallKind


class ClutterProperties(Document):
    semantic: Literal["clutter"] = "clutter"


class MetaDividerProperties(Document):
    semantic: Literal["meta_divider"] = "meta_divider"
    rooms: list[str]
    since: str
    """Id of the mission that first needed it."""


class MetaOccupancyProperties(Document):
    semantic: Literal["meta_occupancy"] = "meta_occupancy"
    cell: Literal["occupied", "free"]
    since: str


class RestrictionProperties(Document):
    semantic: Literal["restriction"] = "restriction"
    kind: RestrictionKind
    placement: Literal["placed", "unplaced"]


class PhantomProperties(Document):
    semantic: Literal["phantom"] = "phantom"


class _Feature(Document):
    type: Literal["Feature"] = "Feature"
    id: str


class RoomFeature(_Feature):
    geometry: Polygon
    properties: RoomProperties


class DividerFeature(_Feature):
    geometry: LineString
    properties: DividerProperties


class WallFeature(_Feature):
    geometry: LineString
    properties: WallProperties


class ClutterFeature(_Feature):
    geometry: Polygon
    properties: ClutterProperties


class MetaDividerFeature(_Feature):
    geometry: LineString
    properties: MetaDividerProperties


class MetaOccupancyFeature(_Feature):
    geometry: Polygon
    properties: MetaOccupancyProperties


class RestrictionFeature(_Feature):
    geometry: Polygon | LineString
    properties: RestrictionProperties


class PhantomFeature(_Feature):
    """Space that is not a real place: no floor in this or any later mission."""

    geometry: Polygon
    properties: PhantomProperties


Feature = (
    RoomFeature
    | DividerFeature
    | WallFeature
    | ClutterFeature
    | MetaDividerFeature
    | MetaOccupancyFeature
    | RestrictionFeature
    | PhantomFeature
)
