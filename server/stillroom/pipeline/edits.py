"""What people may do to a map, as pure actions: a map and a list of operations in, a new map or `InvalidEdit` out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from stillroom.maps.geometry import Line
from stillroom.maps.semantics import DividerKind, SemanticMap
from stillroom.pipeline.params import PARAMS, Params


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


Operation = AddDivider | MoveDivider | RemoveDivider | SetDividerKind | RenameRoom | MergeRooms


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


def apply_edits(previous: SemanticMap, operations: Sequence[Operation], params: Params = PARAMS) -> EditResult:
    """All operations or none, judged as a whole.

    Raises InvalidEdit with a JSON pointer into {"operations": [...]} for each operation that can't be applied.
    """
    raise NotImplementedError
