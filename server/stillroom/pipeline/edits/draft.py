"""A map while a batch of operations is applied to it, and what is checked of each operation by itself."""

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, MultiPolygon

from stillroom.errors import Fault, InvalidEdit
from stillroom.maps.geometry import Line, Point, Points, as_line, as_points, as_tuples
from stillroom.maps.grid import GridFrame
from stillroom.maps.meta import MetaDivider
from stillroom.maps.semantics import Divider, Ids, Phantom, Restriction, RestrictionKind, Room, SemanticMap
from stillroom.pipeline.edits.operations import Fix, RoomRef, Shape
from stillroom.pipeline.restrictions import faults_of

Gaps = npt.NDArray[np.float64]

LONGEST_NAME = 64
END_M = 0.01
"""A divider's end nearer than this to a wall or divider ends on it."""
CUT_BACK = "/operations"
"""Where the new line of a divider came from that a phantom cut back."""
JOINERS = "\u200c\u200d"
"""Characters that join letters and emoji: the only invisible ones in a name."""


@dataclass(frozen=True)
class Setting:
    """A property that a batch gives to a room; the last one counts."""

    pointer: str
    room: RoomRef
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Draft:
    """`drawn` holds where a divider's new line came from: a JSON pointer by divider id."""

    previous: SemanticMap
    dividers: tuple[Divider, ...]
    meta_dividers: tuple[MetaDivider, ...]
    restrictions: tuple[Restriction, ...]
    phantoms: tuple[Phantom, ...]
    ids: Ids
    drawn: Mapping[str, str] = field(default_factory=dict)
    settings: tuple[Setting, ...] = ()
    made: Mapping[str, str] = field(default_factory=dict)
    """JSON pointers of operations -> ids of the features that they made."""

    @staticmethod
    def of(previous: SemanticMap) -> "Draft":
        return Draft(
            previous, previous.dividers, previous.meta.dividers, previous.restrictions, previous.phantoms, previous.ids
        )

    def divider(self, pointer: str, divider_id: str) -> Divider:
        for divider in self.dividers:
            if divider.id == divider_id:
                return divider
        raise fault(f"{pointer}/id", f"There is no divider {divider_id}.")

    def room(self, pointer: str, room_id: str) -> Room:
        room = self.previous.room(room_id)
        if room is None:
            raise fault(pointer, f"There is no room {room_id}.")
        return room

    def put(self, divider: Divider) -> "Draft":
        """With one divider replaced."""
        return replace(self, dividers=tuple(divider if d.id == divider.id else d for d in self.dividers))

    def lines(self) -> list[Line]:
        """Everything that cuts the floor into rooms."""
        return [d.line for d in self.dividers] + [d.line for d in self.meta_dividers]

    def gaps(self, line: Line, divider_id: str, floor: MultiPolygon) -> Gaps:
        """Metres from both ends of a divider to the nearest wall or other divider, shape (2,)."""
        others = [d.line for d in self.dividers if d.id != divider_id]
        others += [d.line for d in self.meta_dividers if d.id != divider_id]
        barriers = shapely.GeometryCollection([shapely.boundary(floor), *map(LineString, others)])
        return np.asarray(shapely.distance(shapely.points(as_points(line)), barriers))


def fault(pointer: str, detail: str, fixes: Sequence[Fix] = ()) -> InvalidEdit:
    return faults((Fault(pointer, detail),), fixes)


def faults(found: Sequence[Fault], fixes: Sequence[Fix] = ()) -> InvalidEdit:
    extra = {"fixes": tuple(fixes)} if fixes else {}
    return InvalidEdit(found[0].detail, tuple(found), **extra)


def checked_line(pointer: str, line: Line) -> Line:
    points = as_points(line)
    if len(points) != 2 or not np.isfinite(points).all():
        raise fault(f"{pointer}/line", "A divider is a line of exactly two points.")
    if np.abs(points[1] - points[0]).max() < END_M:
        raise fault(f"{pointer}/line", "The two ends of the divider are the same point.")
    return as_line(points)


def checked_name(pointer: str, name: str) -> str:
    clean = unicodedata.normalize("NFC", name).strip()
    if not clean or len(clean) > LONGEST_NAME:
        raise fault(f"{pointer}/name", f"A name has 1 to {LONGEST_NAME} characters.")
    hidden = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")
    if any(unicodedata.category(c) in hidden and c not in JOINERS for c in clean):
        raise fault(f"{pointer}/name", "A name has no control characters.")
    return clean


def checked_shape(pointer: str, kind: RestrictionKind, shape: Shape, frame: GridFrame) -> tuple[Point, ...]:
    """A drawn line or ring, without a repeated first point."""
    points: Points = as_points(shape)
    if len(points) > 3 and (points[0] == points[-1]).all():
        points = points[:-1]
    wrong = faults_of(kind, points, frame)
    if wrong:
        raise fault(f"{pointer}/shape", wrong)
    return as_tuples(points)
