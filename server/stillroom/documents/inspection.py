"""One mission as fleet engineers look at it: numbers for all of them, the floor plan for those whom the owner lets."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.api import AblationDocument, ConflictState, Frame, Outcome
from stillroom.documents.conflicts import DifferenceDocument
from stillroom.documents.geojson import Document, Feature

PlanAccess = Literal["granted", "asked", "test", "unowned", "none"]
GrantState = Literal["asked", "granted", "refused", "expired", "revoked", "withdrawn"]


class RoomScoreDocument(Document):
    id: str
    precision: float
    recall: float
    passed: bool
    visited: bool


class MetConflict(Document):
    id: str
    kind: str
    cause: str
    state: ConflictState
    rooms: list[RoomScoreDocument]
    response: str | None
    """How it was answered; null: by nobody."""
    decided_at: datetime | None


class InspectedMission(Document):
    """Numbers alone: nothing that people wrote, and no place in a home."""

    robot: str
    map: str
    mission: str
    sequence: int
    epoch: int
    status: str
    outcome: Outcome | None
    succeeded_at: str | None
    ablation: AblationDocument | None
    base_version: int | None
    version: int | None
    left_with: int | None
    algorithm: str | None
    firmware: str | None
    model: str | None
    tracked: list[str]
    """In which forms the robot said how its map moved."""
    received_at: datetime
    finished_at: datetime | None
    attempts: int
    rooms: list[RoomScoreDocument]
    discovered_rooms: int
    warnings: int
    conflicts: list[MetConflict]
    timings_ms: dict[str, float]
    error: str | None
    """Where processing failed."""
    escaped_at: datetime | None
    cause: str | None
    previous: str | None
    """The mission of the map that was processed before it, and the one after it."""
    next: str | None
    plan: PlanAccess
    """Whether its floor plan may be looked at, and by what."""
    plan_until: datetime | None


class MissionStep(Document):
    """One mission of a map's history."""

    mission: str
    outcome: Outcome | None
    finished_at: datetime | None
    base_version: int | None
    version: int | None
    failed: int
    """How many rows of the results table."""


class PlanFigure(Document):
    """The paper's figures of one mission, in its frame; worked out anew by the algorithm that runs now. Rooms are named by their ids."""

    robot: str
    map: str
    mission: str
    algorithm: str
    outcome: str
    """What it comes to now; without what people were asked."""
    taken: bool
    reason: str
    frame: Frame
    cells: str
    """URL of what the robot sensed, as PNG: 254 free, 0 occupied, 205 unexplored."""
    tracked: list[Feature]
    """The previous map where tracking and alignment put it; nothing for a first mission, or where no frame was found."""
    candidate: list[Feature]
    """The map that was judged, with its meta-occupancy and meta-dividers, taken or not."""
    differences: list[DifferenceDocument]
    moved: tuple[float, float, float] | None
    rooms: list[RoomScoreDocument]
    ablation: AblationDocument | None
    timings_ms: dict[str, float]


class GrantRequest(BaseModel):
    model_config = ConfigDict(extra="forbid")

    robot: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    reason: Annotated[str, Field(min_length=10, max_length=500, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")]
    """What the owner reads."""
    hours: Annotated[int, Field(ge=1, le=168)] = 24
    """From when it is granted."""


class GrantAnswer(BaseModel):
    model_config = ConfigDict(extra="forbid")

    answer: Literal["grant", "refuse"]


class GrantDocument(Document):
    id: str
    robot: str
    state: GrantState
    reason: str
    hours: int
    asked_by: str
    asked_at: datetime
    answered_at: datetime | None
    answered_by: str | None
    expires_at: datetime
    """Until then it can be answered; once it is granted, until then it holds."""
    ended_at: datetime | None
    ended_by: str | None


class ViewDocument(Document):
    """Somebody looked at a floor plan of the robot."""

    viewer: str
    at: datetime
    map: str
    mission: str
    what: Literal["figure", "cells"]
    why: Literal["granted", "test", "unowned"]
    grant: str | None


class TestMark(BaseModel):
    model_config = ConfigDict(extra="forbid")

    test: bool
    """Whether those who run the service may always look at the robot's floor plans."""


class TestRobot(Document):
    robot: str
    test: bool
