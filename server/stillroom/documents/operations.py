"""What people ask to be changed, as it comes over the wire and goes back as a proposal."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, model_validator

from stillroom.documents.missions import Position
from stillroom.maps.geometry import Line
from stillroom.maps.semantics import DividerKind, RestrictionKind, RoomKind
from stillroom.pipeline import edits

LineDocument = tuple[Position, Position]
FeatureId = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]*$")]
Name = Annotated[
    str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*[^\s\x00-\x1f\x7f][^\x00-\x1f\x7f]*$")
]
Shape = Annotated[list[Position], Field(min_length=2, max_length=1000)]


class _Operation(BaseModel):
    model_config = ConfigDict(extra="forbid")


class AddDivider(_Operation):
    op: Literal["add_divider"]
    line: LineDocument
    kind: DividerKind = "open"

    def as_operation(self) -> edits.Operation:
        return edits.AddDivider(_line(self.line), self.kind)


class MoveDivider(_Operation):
    op: Literal["move_divider"]
    id: FeatureId
    line: LineDocument

    def as_operation(self) -> edits.Operation:
        return edits.MoveDivider(self.id, _line(self.line))


class RemoveDivider(_Operation):
    op: Literal["remove_divider"]
    id: FeatureId

    def as_operation(self) -> edits.Operation:
        return edits.RemoveDivider(self.id)


class SetDividerKind(_Operation):
    op: Literal["set_divider_kind"]
    id: FeatureId
    kind: DividerKind

    def as_operation(self) -> edits.Operation:
        return edits.SetDividerKind(self.id, self.kind)


class AcceptMetaDivider(_Operation):
    """A boundary that the service made to keep rooms apart becomes a divider of the owner's own."""

    op: Literal["accept_meta_divider"]
    id: FeatureId

    def as_operation(self) -> edits.Operation:
        return edits.AcceptMetaDivider(self.id)


class _OfRoom(_Operation):
    """A room by its `id`, or the one that is `at` a point once the whole batch is applied: a part that the batch itself makes."""

    id: FeatureId | None = None
    at: Position | None = None

    @model_validator(mode="after")
    def _names_one_room(self) -> "_OfRoom":
        if (self.id is None) == (self.at is None):
            raise ValueError("a room is named by its id, or by a point at which it is")
        return self

    @property
    def room(self) -> str | tuple[float, float]:
        found = self.at if self.id is None else self.id
        assert found is not None
        return found


class RenameRoom(_OfRoom):
    op: Literal["rename_room"]
    name: Name

    def as_operation(self) -> edits.Operation:
        return edits.RenameRoom(self.room, self.name.strip())


class SetRoomKind(_OfRoom):
    """What the room is used for; null: nobody says."""

    op: Literal["set_room_kind"]
    kind: RoomKind | None

    def as_operation(self) -> edits.Operation:
        return edits.SetRoomKind(self.room, self.kind)


class PinRoom(_OfRoom):
    """A pinned room changes only when a person agrees."""

    op: Literal["pin_room"]
    pinned: bool = True

    def as_operation(self) -> edits.Operation:
        return edits.PinRoom(self.room, self.pinned)


class MergeRooms(_Operation):
    op: Literal["merge_rooms"]
    ids: Annotated[list[FeatureId], Field(min_length=2, max_length=100)]

    def as_operation(self) -> edits.Operation:
        return edits.MergeRooms(tuple(self.ids))


class AddRestriction(_Operation):
    op: Literal["add_restriction"]
    kind: RestrictionKind
    shape: Shape

    def as_operation(self) -> edits.Operation:
        return edits.AddRestriction(self.kind, tuple(self.shape))


class MoveRestriction(_Operation):
    """Draws a restriction anew, under its old id."""

    op: Literal["move_restriction"]
    id: FeatureId
    shape: Shape

    def as_operation(self) -> edits.Operation:
        return edits.MoveRestriction(self.id, tuple(self.shape))


class RemoveRestriction(_Operation):
    op: Literal["remove_restriction"]
    id: FeatureId

    def as_operation(self) -> edits.Operation:
        return edits.RemoveRestriction(self.id)


class MarkPhantom(_Operation):
    """What lies in `shape` is not a real place, such as a mirror's image: it stays away in every later mission."""

    op: Literal["mark_phantom"]
    shape: Annotated[list[Position], Field(min_length=3, max_length=1000)]

    def as_operation(self) -> edits.Operation:
        return edits.MarkPhantom(tuple(self.shape))


class RemovePhantom(_Operation):
    op: Literal["remove_phantom"]
    id: FeatureId

    def as_operation(self) -> edits.Operation:
        return edits.RemovePhantom(self.id)


OperationDocument = Annotated[
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
    | RemovePhantom,
    Field(discriminator="op"),
]
_OPERATION: TypeAdapter[OperationDocument] = TypeAdapter(OperationDocument)
_NAMES: dict[type[Any], str] = {
    edits.AddDivider: "add_divider",
    edits.MoveDivider: "move_divider",
    edits.RemoveDivider: "remove_divider",
    edits.SetDividerKind: "set_divider_kind",
    edits.AcceptMetaDivider: "accept_meta_divider",
    edits.RenameRoom: "rename_room",
    edits.SetRoomKind: "set_room_kind",
    edits.PinRoom: "pin_room",
    edits.MergeRooms: "merge_rooms",
    edits.AddRestriction: "add_restriction",
    edits.MoveRestriction: "move_restriction",
    edits.RemoveRestriction: "remove_restriction",
    edits.MarkPhantom: "mark_phantom",
    edits.RemovePhantom: "remove_phantom",
}


class EditRequest(BaseModel):
    """All operations are applied, or none."""

    model_config = ConfigDict(extra="forbid")

    operations: Annotated[list[OperationDocument], Field(min_length=1, max_length=edits.MOST_OPERATIONS)]


def operation_document(operation: edits.Operation) -> OperationDocument:
    """The operation as a caller would send it."""
    values = dict(vars(operation))
    room = values.pop("room", None)
    if room is not None:
        values["id" if isinstance(room, str) else "at"] = room
    return _OPERATION.validate_python({"op": _NAMES[type(operation)]} | values)


def _line(line: LineDocument) -> Line:
    return line
