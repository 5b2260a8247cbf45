"""What people may ask for: one frozen dataclass an operation. Coordinates are metres in the map's frame."""

from dataclasses import dataclass, field

from stillroom.maps.geometry import Line, Point
from stillroom.maps.semantics import DividerKind, RestrictionKind, RoomKind

Shape = tuple[Point, ...]
"""A line of two points, or a ring whose first point is not repeated."""
RoomRef = str | Point
"""A room by its id; or the one at a point once the whole batch is applied, for rooms that the batch itself makes."""


@dataclass(frozen=True)
class AddDivider:
    line: Line
    kind: DividerKind = "open"


@dataclass(frozen=True)
class MoveDivider:
    id: str
    line: Line


@dataclass(frozen=True)
class RemoveDivider:
    id: str


@dataclass(frozen=True)
class SetDividerKind:
    id: str
    kind: DividerKind


@dataclass(frozen=True)
class AcceptMetaDivider:
    """A meta-divider becomes a divider of the owner's own."""

    id: str


@dataclass(frozen=True)
class RenameRoom:
    room: RoomRef
    name: str


@dataclass(frozen=True)
class SetRoomKind:
    """`kind` None: nobody says what the room is used for."""

    room: RoomRef
    kind: RoomKind | None


@dataclass(frozen=True)
class PinRoom:
    """A pinned room changes only when a person agrees."""

    room: RoomRef
    pinned: bool = True


@dataclass(frozen=True)
class MergeRooms:
    ids: tuple[str, ...]


@dataclass(frozen=True)
class AddRestriction:
    kind: RestrictionKind
    shape: Shape


@dataclass(frozen=True)
class MoveRestriction:
    """Drawn anew: it is placed again where it was not."""

    id: str
    shape: Shape


@dataclass(frozen=True)
class RemoveRestriction:
    id: str


@dataclass(frozen=True)
class MarkPhantom:
    """What lies in `shape` is not a real place, and stays away in every later mission."""

    shape: Shape


@dataclass(frozen=True)
class RemovePhantom:
    """What lies there may be floor again as soon as a mission sees it."""

    id: str


Operation = (
    AddDivider
    | MoveDivider
    | RemoveDivider
    | SetDividerKind
    | AcceptMetaDivider
    | RenameRoom
    | SetRoomKind
    | PinRoom
    | MergeRooms
    | AddRestriction
    | MoveRestriction
    | RemoveRestriction
    | MarkPhantom
    | RemovePhantom
)


@dataclass(frozen=True)
class Fix:
    """What would mend a fault: do `operation` instead of the one at `pointer`, or besides all others where that is "/operations"."""

    pointer: str
    title: str
    operation: Operation


@dataclass(frozen=True)
class Problem:
    """Something an edit causes that its author should see. `code` is stable; `fix` says what would mend it, `operation` does."""

    code: str
    severity: str
    feature: str | None
    message: str
    fix: str | None = None
    operation: Operation | None = field(default=None)
