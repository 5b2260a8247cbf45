"""The Map Meta layer (paper, Table II): corrections that explain where semantics and sensing differ. It can be dropped at any time."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from shapely import Polygon

from stillroom.maps.geometry import Line


@dataclass(frozen=True)
class MetaOccupancy:
    """A region that counts as occupied or free although the robot did not sense it so."""

    id: str
    polygon: Polygon
    cell: Literal["occupied", "free"]
    since: str
    """Id of the mission that first needed it."""


@dataclass(frozen=True)
class MetaDivider:
    """A divider that nobody annotated; ends on a wall or on another meta-divider."""

    id: str
    line: Line
    rooms: tuple[str, ...]
    since: str


@dataclass(frozen=True)
class MapMeta:
    occupancy: tuple[MetaOccupancy, ...] = ()
    dividers: tuple[MetaDivider, ...] = ()

    EMPTY: ClassVar["MapMeta"]


MapMeta.EMPTY = MapMeta()
