"""The Map Meta layer (paper, Table II): corrections that explain where semantics and sensing differ. It can be dropped at any time."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from shapely import LineString, Polygon

from stillroom.maps.geometry import Line


@dataclass(frozen=True)
class MetaOccupancy:
    """A region that counts as occupied or free although the robot did not sense it so."""

    id: str
    polygon: Polygon
    cell: Literal["occupied", "free"]
    since: str
    """Id of the mission that first needed it."""
    contradicted: int = 0
    """In how many missions since then the robot sensed the opposite."""

    @property
    def shape(self) -> Polygon:
        return self.polygon


@dataclass(frozen=True)
class MetaDivider:
    """A divider that nobody annotated; ends on a wall or on another meta-divider."""

    id: str
    line: Line
    rooms: tuple[str, ...]
    since: str
    contradicted: int = 0
    """In how many missions since then the robot sensed free floor along it."""

    @property
    def shape(self) -> LineString:
        return LineString(self.line)


@dataclass(frozen=True)
class Declined:
    """A place where a person does not want a correction: none is made there again."""

    shape: Polygon | LineString
    until: str | None = None
    """The moment (RFC 3339) when one may be made again, for those who have a clock; None: never."""


@dataclass(frozen=True)
class MapMeta:
    occupancy: tuple[MetaOccupancy, ...] = ()
    dividers: tuple[MetaDivider, ...] = ()
    declined: tuple[Declined, ...] = ()

    EMPTY: ClassVar["MapMeta"]

    @property
    def corrects(self) -> bool:
        return bool(self.occupancy or self.dividers)


MapMeta.EMPTY = MapMeta()
