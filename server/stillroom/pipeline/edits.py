"""What people may do to a map, as pure actions: a map and a list of operations in, a new map or `InvalidEdit` out."""

import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, MultiPolygon, Polygon

from stillroom.errors import Fault, InvalidEdit
from stillroom.maps.geometry import GRID_M, Line, Point, as_line, as_points, as_tuples
from stillroom.maps.semantics import Divider, DividerKind, Ids, Restriction, RestrictionKind, Room, SemanticMap
from stillroom.pipeline.dividers import Adrift, attach
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.restrictions import faults_of
from stillroom.pipeline.rooms import floor_of, new_rooms, overlaps, partition, rooms_beside

Gaps = npt.NDArray[np.float64]

MOST_OPERATIONS = 500
LONGEST_NAME = 64
SMALL_ROOM_M2 = 1.0
END_M = 0.01
"""A divider's end nearer than this to a wall or divider ends on it."""


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
class RenameRoom:
    id: str
    name: str


@dataclass(frozen=True)
class MergeRooms:
    ids: tuple[str, ...]


@dataclass(frozen=True)
class AddRestriction:
    kind: RestrictionKind
    shape: tuple[Point, ...]


@dataclass(frozen=True)
class RemoveRestriction:
    id: str


Operation = (
    AddDivider
    | MoveDivider
    | RemoveDivider
    | SetDividerKind
    | RenameRoom
    | MergeRooms
    | AddRestriction
    | RemoveRestriction
)


@dataclass(frozen=True)
class Problem:
    """Something an edit causes that its author should see. `code` is stable; `fix` says what would mend it."""

    code: str
    severity: str
    feature: str | None
    message: str
    fix: str | None = None


@dataclass(frozen=True)
class EditResult:
    map: SemanticMap
    retired: Mapping[str, str] = field(default_factory=dict)
    """Ids of rooms that ended -> the room that has their space now."""
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True)
class _Draft:
    """A map being edited. `drawn` holds where a divider's new line came from: a JSON pointer by divider id."""

    previous: SemanticMap
    dividers: tuple[Divider, ...]
    restrictions: tuple[Restriction, ...]
    ids: Ids
    names: Mapping[str, str] = field(default_factory=dict)
    drawn: Mapping[str, str] = field(default_factory=dict)

    def divider(self, pointer: str, divider_id: str) -> Divider:
        for divider in self.dividers:
            if divider.id == divider_id:
                return divider
        raise _fault(f"{pointer}/id", f"There is no divider {divider_id}.")

    def room(self, pointer: str, room_id: str) -> Room:
        room = self.previous.room(room_id)
        if room is None:
            raise _fault(pointer, f"There is no room {room_id}.")
        return room

    def put(self, divider: Divider) -> "_Draft":
        """With one divider replaced."""
        return replace(self, dividers=tuple(divider if d.id == divider.id else d for d in self.dividers))


def _fault(pointer: str, detail: str) -> InvalidEdit:
    return InvalidEdit(detail, (Fault(pointer, detail),))


def apply_edits(previous: SemanticMap, operations: Sequence[Operation], params: Params = PARAMS) -> EditResult:
    """All operations or none, judged as a whole.

    Raises InvalidEdit with a JSON pointer into {"operations": [...]} for what can't be applied.
    """
    if not 1 <= len(operations) <= MOST_OPERATIONS:
        raise _fault("/operations", f"A batch holds 1 to {MOST_OPERATIONS} operations, this one {len(operations)}.")
    draft = _Draft(previous, previous.dividers, previous.restrictions, previous.ids)
    for index, operation in enumerate(operations):
        draft = _apply(draft, f"/operations/{index}", operation)
    floor = floor_of(previous.rooms)
    draft = _attach_drawn(draft, floor, params)
    _check_untouched(draft, floor)
    lines = [d.line for d in draft.dividers]
    meta_lines = [d.line for d in previous.meta.dividers]
    pieces = partition(floor, lines + meta_lines, params.face_area_m2)
    rooms, retired, ids = _match(previous.rooms, pieces, draft.ids)
    rooms = _named(rooms, draft.names, retired)
    edited = replace(
        previous, rooms=rooms, dividers=_with_rooms(draft.dividers, rooms), restrictions=draft.restrictions, ids=ids
    )
    return EditResult(edited, retired, tuple(_problems(previous, edited)))


# -- operations ----------------------------------------------------------------------------------------------------


def _apply(draft: _Draft, pointer: str, operation: Operation) -> _Draft:
    match operation:
        case AddDivider(line, kind):
            (fresh,), ids = draft.ids.take("d")
            divider = Divider(fresh, _line(pointer, line), kind, "user")
            return replace(draft, dividers=(*draft.dividers, divider), ids=ids, drawn={**draft.drawn, fresh: pointer})
        case MoveDivider(divider_id, line):
            moved = replace(draft.divider(pointer, divider_id), line=_line(pointer, line), made_by="user")
            return replace(draft.put(moved), drawn={**draft.drawn, divider_id: pointer})
        case RemoveDivider(divider_id):
            gone = draft.divider(pointer, divider_id)
            kept = tuple(d for d in draft.dividers if d is not gone)
            return replace(draft, dividers=kept, drawn={d: p for d, p in draft.drawn.items() if d != divider_id})
        case SetDividerKind(divider_id, kind):
            return draft.put(replace(draft.divider(pointer, divider_id), kind=kind, made_by="user"))
        case RenameRoom(room_id, name):
            draft.room(f"{pointer}/id", room_id)
            return replace(draft, names={**draft.names, room_id: _name(pointer, name)})
        case MergeRooms(room_ids):
            return _merge(draft, pointer, room_ids)
        case AddRestriction(kind, shape):
            return _add_restriction(draft, pointer, kind, shape)
        case RemoveRestriction(restriction_id):
            kept_zones = tuple(r for r in draft.restrictions if r.id != restriction_id)
            if len(kept_zones) == len(draft.restrictions):
                raise _fault(f"{pointer}/id", f"There is no restriction {restriction_id}.")
            return replace(draft, restrictions=kept_zones)


def _add_restriction(draft: _Draft, pointer: str, kind: RestrictionKind, shape: Sequence[Point]) -> _Draft:
    points = as_points(shape)
    if len(points) > 3 and (points[0] == points[-1]).all():
        points = points[:-1]
    wrong = faults_of(kind, points, draft.previous.frame)
    if wrong:
        raise _fault(f"{pointer}/shape", wrong)
    (fresh,), ids = draft.ids.take("z")
    return replace(draft, ids=ids, restrictions=(*draft.restrictions, Restriction(fresh, kind, as_tuples(points))))


def _line(pointer: str, line: Line) -> Line:
    points = as_points(line)
    if len(points) != 2 or not np.isfinite(points).all():
        raise _fault(f"{pointer}/line", "A divider is a line of exactly two points.")
    if np.abs(points[1] - points[0]).max() < END_M:
        raise _fault(f"{pointer}/line", "The two ends of the divider are the same point.")
    return as_line(points)


def _name(pointer: str, name: str) -> str:
    clean = unicodedata.normalize("NFC", name).strip()
    if not clean or len(clean) > LONGEST_NAME:
        raise _fault(f"{pointer}/name", f"A name has 1 to {LONGEST_NAME} characters.")
    if any(unicodedata.category(c) in ("Cc", "Cs", "Co", "Cn", "Zl", "Zp") for c in clean):
        raise _fault(f"{pointer}/name", "A name has no control characters.")
    return clean


def _merge(draft: _Draft, pointer: str, room_ids: Sequence[str]) -> _Draft:
    """Takes away what divides the rooms from each other; a divider that goes on along other rooms keeps that part."""
    rooms = [draft.room(f"{pointer}/ids/{i}", room_id) for i, room_id in enumerate(room_ids)]
    if len(set(room_ids)) < 2:
        raise _fault(f"{pointer}/ids", "Merging takes at least two rooms.")
    union = shapely.union_all([room.polygon for room in rooms], grid_size=GRID_M)
    if shapely.get_num_geometries(union) > 1:
        raise _fault(f"{pointer}/ids", "Rooms that don't touch can't be merged.")
    polygons = [room.polygon for room in draft.previous.rooms]
    merged = {i for i, room in enumerate(draft.previous.rooms) if room.id in set(room_ids)}
    kept: list[Divider] = []
    ids = draft.ids
    for divider in draft.dividers:
        segments = _segments(divider.line, polygons)
        beside = rooms_beside(segments, polygons)
        staying = [
            s for s, sides in zip(segments, beside, strict=True) if not (len(sides) > 1 and set(sides) <= merged)
        ]
        if len(staying) == len(segments):
            kept.append(divider)
            continue
        parts = sorted(_joined(staying), key=lambda part: -LineString(part).length)
        for n, part in enumerate(parts):
            name = divider.id
            if n:
                (name,), ids = ids.take("d")
            kept.append(replace(divider, id=name, line=part))
    return replace(draft, dividers=tuple(kept), ids=ids)


def _segments(line: Line, polygons: Sequence[Polygon]) -> list[Line]:
    """A divider cut at every corner of a room that lies on it."""
    ends = as_points(line)
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    along = along / length
    corners = shapely.get_coordinates(polygons) - ends[0]
    station, aside = corners @ along, corners @ np.array([-along[1], along[0]])
    on = station[(np.abs(aside) < END_M) & (station > END_M) & (station < length - END_M)]
    stops = np.unique(np.round(np.concatenate([[0.0, length], on]), 3))
    points = [(float(x), float(y)) for x, y in ends[0] + stops[:, None] * along]
    points[0], points[-1] = line
    return list(pairwise(points))


def _joined(segments: Sequence[Line]) -> list[Line]:
    """Consecutive segments of one line made one again."""
    parts: list[Line] = []
    for segment in segments:
        if parts and parts[-1][1] == segment[0]:
            parts[-1] = (parts[-1][0], segment[1])
        else:
            parts.append(segment)
    return parts


# -- dividers ------------------------------------------------------------------------------------------------------


def _attach_drawn(draft: _Draft, floor: MultiPolygon, params: Params) -> _Draft:
    """Gives new and moved dividers their ends. One that ends on another new one is tried again after that."""
    waiting = list(draft.drawn.items())
    settled = {d.id: d.line for d in draft.dividers if d.id not in draft.drawn}
    faults: list[Fault] = []
    while waiting:
        adrift: list[tuple[str, str, Adrift]] = []
        for divider_id, pointer in waiting:
            divider = draft.divider(pointer, divider_id)
            found = attach(divider.line, floor, list(settled.values()), params.divider_reach_m)
            if isinstance(found, Adrift):
                adrift.append((divider_id, pointer, found))
            else:
                settled[divider_id] = found.line
                draft = draft.put(replace(divider, line=found.line))
        if len(adrift) == len(waiting):
            faults = [
                Fault(f"{pointer}/line/{found.end}", _adrift(draft.divider(pointer, d), found, params))
                for d, pointer, found in adrift
            ]
            break
        waiting = [(divider_id, pointer) for divider_id, pointer, _ in adrift]
    if faults:
        raise InvalidEdit(faults[0].detail, tuple(faults))
    return draft


def _adrift(divider: Divider, found: Adrift, params: Params) -> str:
    which = ("first", "second")[found.end]
    x, y = divider.line[found.end]
    if found.gap_m <= params.divider_reach_m:
        return f"Nothing of the divider lies on the floor between two walls (its {which} end is at ({x:.2f}, {y:.2f}))."
    return (
        f"The {which} end of the divider, at ({x:.2f}, {y:.2f}), is {found.gap_m:.2f} m from the nearest wall or divider; "
        f"{params.divider_reach_m:.2f} m is the most."
    )


def _check_untouched(draft: _Draft, floor: MultiPolygon) -> None:
    """Raises where a divider that was not touched has lost what it ended on."""
    faults = []
    for divider in draft.dividers:
        if divider.id in draft.drawn:
            continue
        before = _gaps(divider, draft.previous.dividers, draft.previous, floor)
        if ((_gaps(divider, draft.dividers, draft.previous, floor) > END_M) & (before <= END_M)).any():
            faults.append(
                Fault("/operations", f"The divider {divider.id} would end in mid-air: move or remove it too.")
            )
    if faults:
        raise InvalidEdit(faults[0].detail, tuple(faults))


def _gaps(divider: Divider, among: Sequence[Divider], semantic_map: SemanticMap, floor: MultiPolygon) -> Gaps:
    """Metres from both ends of a divider to the nearest wall or other divider, shape (2,)."""
    others = [d.line for d in among if d.id != divider.id] + [d.line for d in semantic_map.meta.dividers]
    barriers = shapely.GeometryCollection([shapely.boundary(floor), *map(LineString, others)])
    return np.asarray(shapely.distance(shapely.points(as_points(divider.line)), barriers))


def _with_rooms(dividers: Sequence[Divider], rooms: Sequence[Room]) -> tuple[Divider, ...]:
    beside = rooms_beside([d.line for d in dividers], [room.polygon for room in rooms])
    return tuple(replace(d, rooms=tuple(rooms[i].id for i in sides)) for d, sides in zip(dividers, beside, strict=True))


# -- rooms ---------------------------------------------------------------------------------------------------------


def _match(
    previous: Sequence[Room], pieces: Sequence[Polygon], ids: Ids
) -> tuple[tuple[Room, ...], dict[str, str], Ids]:
    """Rooms of the new pieces. The larger part of a split keeps the id, the larger room of a merger does."""
    common = overlaps([room.polygon for room in previous], pieces)
    goes_to = common.argmax(1)
    rooms: list[Room] = []
    retired: dict[str, str] = {}
    for i, room in enumerate(previous):
        piece = int(goes_to[i])
        merged = [k for k in range(len(previous)) if goes_to[k] == piece]
        survivor = max(merged, key=lambda k: (common[k, piece], -k))
        if survivor != i:
            retired[room.id] = previous[survivor].id
            continue
        name, named_by = room.name, room.named_by
        if named_by == "algorithm":
            by_person = [k for k in merged if previous[k].named_by == "user"]
            if by_person:
                best = max(by_person, key=lambda k: common[k, piece])
                name, named_by = previous[best].name, "user"
        rooms.append(replace(room, polygon=_same_or(room.polygon, pieces[piece]), name=name, named_by=named_by))
    for piece in sorted(set(range(len(pieces))) - set(goes_to.tolist())):
        (fresh,), ids = new_rooms([pieces[piece]], None, ids)
        parent = previous[int(common[:, piece].argmax())]
        name = (
            _second_name(parent, (room.name for room in (*previous, *rooms)))
            if parent.named_by == "user"
            else fresh.name
        )
        rooms.append(
            replace(fresh, name=name, made_by="user", derived_from=parent.id, last_visited=parent.last_visited)
        )
    return tuple(rooms), retired, ids


def _same_or(before: Polygon, after: Polygon) -> Polygon:
    """The polygon as it was where nothing changed, so that its vertices keep their order."""
    return before if before.normalize().equals_exact(after.normalize(), 1e-6) else after


def _second_name(parent: Room, taken: Iterable[str]) -> str:
    """A name for the smaller part of a split room: "Kitchen 2"."""
    used = set(taken)
    number = 2
    while f"{parent.name} {number}" in used:
        number += 1
    return f"{parent.name} {number}"


def _named(rooms: Sequence[Room], names: Mapping[str, str], retired: Mapping[str, str]) -> tuple[Room, ...]:
    given = {retired.get(room_id, room_id): name for room_id, name in names.items()}
    given |= {room_id: name for room_id, name in names.items() if room_id not in retired}
    return tuple(replace(room, name=given[room.id], named_by="user") if room.id in given else room for room in rooms)


def _problems(previous: SemanticMap, edited: SemanticMap) -> Iterable[Problem]:
    """What the edit causes that was not so before."""
    for divider in edited.dividers:
        before = previous.divider(divider.id)
        if len(divider.rooms) < 2 and (before is None or len(before.rooms) >= 2):
            yield Problem(
                "separates-nothing",
                "warning",
                divider.id,
                f"The divider {divider.id} has the same room on both sides.",
                "extend or remove it",
            )
    for room in edited.rooms:
        before_room = previous.room(room.id)
        if room.polygon.area < SMALL_ROOM_M2 and (before_room is None or before_room.polygon.area >= SMALL_ROOM_M2):
            yield Problem("small-room", "warning", room.id, f"{room.name} has only {room.polygon.area:.1f} m².")
        twins = [other.id for other in edited.rooms if other.name == room.name and other.id < room.id]
        if twins and (before_room is None or before_room.name != room.name):
            yield Problem("same-name", "warning", room.id, f"There is another room called {room.name}.")
