"""What people may do to a map, as pure actions: a map and a list of operations in, a new map or `InvalidEdit` out."""

from stillroom.pipeline.edits.applying import MOST_OPERATIONS, EditResult, apply_edits
from stillroom.pipeline.edits.draft import LONGEST_NAME
from stillroom.pipeline.edits.operations import (
    AcceptMetaDivider,
    AddDivider,
    AddRestriction,
    Fix,
    MarkPhantom,
    MergeRooms,
    MoveDivider,
    MoveRestriction,
    Operation,
    PinRoom,
    Problem,
    RemoveDivider,
    RemovePhantom,
    RemoveRestriction,
    RenameRoom,
    SetDividerKind,
    SetRoomKind,
)

__all__ = [
    "LONGEST_NAME",
    "MOST_OPERATIONS",
    "AcceptMetaDivider",
    "AddDivider",
    "AddRestriction",
    "EditResult",
    "Fix",
    "MarkPhantom",
    "MergeRooms",
    "MoveDivider",
    "MoveRestriction",
    "Operation",
    "PinRoom",
    "Problem",
    "RemoveDivider",
    "RemovePhantom",
    "RemoveRestriction",
    "RenameRoom",
    "SetDividerKind",
    "SetRoomKind",
    "apply_edits",
]
