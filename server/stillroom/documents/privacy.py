"""What people are told of what is kept of their homes."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.geojson import Document


class LogEntry(Document):
    """What somebody did with a robot's maps; the same by the same within an hour is one entry."""

    at: datetime
    """The last time."""
    who: str
    did: Literal["look", "change", "plan"]
    """`plan`: who runs the service looked at the floor plan, with the owner's leave."""
    what: str
    source: str | None
    """The network that it came from."""
    times: int


class Retention(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    days: Annotated[int, Field(ge=7, le=3650)] | None
    """So long what robots sensed is kept; null: as long as the home."""


class RetentionDocument(Document):
    days: int | None
    newest: int
    """So many versions of each map keep what was sensed in any case."""
    missions: int
    """Whose grids are older and would be deleted now."""
    effect: str
    """In words."""


class Imported(Document):
    """What an archive brought."""

    robot: str
    maps: list[str]
    versions: int
    missions: int


class ImportedHome(Document):
    robots: list[Imported]
    """One that is not one's own is maps without a robot: see `kept_from` of robots."""


class Erased(Document):
    """What there was, and is not any more."""

    robots: list[str]
    maps: int
    missions: int
