"""What people choose to be told, and where webhooks go, as the API has them."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.geojson import Document

MessageKind = Literal["conflict", "parked", "room"]
"""A question about a map; which floor a mission belongs to; a room that is new."""
WebhookType = Literal[
    "conflict.opened", "conflict.resolved", "conflict.closed", "mission.parked", "map.updated", "room.discovered",
    "rollout.advanced", "rollout.halted", "rollout.successful", "rollout.ended", "alert.raised", "alert.ended",
]  # fmt: skip
"""Of rollouts and alerts programs of the whole fleet are told, and no others."""
Language = Literal["en", "de"]
DeliveryState = Literal["waiting", "delivered", "dead"]
Label = Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
Address = Annotated[
    str, Field(max_length=320, pattern=r"^[^\s@<>\"',;:\\()\[\]\x00-\x20\x7f]+@[^\s@<>\"',;:\\()\[\]\x00-\x20\x7f]+$")
]
Url = Annotated[str, Field(max_length=2000, pattern=r"^[\x21-\x7e]+$")]
Kinds = Annotated[list[MessageKind], Field(max_length=10)]
Types = Annotated[list[WebhookType], Field(min_length=1, max_length=20)]
Base64Url = Annotated[str, Field(max_length=200, pattern=r"^[A-Za-z0-9_-]+=*$")]


class EmailDocument(Document):
    available: bool
    """Whether this service sends e-mail at all."""
    address: str | None
    confirmed: bool
    """Nothing but the link that confirms it is sent before."""
    suggested: str | None
    kinds: list[MessageKind]
    trouble: str | None
    """Why the last message could not be delivered."""


class PushSubscriptionDocument(Document):
    id: str
    label: str
    created_at: datetime
    delivered_at: datetime | None
    """When it took the last message."""
    trouble: str | None


class PushDocument(Document):
    public_key: str
    """The `applicationServerKey` to subscribe with."""
    kinds: list[MessageKind]
    subscriptions: list[PushSubscriptionDocument]


class NotificationSettings(Document):
    language: Language | None
    """Of all messages; null: nobody has chosen one, and the first browser to subscribe brings its own."""
    email: EmailDocument
    push: PushDocument


class NotificationChoice(BaseModel):
    """What is left out stays as it is."""

    model_config = ConfigDict(extra="forbid")

    email: Kinds | None = None
    push: Kinds | None = None
    language: Language | None = None


class NewEmail(BaseModel):
    model_config = ConfigDict(extra="forbid")

    address: Address
    language: Language | None = None
    """For all messages, where the person has not chosen one."""


class PushKeys(BaseModel):
    model_config = ConfigDict(extra="forbid")

    p256dh: Base64Url
    auth: Base64Url


class NewPushSubscription(BaseModel):
    """As `PushSubscription.toJSON()` has it, with a name for the browser."""

    model_config = ConfigDict(extra="forbid", populate_by_name=True)

    endpoint: Url
    keys: PushKeys
    expiration_time: float | None = Field(default=None, alias="expirationTime")
    label: Label = ""
    language: Language | None = None
    """For all messages, where the person has not chosen one."""


class NewWebhook(BaseModel):
    model_config = ConfigDict(extra="forbid")

    url: Url
    types: Types | None = None
    """Null: all."""
    label: Label = ""
    scope: Literal["own", "fleet"] = "own"
    """`fleet`: of all robots, whoever owns them, without names; for operators."""


class WebhookChange(BaseModel):
    """What is left out stays as it is."""

    model_config = ConfigDict(extra="forbid")

    url: Url | None = None
    types: Types | None = None
    label: Label | None = None
    enabled: bool | None = None


class WebhookDocument(Document):
    id: str
    url: str
    types: list[WebhookType]
    label: str
    scope: Literal["own", "fleet"]
    enabled: bool
    disabled_reason: str | None
    created_at: datetime
    delivered_at: datetime | None
    """When it took the last message."""
    failing_since: datetime | None
    failures: int
    """Attempts that failed since it took one."""


class WebhookWithSecret(WebhookDocument):
    secret: str
    """`whsec_…`; shown this once."""


class DeliveryDocument(Document):
    id: int
    message: str
    """The `webhook-id`; equal for a replay."""
    type: str
    state: DeliveryState
    attempts: int
    created_at: datetime
    tried_at: datetime | None
    next_at: datetime | None
    """When it is tried again."""
    status_code: int | None
    """Of the receiver's last answer."""
    reason: str | None
    """Why the last attempt failed."""
    body: dict[str, Any]
