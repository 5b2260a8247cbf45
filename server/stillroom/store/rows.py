"""Rows as values."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any, TypeVar

import sqlalchemy as sa

Json = dict[str, Any]


@dataclass(frozen=True)
class RobotRow:
    id: str
    name: str
    owner: str | None
    created_at: datetime
    token_made_at: datetime | None = None
    """None: it was revoked."""
    token_shown: bool = False
    """To an owner, so that it is no secret to that home."""
    released_at: datetime | None = None
    """Its owner gave it up, and nobody has claimed it since."""
    kept_from: str | None = None
    """No robot, but what an owner kept of one that was given up."""


@dataclass(frozen=True)
class MapName:
    robot_id: str
    name: str


@dataclass(frozen=True)
class MapRow(MapName):
    id: int
    title: str
    ordinal: int
    review: str
    head: int | None
    epoch: int | None
    sequence: int | None
    used_ids: Json
    created_at: datetime
    pinned: int | None = None
    """The version that it stays at until a person agrees to another."""


@dataclass(frozen=True)
class ShownMission:
    """What the robot sees of a mission."""

    key: str
    epoch: int
    sequence: int
    status: str
    meta: Json
    received_at: datetime
    outcome: str | None
    succeeded_at: str | None
    ablation_transfer: bool | None
    ablation_meta_occupancy: bool | None
    ablation_meta_dividers: bool | None
    base_version: int | None
    version: int | None
    algorithm: str | None
    result: Json | None


@dataclass(frozen=True)
class MissionRow(ShownMission):
    id: int
    map_id: int
    attempts: int
    grid: str
    meta_digest: str
    finished_at: datetime | None
    placed_from: int | None
    placed_by: str | None


@dataclass(frozen=True)
class VersionSummary:
    """What everybody sees of a version beside its shapes."""

    number: int
    parent: int | None
    cause: str
    mission: str | None
    made_by: str
    created_at: datetime


@dataclass(frozen=True)
class VersionHead(VersionSummary):
    """A version without its document."""

    map_id: int
    algorithm: str
    grid: str
    frame_from: int | None
    motion: Json | None
    rooms: int
    name: str | None


@dataclass(frozen=True)
class VersionRow(VersionHead):
    document: Json


@dataclass(frozen=True)
class ShownVersion(VersionSummary):
    document: Json


@dataclass(frozen=True)
class RoomRow:
    id: str
    segment_id: int
    name: str
    retired: bool
    survivor: str | None


@dataclass(frozen=True)
class ConflictRow:
    """A conflict as the newest mission that met it found it, and how it ended, if it did."""

    id: int
    map_id: int
    robot_id: str
    map_name: str
    key: str
    kind: str
    place: str
    resolved: bool
    opened_at: datetime
    due_at: datetime | None
    state: str
    fold_count: int
    """How many missions found it again."""
    sighting_id: int
    mission_id: int
    mission: str
    cause: str
    summary: str
    rooms: list[Json]
    dividers: list[str]
    restrictions: list[str]
    base_version: int
    motion: Json | None
    response: str | None
    proposal: str | None
    drawn: list[Any] | None
    note: str | None
    decided_by: str | None
    decided_at: datetime | None
    version: int | None
    superseded_by: str | None
    quiet: bool
    """The same was dismissed before: nobody was sent a message."""


@dataclass(frozen=True)
class ProposalRow:
    """A proposal without the map that would be in force."""

    sighting_id: int
    name: str
    action: str
    recommended: bool
    changes: Json


@dataclass(frozen=True)
class EventRow:
    id: int
    robot_id: str
    map_name: str
    kind: str
    data: Json
    created_at: datetime


@dataclass(frozen=True)
class UntoldRow:
    """An event that nobody has been told of yet."""

    id: int
    robot_id: str
    owner: str | None
    map_id: int
    map_name: str
    map_title: str
    kind: str
    data: Json
    created_at: datetime


@dataclass(frozen=True)
class ReceiverRow:
    """Where messages go."""

    id: int
    key: str
    channel: str
    person: str
    """Whose it is."""
    fleet: bool
    address: str
    label: str
    kinds: list[str] | None
    keys: Json
    created_at: datetime
    confirmed_at: datetime | None
    delivered_at: datetime | None
    failures: int
    failing_since: datetime | None
    resume_at: datetime | None
    ended_at: datetime | None
    ended_reason: str | None


@dataclass(frozen=True)
class DeliveryRow:
    """One message, or part of one, to one receiver."""

    id: int
    key: str
    receiver_id: int
    kind: str
    content: Json
    state: str
    attempts: int
    due_at: datetime
    created_at: datetime
    tried_at: datetime | None
    finished_at: datetime | None
    status_code: int | None
    reason: str | None


RowT = TypeVar("RowT")
OtherT = TypeVar("OtherT")


def columns(table: sa.Table, kind: type[Any], *without: str) -> list[sa.Column[Any]]:
    """The columns of `table` that the dataclass `kind` has a field for."""
    return [table.c[field.name] for field in fields(kind) if field.name not in without]


def as_row(kind: type[RowT], row: Any) -> RowT:
    return kind(**row._mapping)


def as_rows(row: Sequence[Any], first: type[RowT], second: type[OtherT]) -> tuple[RowT, OtherT, Sequence[Any]]:
    """One after the other as `columns` gives them, and what is left."""
    middle = len(fields(first))  # type: ignore[arg-type]
    end = middle + len(fields(second))  # type: ignore[arg-type]
    return first(*row[:middle]), second(*row[middle:end]), row[end:]


def as_row_or_none(kind: type[RowT], row: Any) -> RowT | None:
    return None if row is None else as_row(kind, row)
