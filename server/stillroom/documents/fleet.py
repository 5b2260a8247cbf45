"""What fleet dashboards are answered with: numbers, and nothing that people wrote."""

from datetime import date, datetime
from typing import Annotated, Literal

from pydantic import Field

from stillroom.documents.api import Page
from stillroom.documents.geojson import Document

GroupBy = Literal["day", "week", "firmware", "model", "algorithm", "size", "cause"]
Interval = Literal["wilson", "bootstrap"]
Clustering = Literal["measured", "selection", "assumed", "resampled"]
Size = Literal["", "1-3", "4-6", "7-9", "10+"]
CauseState = Literal["new", "ongoing", "regressed", "muted"]
RobotOrder = Literal["-failure_rate", "-lower_bound", "-missions", "-escapes"]
Range = tuple[float, float]


class Measures(Document):
    """Shares of missions. Of the judged ones, except `parked`, which is of these and the parked ones."""

    transfer: float | None
    """Would have failed with transfer alone; null, like all others, where there was no mission."""
    meta_occupancy: float | None
    """Would have failed with transfer and meta-occupancy."""
    meta_dividers: float | None
    """Failed with everything."""
    reverted: float | None
    needs_review: float | None
    """Put to a person."""
    parked: float | None
    escapes: float | None
    """Taken by itself, then undone or corrected by the owner within 7 days."""


class Ranges(Document):
    """95 % intervals of the same shares."""

    transfer: Range
    meta_occupancy: Range
    meta_dividers: Range
    reverted: Range
    needs_review: Range
    parked: Range
    escapes: Range


class FailedRows(Document):
    """How many missions failed that row of the results table."""

    transfer: int
    meta_occupancy: int
    meta_dividers: int


class RateRow(Document):
    key: str
    """The value that it is grouped by; of a week its Monday."""
    missions: int
    """n: those that were judged. Neither a map's first mission, nor late or parked ones."""
    robots: int
    sufficient: bool
    """Whether n is at least `minimum_n`. If not, the intervals say all that is known: don't draw the points."""
    rates: Measures
    ci95: Ranges
    design_effect: Measures
    """How many times as many missions of one robot each would tell the same is 1 / this; at least 1."""
    clustering: dict[str, Clustering]
    """Of each measure, where its design effect comes from: measured in this row, by the correlation within robots of the whole
    selection, or by an assumed one; `resampled`: the interval needs none."""
    failed: FailedRows
    reverted: int
    needs_review: int
    parked: int
    escapes: int


class RatesDocument(Page[RateRow]):
    total: RateRow
    """All groups as one. Of causes, the same missions: each row says how many of them failed by that cause."""
    first: date
    last: date
    group_by: GroupBy | None
    interval: Interval
    minimum_n: int
    waiting: int
    """Missions that were processed and are not counted yet."""


class FiltersDocument(Document):
    """The values that there are."""

    firmware: list[str]
    model: list[str]
    algorithm: list[str]
    size: list[Size]
    first: date | None
    """The first day that has missions."""
    minimum_n: int


class RobotRow(Document):
    robot: str
    missions: int
    failed: int
    """Reverted, or put to a person."""
    failure_rate: float
    ci95: Range
    """Of one robot's missions as independent ones."""
    reverted: int
    needs_review: int
    parked: int
    escapes: int


class TrendPoint(Document):
    day: date
    missions: int


class CauseRow(Document):
    """Missions that failed alike: at the same criterion, by the same cause, at the same stage of the same algorithm."""

    id: str
    kind: str
    """Of the conflict: the criterion. `error`: processing failed."""
    cause: str
    stage: str
    """The last row of the results table that failed; `verification`, `registration` or `processing` where it was none of them."""
    algorithm: str
    state: CauseState
    first_seen: datetime
    last_seen: datetime
    returned_at: datetime | None
    """When it was seen again after two weeks without."""
    missions: int
    robots: int
    share: float
    """Of all missions of the selection that failed."""
    reverted: int
    needs_review: int
    parked: int
    settled: int
    """Taken all the same: the meta layer helped."""
    trend: list[TrendPoint]
    """By day; from three months on by week, each named by its Monday. Those without any are left out."""
    muted_until: datetime | None
    muted_by: str | None
    note: str | None
    url: str
    """Its missions."""


class CausesDocument(Page[CauseRow]):
    first: date
    last: date
    missions: int
    """That failed, of all causes."""
    waiting: int


class CauseDocument(CauseRow):
    firmware: dict[str, int]
    """Its missions of the selection by firmware, model and size of home."""
    model: dict[str, int]
    size: dict[str, int]


class Mute(Document):
    """Leaves a cause out of what is alerted about; until then, or for good."""

    until: datetime | None = None
    note: Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")] = ""


class UnprocessedMission(Document):
    """Processing raised, or ended its worker again and again; the previous map was kept."""

    robot: str
    map: str
    mission: str
    received_at: datetime
    finished_at: datetime | None
    attempts: int
    algorithm: str
    error: str
    url: str


class FleetMissionItem(Document):
    robot: str
    map: str
    mission: str
    outcome: str
    finished_at: datetime
    firmware: str
    model: str
    algorithm: str
    escaped_at: datetime | None
    cause: str | None
    """Id of what it failed by."""
    url: str
