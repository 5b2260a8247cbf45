"""Rollouts, as the API has them."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from stillroom.documents.fleet import Range
from stillroom.documents.geojson import Document
from stillroom.documents.replays import PairedTable
from stillroom.pipeline.update import ResolverName

Measure = Literal["transfer", "meta_occupancy", "meta_dividers", "reverted", "needs_review", "parked", "escapes"]
State = Literal["running", "successful", "failed", "inconclusive"]
Stage = Literal[0, 1, 5, 25, 100]
"""Per cent of homes; 0: in none, beside the setting in force."""
Verdict = Literal["waiting", "passed", "failed", "inconclusive"]
MapState = Literal["to_revert", "undone", "decided"]
RolloutName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,19}$")]


class Gate(BaseModel):
    """Passed where the measure's share of missions is surely not higher than before by the margin."""

    model_config = ConfigDict(extra="forbid")

    measure: Measure
    margin: Annotated[float, Field(gt=0, le=0.5)]
    minimum_n: Annotated[int, Field(ge=30, le=1_000_000)] = 300
    """Missions of each arm, before anything is decided."""


class NewRollout(BaseModel):
    """What is tried instead of the code's own: which resolvers, and parameters that differ."""

    model_config = ConfigDict(extra="forbid")

    name: RolloutName
    resolvers: Annotated[list[ResolverName], Field(max_length=2)] = ["meta_occupancy", "meta_dividers"]
    params: Annotated[dict[str, JsonValue], Field(max_length=100)] = {}
    gates: Annotated[list[Gate], Field(min_length=1, max_length=7)]
    automatic: bool = False
    """Whether it goes on by itself where its gates are passed; it halts by itself in any case."""


class EndRollout(BaseModel):
    model_config = ConfigDict(extra="forbid")

    reason: Annotated[str, Field(min_length=3, max_length=500, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")]


class RolloutDocument(Document):
    name: str
    algorithm: str
    """What its missions are labelled with: a filter of the dashboard."""
    resolvers: list[ResolverName]
    params: dict[str, Any]
    gates: list[Gate]
    automatic: bool
    state: State
    stage: Stage
    staged_at: datetime
    created_at: datetime
    created_by: str
    ended_at: datetime | None
    ended_by: str | None
    """Null: it ended by itself."""
    reason: str | None
    withdrawn_at: datetime | None
    in_force: bool
    """Whether it is what all homes have now."""


class ArmShare(Document):
    count: int
    missions: int
    robots: int
    share: float | None
    ci95: Range


class GateReport(Gate):
    """With the numbers of now; `verdict` is that of the last look."""

    verdict: Verdict
    old: ArmShare
    new: ArmShare
    difference: float | None
    """The new share less the old one."""
    ci95: Range
    """Of the difference."""
    p: float
    """How likely so large a difference is by chance: Fisher's exact test, or McNemar's of missions that were run both ways. Takes
    missions as independent ones; nothing is decided by it."""
    more: int | None
    """About how many more missions of the new setting it takes to decide; null: no number would, at these shares."""


class LookedGate(Document):
    measure: Measure
    margin: float
    verdict: Verdict
    old: float
    new: float
    low: float
    high: float
    """What it was decided by: an interval of the difference that allows for all looks and gates."""


class LookDocument(Document):
    number: int
    stage: Stage
    missions: int
    at: datetime
    verdict: Verdict
    gates: list[LookedGate]


class BesideProgress(Document):
    done: int
    waiting: int
    errors: int


class RolloutReport(RolloutDocument):
    verdict: Verdict
    """Of the last look of this stage."""
    missions: int
    """Of the smaller arm; while it runs beside, of those run both ways."""
    next_look: int
    """At so many."""
    report: list[GateReport]
    looks: list[LookDocument]
    beside: BesideProgress
    tables: list[PairedTable]
    """Of the missions that were run both ways: the rows of the results table."""
    changed_maps: int


class ChangedMap(Document):
    robot: str
    map: str
    version: int
    """In force now."""
    first: int
    """The first that the candidate made."""
    back_to: int | None
    """The last version before; null where there is none."""
    state: MapState
    """`undone`: nothing of the candidate is in the map any more; `decided`: a person has since agreed to what it made."""


class Reverted(Document):
    robot: str
    map: str
    version: int
    back_to: int
    kept: int
    """Edits of people that were made since and are in it."""


class NotReverted(Document):
    robot: str
    map: str
    reason: str


class RevertedMaps(Document):
    reverted: list[Reverted]
    kept: list[NotReverted]
    """Left as they are, and why."""
    next: str | None
    """The cursor to go on with; null: there are no more."""
