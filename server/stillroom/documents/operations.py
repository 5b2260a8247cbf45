"""What people ask to be changed, as it comes over the wire."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.missions import Position
from stillroom.maps.geometry import Line
from stillroom.maps.semantics import DividerKind, RestrictionKind
from stillroom.pipeline import edits

LineDocument = tuple[Position, Position]
FeatureId = Annotated[str, Field(min_length=1, max_length=64)]
Name = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*\S[^\x00-\x1f\x7f]*$")]


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


class RenameRoom(_Operation):
    op: Literal["rename_room"]
    id: FeatureId
    name: Name

    def as_operation(self) -> edits.Operation:
        return edits.RenameRoom(self.id, self.name.strip())


class MergeRooms(_Operation):
    op: Literal["merge_rooms"]
    ids: Annotated[list[FeatureId], Field(min_length=2, max_length=100)]

    def as_operation(self) -> edits.Operation:
        return edits.MergeRooms(tuple(self.ids))


class AddRestriction(_Operation):
    op: Literal["add_restriction"]
    kind: RestrictionKind
    shape: Annotated[list[Position], Field(min_length=2, max_length=1000)]

    def as_operation(self) -> edits.Operation:
        return edits.AddRestriction(self.kind, tuple(self.shape))


class RemoveRestriction(_Operation):
    op: Literal["remove_restriction"]
    id: FeatureId

    def as_operation(self) -> edits.Operation:
        return edits.RemoveRestriction(self.id)


OperationDocument = Annotated[
    AddDivider
    | MoveDivider
    | RemoveDivider
    | SetDividerKind
    | RenameRoom
    | MergeRooms
    | AddRestriction
    | RemoveRestriction,
    Field(discriminator="op"),
]


class EditRequest(BaseModel):
    """All operations are applied, or none."""

    model_config = ConfigDict(extra="forbid")

    operations: Annotated[list[OperationDocument], Field(min_length=1, max_length=500)]


def _line(line: LineDocument) -> Line:
    return line
