"""Three-way merge by feature: what one person asked of an older map, done to the map as others have changed it since.

Whatever only one side touched is taken from that side. Where both touched the same property of the same feature and want different
things, the operation clashes, and nobody but a person can say who is right. Missions touch nothing: people own semantics.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import LineString, Polygon

from stillroom.errors import Fault, InvalidEdit
from stillroom.maps.geometry import Line, Point, as_line, as_points, as_tuples, fit_pose
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.edits.applying import EditResult, apply_edits
from stillroom.pipeline.edits.operations import (
    AcceptMetaDivider,
    AddDivider,
    AddRestriction,
    MarkPhantom,
    MergeRooms,
    MoveDivider,
    MoveRestriction,
    Operation,
    PinRoom,
    RemoveDivider,
    RemovePhantom,
    RemoveRestriction,
    RenameRoom,
    RoomRef,
    SetDividerKind,
    SetRoomKind,
    Shape,
)
from stillroom.pipeline.params import PARAMS, Params

Touch = tuple[str, str]
"""(id of a feature, which of its properties)."""
MOVED_M = 0.002
CROSSED_M = 0.05
"""A divider cuts a room where more than this much of it lies there."""


@dataclass(frozen=True)
class Clash:
    """An operation that the map as it is now speaks against."""

    pointer: str
    feature: str | None
    detail: str
    operation: Operation | None = None
    """What to ask of the current map to have it one's own way; None where there is nothing left to ask it of."""


@dataclass(frozen=True)
class Rebased:
    """`operations`: what remains to be asked of the current map; `result`: what that comes to, None where something clashes."""

    operations: tuple[Operation, ...]
    clashes: tuple[Clash, ...]
    result: EditResult | None


def touched(before: SemanticMap, after: SemanticMap, same_grid: bool = True) -> frozenset[Touch]:
    """What a person changed between two versions. On another grid every line and shape counts as changed."""
    return frozenset(
        {(d, p) for d, p in _lines_touched(before, after, same_grid)}
        | {(r, p) for r, p in _rooms_touched(before, after, same_grid)}
        | {(z, p) for z, p in _shapes_touched(before, after, same_grid)}
    )


def _lines_touched(before: SemanticMap, after: SemanticMap, same_grid: bool) -> set[Touch]:
    old, new = {d.id: d for d in before.dividers}, {d.id: d for d in after.dividers}
    found = {(name, "exists") for name in old.keys() ^ new.keys()}
    for name in old.keys() & new.keys():
        apart = np.abs(as_points(old[name].line) - as_points(new[name].line)).max()
        if not same_grid or apart > MOVED_M:
            found.add((name, "line"))
        if old[name].kind != new[name].kind:
            found.add((name, "kind"))
    return found


def _rooms_touched(before: SemanticMap, after: SemanticMap, same_grid: bool) -> set[Touch]:
    old, new = {r.id: r for r in before.rooms}, {r.id: r for r in after.rooms}
    found = {(name, "exists") for name in old.keys() ^ new.keys()}
    for name in old.keys() & new.keys():
        a, b = old[name], new[name]
        if not same_grid or not a.polygon.normalize().equals_exact(b.polygon.normalize(), MOVED_M):
            found.add((name, "shape"))
        found |= {(name, p) for p in ("name", "kind", "pinned") if getattr(a, p) != getattr(b, p)}
    return found


def _shapes_touched(before: SemanticMap, after: SemanticMap, same_grid: bool) -> set[Touch]:
    old = {r.id: r.shape for r in before.restrictions} | {p.id: p.shape for p in before.phantoms}
    new = {r.id: r.shape for r in after.restrictions} | {p.id: p.shape for p in after.phantoms}
    found = {(name, "exists") for name in old.keys() ^ new.keys()}
    return found | {(name, "shape") for name in old.keys() & new.keys() if not same_grid or old[name] != new[name]}


def rebase(
    base: SemanticMap,
    current: SemanticMap,
    operations: Sequence[Operation],
    motion: Motion,
    theirs: Collection[Touch],
    params: Params = PARAMS,
) -> Rebased:
    """`operations` were asked of `base`; `motion` takes its frame to that of `current`; `theirs`: what people touched in between."""
    merge = _Merge(base, current, motion, theirs)
    kept: list[tuple[int, Operation]] = []
    clashes: list[Clash] = []
    for index, operation in enumerate(operations):
        found = merge.carried(operation, f"/operations/{index}")
        if isinstance(found, Clash):
            clashes.append(replace(found, operation=merge.forced(operation)))
        elif found is not None:
            kept.append((index, found))
    remaining = tuple(operation for _, operation in kept)
    if clashes:
        return Rebased(remaining, tuple(clashes), None)
    if not remaining:
        return Rebased((), (), EditResult(current))
    try:
        return Rebased(remaining, (), apply_edits(current, remaining, params))
    except InvalidEdit as refused:
        return Rebased(remaining, tuple(_clash(fault, [index for index, _ in kept]) for fault in refused.faults), None)


def _clash(fault: Fault, indices: Sequence[int]) -> Clash:
    """A fault of the remaining operations, with the pointer that the operation had before."""
    parts = fault.pointer.split("/")
    if len(parts) > 2 and parts[2].isdecimal():
        parts[2] = str(indices[int(parts[2])])
    return Clash("/".join(parts), None, fault.detail)


@dataclass(frozen=True)
class _Merge:
    base: SemanticMap
    current: SemanticMap
    motion: Motion
    theirs: Collection[Touch]

    def carried(self, operation: Operation, pointer: str) -> Operation | Clash | None:
        """The operation in the current frame; None where others have done the same already."""
        match operation:
            case RenameRoom(room, name):
                return self._set(operation, pointer, room, "name", name)
            case SetRoomKind(room, kind):
                return self._set(operation, pointer, room, "kind", kind)
            case PinRoom(room, pinned):
                return self._set(operation, pointer, room, "pinned", pinned)
            case MergeRooms(ids):
                return self._merge(operation, pointer, ids)
            case AddDivider() | MoveDivider() | RemoveDivider() | SetDividerKind() | AcceptMetaDivider():
                return self._divider(operation, pointer)
            case AddRestriction(kind, shape):
                return AddRestriction(kind, self._shape(shape))
            case MarkPhantom(shape):
                return MarkPhantom(self._shape(shape))
            case MoveRestriction() | RemoveRestriction() | RemovePhantom():
                return self._zone(operation, pointer)

    def forced(self, operation: Operation) -> Operation | None:
        """The operation in the current frame, whatever others have done; None where what it is about is not there any more."""
        match operation:
            case RenameRoom(str(room)) | SetRoomKind(str(room)) | PinRoom(str(room)):
                return operation if self.current.room(room) else None
            case MergeRooms(ids):
                return operation if all(self.current.room(room_id) for room_id in ids) else None
            case AddDivider(line):
                return replace(operation, line=self._line(line))
            case MoveDivider(divider_id, line):
                return replace(operation, line=self._line(line)) if self.current.divider(divider_id) else None
            case RemoveDivider(divider_id) | SetDividerKind(divider_id):
                return operation if self.current.divider(divider_id) else None
            case MoveRestriction(restriction_id, shape):
                there = any(r.id == restriction_id for r in self.current.restrictions)
                return replace(operation, shape=self._shape(shape)) if there else None
            case _:
                return None

    def _set(
        self, operation: RenameRoom | SetRoomKind | PinRoom, pointer: str, room: RoomRef, of: str, wanted: object
    ) -> Operation | Clash | None:
        if not isinstance(room, str):
            return replace(operation, room=self._points([room])[0])
        now = self.current.room(room)
        if now is None:
            return Clash(pointer, room, f"{self._name(room)} is not there any more.")
        if (room, of) not in self.theirs:
            return operation
        if getattr(now, of) == wanted:
            return None
        said = {"name": f"named “{now.name}”", "kind": "given another kind", "pinned": "pinned or unpinned"}[of]
        return Clash(pointer, room, f"{self._name(room)} was {said} by somebody else meanwhile.")

    def _merge(self, operation: MergeRooms, pointer: str, ids: Sequence[str]) -> Operation | Clash | None:
        there = [self._successor(room_id) for room_id in ids]
        if len(set(there)) == 1 and there[0] is not None:
            return None
        for room_id in ids:
            if self.current.room(room_id) is None:
                return Clash(pointer, room_id, f"{self._name(room_id)} is not there any more.")
            if (room_id, "shape") in self.theirs:
                return Clash(pointer, room_id, f"{self._name(room_id)} was changed by somebody else meanwhile.")
        return operation

    def _divider(
        self,
        operation: AddDivider | MoveDivider | RemoveDivider | SetDividerKind | AcceptMetaDivider,
        pointer: str,
    ) -> Operation | Clash | None:
        if isinstance(operation, AddDivider):
            changed = self._rooms_changed_under(operation.line)
            if changed is not None:
                detail = f"{self._name(changed)}, which it divides, was changed by somebody else meanwhile."
                return Clash(pointer, changed, detail)
            return replace(operation, line=self._line(operation.line))
        if isinstance(operation, AcceptMetaDivider):
            there = any(m.id == operation.id for m in self.current.meta.dividers)
            return operation if there else Clash(pointer, operation.id, "This repair is not there any more.")
        now = self.current.divider(operation.id)
        if isinstance(operation, RemoveDivider):
            if now is None:
                return None
            moved = (operation.id, "line") in self.theirs
            detail = "This divider was moved by somebody else meanwhile."
            return Clash(pointer, operation.id, detail) if moved else operation
        if now is None:
            return Clash(pointer, operation.id, "This divider is not there any more.")
        if isinstance(operation, SetDividerKind):
            return None if now.kind == operation.kind else operation
        line = self._line(operation.line)
        if (operation.id, "line") not in self.theirs:
            return replace(operation, line=line)
        if np.abs(as_points(now.line) - as_points(line)).max() <= MOVED_M:
            return None
        return Clash(pointer, operation.id, "This divider was moved by somebody else meanwhile.")

    def _zone(
        self, operation: MoveRestriction | RemoveRestriction | RemovePhantom, pointer: str
    ) -> Operation | Clash | None:
        there = operation.id in {r.id for r in self.current.restrictions} | {p.id for p in self.current.phantoms}
        if isinstance(operation, MoveRestriction):
            if not there:
                return Clash(pointer, operation.id, "This zone is not there any more.")
            if (operation.id, "shape") in self.theirs:
                return Clash(pointer, operation.id, "This zone was moved by somebody else meanwhile.")
            return replace(operation, shape=self._shape(operation.shape))
        return operation if there else None

    def _rooms_changed_under(self, line: Line) -> str | None:
        """A room that the line cuts in the base and that others have reshaped or ended."""
        drawn = LineString(line)
        for room in self.base.rooms:
            changed = {(room.id, "shape"), (room.id, "exists")} & set(self.theirs)
            if changed and shapely.intersection(drawn, room.polygon).length > CROSSED_M:
                return room.id
        return None

    def _successor(self, room_id: str) -> str | None:
        """The room that has most of the space now that a room of the base had."""
        if self.current.room(room_id) is not None:
            return room_id
        room = self.base.room(room_id)
        if room is None or not self.current.rooms:
            return None
        place = shapely.transform(room.polygon, lambda points: self.motion.apply(as_points(points)))
        return max(self.current.rooms, key=lambda r: float(shapely.intersection(r.polygon, place).area)).id

    def _name(self, room_id: str) -> str:
        room = self.base.room(room_id) or self.current.room(room_id)
        return room_id if room is None else room.name

    def _points(self, points: Sequence[Point]) -> tuple[Point, ...]:
        return as_tuples(np.round(self.motion.apply(as_points(points)), 4))

    def _line(self, line: Line) -> Line:
        return as_line(np.round(self.motion.apply(as_points(line)), 4))

    def _shape(self, shape: Shape) -> Shape:
        """Zones move as one rigid shape."""
        points = as_points(shape)
        return as_tuples(np.round(fit_pose(points, self.motion.apply(points)).apply(points), 4))


def moved_polygon(polygon: Polygon, motion: Motion) -> Polygon:
    return shapely.transform(polygon, lambda points: motion.apply(as_points(points)))
