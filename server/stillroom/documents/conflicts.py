"""Conflicts and what people decide about them, as the API has them."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.api import ConflictState, Frame
from stillroom.documents.geojson import Document, Feature, Polygon
from stillroom.documents.missions import Position
from stillroom.pipeline.conflicts import Action, Cause, ConflictKind
from stillroom.pipeline.differences import Change

Response = Literal["accept", "reject", "annotate", "temporary"]


class ConflictRoom(Document):
    id: str
    name: str
    precision: float
    recall: float
    passed: bool
    visited: bool


class ProposalDocument(Document):
    id: str
    action: Action
    recommended: bool
    features: list[Feature]
    """What it would add to the map: its meta layer, and dividers that are not there now."""
    result: str
    """URL of the map that would be in force."""


class DefaultDocument(Document):
    """What happens by itself where nobody answers."""

    response: Literal["reject"] = "reject"
    at: datetime


class ConflictDocument(Document):
    id: str
    robot: str
    map: str
    kind: ConflictKind
    cause: Cause
    rooms: list[ConflictRoom]
    dividers: list[str]
    restrictions: list[str]
    mission: str
    """The newest one that met it."""
    base_version: int
    """The version that this mission carried over."""
    state: ConflictState
    summary: str
    """A sentence for a person."""
    proposals: list[ProposalDocument]
    default: DefaultDocument | None
    """Null: nobody was asked, the meta layer had settled it."""
    opened_at: datetime
    fold_count: int
    """How many later missions met it again."""
    response: Response | None
    """What a person answered."""
    proposal: str | None
    """The one that was accepted."""
    note: str | None
    decided_by: str | None
    """Who ended it; `deadline` where nobody answered."""
    decided_at: datetime | None
    version: int | None
    """The version in force after it ended."""
    superseded_by: str | None
    """The later mission that made it pointless."""
    quiet: bool
    """The same was dismissed before and is no worse now: nobody was sent a message."""
    url: str


class DifferenceDocument(Document):
    change: Change
    """`blocked`: what was floor is obstacle; `opened`: the other way round; `found`: floor where nothing was known; `unseen`: known
    floor that the robot did not see."""
    area: float
    """Square metres."""
    geometry: Polygon


class ConfirmedDocument(Document):
    room: str
    geometry: Polygon


class SensedDocument(Document):
    """What the robot saw in the mission that met a conflict, in that mission's frame."""

    mission: str
    base_version: int
    version: int
    """The one in force now."""
    taken: bool
    """Whether the mission's map came into force."""
    frame: Frame
    grid: str
    """URL of the pixels as the robot sent them."""
    cells: str
    """URL of what they mean."""
    moved: tuple[float, float, float] | None
    """The rigid motion (x, y, yaw) from the frame of `base_version` to the mission's, about; null: none is known."""
    moved_now: tuple[float, float, float] | None
    """The same from the frame of the version in force."""
    differences: list[DifferenceDocument]
    """Against the grid under `base_version`, the largest first; none where `moved` is null."""
    confirmed: list[ConfirmedDocument]
    """Where the rooms of a drift were when somebody last confirmed them; none for other kinds."""


class DecisionRequest(BaseModel):
    model_config = ConfigDict(extra="forbid")

    response: Response
    proposal: Annotated[str, Field(min_length=1, max_length=16, pattern=r"^[^\x00-\x1f\x7f]*$")] | None = None
    """The one to accept; the recommended one where this is missing."""
    dividers: Annotated[list[tuple[Position, Position]], Field(max_length=100)] = []
    """The owner's own lines, for `annotate`."""
    note: Annotated[str, Field(max_length=1000, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")] = ""
