"""Alerts on rates, as the API has them."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.fleet import Range, Size
from stillroom.documents.geojson import Document
from stillroom.documents.rollouts import Measure

Values = Annotated[list[Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]], Field(max_length=50)]
Share = Annotated[float, Field(ge=0, le=1)]


class NewAlert(BaseModel):
    """Raised where a rate is surely above `above`, ended where it is below `below`: between the two it stays as it is."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]*$")]
    measure: Measure
    days: Annotated[int, Field(ge=1, le=90)] = 1
    """The last so many, up to today, in UTC."""
    minimum_n: Annotated[int, Field(ge=30, le=1_000_000)] = 100
    """With fewer missions nothing changes."""
    above: Share
    below: Share
    firmware: Values = []
    model: Values = []
    algorithm: Values = []
    size: Annotated[list[Size], Field(max_length=5)] = []


class AlertFigures(Document):
    share: float
    ci95: Range
    missions: int
    first: str
    """Day from which on they were counted."""


class AlertDocument(Document):
    name: str
    measure: Measure
    days: int
    minimum_n: int
    above: float
    below: float
    firmware: list[str]
    model: list[str]
    algorithm: list[str]
    size: list[Size]
    created_at: datetime
    created_by: str
    looked_at: datetime | None
    raised_at: datetime | None
    """Null: it is not raised."""
    figures: AlertFigures | None
    """When it was last looked at."""
