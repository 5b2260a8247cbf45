"""What the API answers with. Field names are those of the HTTP contract; the web client's types are generated from these."""

from datetime import datetime
from typing import Annotated, Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.geojson import Document, Feature
from stillroom.documents.operations import OperationDocument

Outcome = Literal["created", "updated", "resolved", "needs_review", "reverted", "superseded", "parked"]
Status = Literal["queued", "processing", "done"]
Cause = Literal["created", "mission", "edit", "decision", "restore", "import", "rollback"]
ConflictState = Literal["open", "accepted", "rejected", "annotated", "expired", "superseded", "resolved_automatically"]
Review = Literal["automatic", "ask_first"]
ItemT = TypeVar("ItemT")


class Page(Document, Generic[ItemT]):
    items: list[ItemT]
    next: str | None
    """Cursor of the next page; null: this is the last."""


class FaultDocument(Document):
    pointer: str
    detail: str


class Problem(BaseModel):
    """RFC 9457. `retryable`: send the same again later."""

    model_config = ConfigDict(extra="allow")

    type: str
    title: str
    status: int
    detail: str
    errors: list[FaultDocument]
    retryable: bool


# -- maps --------------------------------------------------------------------------------------------------------------


class Frame(Document):
    unit: Literal["m"] = "m"
    resolution: float
    """Metres a cell."""
    width: int
    height: int
    origin: tuple[float, float, float]
    """Pose (x, y, yaw) of the outer corner of the lower-left cell."""


class VersionSummary(Document):
    robot: str
    map: str
    version: int
    parent: int | None
    cause: Cause
    mission: str | None
    """The mission whose grid this version lies on."""
    made_by: str
    created_at: datetime


class VersionListItem(VersionSummary):
    name: str | None
    """What people call it."""
    rooms: int
    """How many rooms it has."""
    url: str


class MapDocument(VersionSummary):
    """A version of a map as GeoJSON in local metres."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    frame: Frame
    grid: str
    """URL of the occupancy pixels as PNG, as the robot sent them."""
    cells: str
    """URL of what they mean as PNG: 254 free, 0 occupied, 205 unexplored, whatever greys the robot uses."""
    features: list[Feature]


class EditProblem(Document):
    """Something an edit causes that its author should see; `code` is stable."""

    code: str
    severity: str
    feature: str | None
    message: str
    fix: str | None
    """What would mend it, in words."""
    fix_operation: OperationDocument | None = None
    """The same as an operation, to be added to the others."""


class MadeFeature(Document):
    """What an operation of the batch made."""

    pointer: str
    feature: str


class EditedMap(MapDocument):
    """The map that an edit made."""

    problems: list[EditProblem]


class EditPreview(EditedMap):
    """The map that an edit would make."""

    made: list[MadeFeature]


class SuggestedEdit(Document):
    """Operations for version `version`, to be sent as an edit: as a dry run to see what they come to."""

    version: int
    operations: list[OperationDocument]


class FixDocument(Document):
    """What would mend an edit that was refused: the operation to put at `pointer`, or to add where that is "/operations"."""

    pointer: str
    title: str
    operation: OperationDocument


class RefusedEdit(Problem):
    """`fixes`: what would mend it, where that can be told."""

    fixes: list[FixDocument] = []


class MergeConflict(Document):
    """An operation that somebody else's change speaks against."""

    pointer: str
    feature: str | None
    detail: str
    operation: OperationDocument | None
    """What to send instead of it, beside `merge_operations`, to have it one's own way all the same; null: that can't be."""


class StaleEdit(Problem):
    """`current` is in force. Where `mergeable`, the edit still applies to it: `merge_operations` are what to send with
    `If-Match: "v{current}"`, `merge_preview` is what they come to."""

    current: int
    mergeable: bool
    merge_preview: EditPreview | None
    merge_operations: list[OperationDocument]
    merge_conflicts: list[MergeConflict]


class ChangeDocument(Document):
    """One thing that differs between two versions. `value`: metres or square metres, where it is measured."""

    code: str
    feature: str
    name: str
    """Of the room, or of those beside a divider."""
    text: str
    value: float | None


class DiffDocument(Document):
    from_version: int
    to_version: int
    moved: tuple[float, float, float] | None
    """The rigid motion (x, y, yaw) that takes the first one's frame to the second one's, about; null: none is known."""
    changes: list[ChangeDocument]


class VersionChange(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    name: (
        Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]*[^\s\x00-\x1f\x7f][^\x00-\x1f\x7f]*$")] | None
    )
    """null takes the name away."""


class PinRequest(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    version: Annotated[int, Field(ge=1, le=2**31 - 1)] | None = None
    """The one in force where it is missing; any other is restored first."""


class Segment(Document):
    id: str
    name: str
    group: str


class RetiredRoom(Document):
    """A room that ended."""

    id: str
    retired: Literal[True] = True
    survivor: str | None
    """The room that has its space now."""
    name: str
    segment_id: int


class MapSummary(Document):
    map: str
    """The robot's own name of the floor."""
    name: str
    """What people call it."""
    review: Review
    version: int | None
    """The version in force; null until a first mission succeeded."""
    pinned: int | None
    """The version that it stays at until a person agrees to another."""
    rooms: int
    updated_at: datetime | None
    url: str


class RobotSummary(Document):
    id: str
    name: str
    owner: str | None
    maps: list[MapSummary]
    may: list[str]
    """What the caller may do to it: `read`, `upload`, `edit`, `manage`, `rekey`, `disconnect`, `release`."""


class NewRobot(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    name: Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")] | None = None
    owner: Annotated[str, Field(max_length=320, pattern=r"^[^@\s\x00-\x1f\x7f]+@[^@\s\x00-\x1f\x7f]+$")] | None = None


class CreatedRobot(Document):
    id: str
    name: str
    owner: str | None
    token: str
    """Shown this once."""
    claim_code: str


class MapSettings(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    name: (
        Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]*[^\s\x00-\x1f\x7f][^\x00-\x1f\x7f]*$")] | None
    ) = None
    review: Review | None = None


class Caller(Document):
    """Who the service takes the caller for."""

    kind: Literal["operator", "engineer", "robot", "person"]
    id: str | None
    """A robot's id, a person's e-mail address; null: an operator who has no account."""
    may: list[str]
    """What, apart from robots: `household`, `messages`, `figures`, `triage`, `register`, `accounts`, `account`."""


# -- missions ----------------------------------------------------------------------------------------------------------


class AblationDocument(Document):
    transfer: bool
    meta_occupancy: bool
    meta_dividers: bool


class RoomScoreDocument(Document):
    id: str
    name: str
    precision: float
    recall: float
    passed: bool
    visited: bool


class CandidateDocument(Document):
    """A floor that a parked mission could belong to."""

    map: str
    share: float
    """Of the floor's walls that lie where the mission has walls, at best."""
    certain: bool
    """Whether that alone tells the floor and the pose."""


class DecisionDocument(Document):
    """What a person decided about a mission: where a parked one belongs and what came of it there, or the answer to a conflict."""

    response: Literal["place", "accept", "reject", "annotate", "temporary"]
    conflict: str | None
    proposal: str | None
    map: str
    mission: str
    """Of a parked mission: what it is called as a mission of that map."""
    decided_by: str
    decided_at: datetime
    status: Status
    outcome: Outcome | None
    version: int | None
    """The version of that map that was in force then."""
    reason: str


class Placement(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    map: Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,64}$")]
    """The robot's name of a floor; a new name makes a new map."""


class MissionDocument(Document):
    id: str
    robot: str
    map: str
    sequence: int
    epoch: int
    status: Status
    outcome: Outcome | None
    """What processing found; null until it is done."""
    succeeded_at: Literal["transfer", "meta_occupancy", "meta_dividers"] | None
    ablation: AblationDocument | None
    base_version: int | None
    """The version that was carried over."""
    left_with: int | None
    """The version that the robot left with, as it said."""
    version: int | None
    """The version in force after this mission."""
    algorithm: str | None
    rooms: list[RoomScoreDocument]
    conflicts: list[str]
    discovered_rooms: list[str]
    warnings: list[str]
    reason: str
    candidates: list[CandidateDocument]
    """Of a parked mission: the robot's floors, the likeliest first."""
    decision: DecisionDocument | None
    """Of a parked mission: where a person put it."""
    timings_ms: dict[str, float]
    started_at: datetime | None
    ended_at: datetime | None
    received_at: datetime
    grid: str
    """URL of the occupancy pixels as PNG."""


class Event(Document):
    """`mission`: one was processed; `version`: a new one is in force; `conflict`: one was opened or ended; `decision`: a person
    placed a parked mission; `settings`: a map was renamed."""

    kind: Literal["mission", "version", "conflict", "decision", "settings"]
    robot: str
    map: str
    at: datetime
    mission: str | None = None
    outcome: Outcome | None = None
    version: int | None = None
    cause: Cause | None = None
    conflict: str | None = None
    state: ConflictState | None = None
    quiet: bool | None = None
    """Of a conflict that was opened: nobody is sent a message about it."""
