"""Replays: what stored missions come to with other code or other parameters."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, JsonValue

from stillroom.documents.geojson import Document
from stillroom.pipeline.update import ResolverName

Measure = Literal["transfer", "meta_occupancy", "meta_dividers", "taken"]
Cell = Literal["both", "only_old", "only_new", "neither"]


class PairedTable(Document):
    """How many missions succeeded then, now, both times or never."""

    measure: Measure
    """A row of the results table, or whether the map was taken (of maps that need nobody to agree)."""
    both: int
    only_old: int
    only_new: int
    neither: int
    p: float
    """McNemar's exact test, two-sided. Missions of one robot are taken as independent ones here."""


class NewReplay(BaseModel):
    """Run by workers when nothing else waits."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    resolvers: Annotated[list[ResolverName], Field(max_length=2)] = ["meta_occupancy", "meta_dividers"]
    params: Annotated[dict[str, JsonValue], Field(max_length=100)] = {}
    since: AwareDatetime | None = None
    """Missions that were processed from then on."""
    until: AwareDatetime | None = None
    robots: Annotated[
        list[Annotated[str, Field(max_length=64, pattern=r"^[^\x00-\x1f\x7f]*$")]], Field(max_length=1000)
    ] = []
    """These alone; none: all."""


class ReplayDocument(Document):
    name: str
    algorithm: str
    resolvers: list[str]
    params: dict[str, Any]
    """Those that differ."""
    selection: dict[str, Any]
    created_at: datetime
    finished_at: datetime | None
    missions: int
    done: int


class ReplayResults(ReplayDocument):
    tables: list[PairedTable]


class ReplayedMission(Document):
    robot: str
    map: str
    mission: str
    outcome_then: str
    outcome_now: str
    error: str | None
    url: str
