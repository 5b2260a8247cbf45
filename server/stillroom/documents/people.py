"""People: how they get in, their accounts, and the people of their homes."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from stillroom.documents.geojson import Document

Email = Annotated[str, Field(max_length=320, pattern=r"^[^@\s\x00-\x1f\x7f]+@[^@\s\x00-\x1f\x7f]+$")]
Password = Annotated[str, Field(max_length=1000)]
Secret = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[A-Za-z0-9_-]+$")]
HomeRole = Literal["member", "viewer"]
DutyName = Literal["operator", "engineer"]
ScopeName = Literal["maps:read", "maps:edit", "fleet:read", "fleet:triage", "messages", "robots", "archives"]
Purpose = Literal["sign_in", "invitation", "reset"]


class _Asked(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")


class Ways(Document):
    """How people can get in."""

    password: bool
    provider: str | None
    """What the identity provider is called, where there is one; its sign-in begins at `/oidc/start`."""
    mail: bool
    """Whether a forgotten password can be set anew by a link in an e-mail."""


class PasswordSignIn(_Asked):
    email: Email
    password: Password


class ResetRequest(_Asked):
    email: Email


class LinkToken(_Asked):
    token: Secret


class LinkUse(_Asked):
    token: Secret
    password: Password | None = None
    """For who has none yet, or forgot it."""


class LinkDocument(Document):
    purpose: Purpose
    email: str | None
    home: str | None
    """Whose home it invites to."""
    role: HomeRole | None
    duty: DutyName | None
    needs_password: bool


class LinkUsed(Document):
    signed_in: bool
    """False: somebody who has an account has joined a home, and signs in as always."""


class OneTimeLink(Document):
    url: str | None
    """Shown this once. null: it was sent by e-mail."""
    expires_at: datetime


class AccountDocument(Document):
    id: str
    email: str
    duty: DutyName | None
    has_password: bool
    has_provider: bool
    """Whether an identity provider has vouched for this person."""
    created_at: datetime
    disabled_at: datetime | None


class OwnAccount(Document):
    email: str | None
    """null: an operator who has no account."""
    duty: DutyName | None
    has_password: bool
    has_provider: bool


class PasswordChange(_Asked):
    current: Password | None = None
    """Needed where there is one."""
    new: Password


class SessionDocument(Document):
    id: str
    way: Literal["link", "password", "invitation", "reset", "oidc"]
    agent: str
    """What the browser says it is."""
    created_at: datetime
    seen_at: datetime
    expires_at: datetime
    current: bool


class NewToken(_Asked):
    name: Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]
    scopes: Annotated[list[ScopeName], Field(min_length=1, max_length=7)]
    days: Annotated[int, Field(ge=1, le=3650)] | None = None
    """None: until it is revoked."""


class TokenDocument(Document):
    id: str
    name: str
    scopes: list[ScopeName]
    created_at: datetime
    expires_at: datetime | None
    seen_at: datetime | None


class CreatedToken(TokenDocument):
    token: str
    """Shown this once."""


class MemberDocument(Document):
    id: str
    home: str
    """Whose home it is."""
    email: str
    role: HomeRole
    since: datetime


class InvitationDocument(Document):
    id: str
    email: str
    role: HomeRole | None
    duty: DutyName | None
    created_at: datetime
    expires_at: datetime


class Household(Document):
    people: list[MemberDocument]
    invitations: list[InvitationDocument]
    homes: list[MemberDocument]
    """Of others, that one belongs to."""


class NewInvitation(_Asked):
    email: Email
    role: HomeRole


class RoleChange(_Asked):
    role: HomeRole


class NewAccount(_Asked):
    email: Email
    duty: DutyName | None = None


class AccountChange(_Asked):
    duty: DutyName | None = None
    """null: neither; left out: as it is."""
    disabled: bool | None = None
