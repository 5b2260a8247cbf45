"""Robots as those see them who own or register them."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.geojson import Document


class RobotDocument(Document):
    id: str
    name: str
    owner: str | None
    created_at: datetime
    token_made_at: datetime | None
    """None: it was revoked, and the robot is shut out."""
    released_at: datetime | None
    """Its owner gave it up, and nobody has claimed it since: until then it uploads nothing."""
    kept_from: str | None
    """No robot, but the maps that its owner kept of one that was given up: its id."""


class RobotChange(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    name: Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]


class RobotToken(Document):
    robot: str
    token: str
    """Shown this once."""


class ClaimCode(Document):
    robot: str
    claim_code: str
    """Shown this once: for whoever has the robot from now on."""


class Claim(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")

    claim_code: Annotated[str, Field(min_length=8, max_length=40)]
