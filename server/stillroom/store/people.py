"""Accounts, and what signs people in: sessions, links, tokens."""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.rows import as_row, as_row_or_none, columns
from stillroom.store.tables import account, api_token, link, membership, session


@dataclass(frozen=True)
class AccountRow:
    email: str
    key: str
    password_hash: str | None
    duty: str | None
    issuer: str | None
    subject: str | None
    created_at: datetime
    disabled_at: datetime | None


@dataclass(frozen=True)
class SessionRow:
    hash: str
    key: str
    email: str | None
    way: str
    agent: str
    created_at: datetime
    seen_at: datetime
    expires_at: datetime


@dataclass(frozen=True)
class LinkRow:
    hash: str
    key: str
    purpose: str
    email: str | None
    home: str | None
    role: str | None
    duty: str | None
    made_by: str | None
    created_at: datetime
    expires_at: datetime
    used_at: datetime | None


@dataclass(frozen=True)
class TokenRow:
    hash: str
    key: str
    email: str
    name: str
    scopes: Sequence[str]
    created_at: datetime
    expires_at: datetime | None
    seen_at: datetime | None


_ACCOUNT = sa.select(*columns(account, AccountRow))
_SESSION = sa.select(*columns(session, SessionRow))
_LINK = sa.select(*columns(link, LinkRow))
_TOKEN = sa.select(*columns(api_token, TokenRow))


def new_key(kind: str) -> str:
    """What the API calls something, for ever."""
    return f"{kind}_{secrets.token_urlsafe(16)}"


# -- accounts ------------------------------------------------------------------------------------------------------


def find(tx: Transaction, email: str) -> AccountRow | None:
    return as_row_or_none(AccountRow, tx.execute(_ACCOUNT.where(account.c.email == email)).first())


def by_key(tx: Transaction, key: str) -> AccountRow | None:
    return as_row_or_none(AccountRow, tx.execute(_ACCOUNT.where(account.c.key == key)).first())


def find_or_add(tx: Transaction, email: str, now: datetime) -> AccountRow:
    insert_unless_there(tx, account, {"email": email, "key": new_key("account"), "created_at": now})
    return as_row(AccountRow, tx.execute(_ACCOUNT.where(account.c.email == email)).one())


def by_subject(tx: Transaction, issuer: str, subject: str) -> AccountRow | None:
    """As an identity provider knows somebody."""
    theirs = account.c.issuer == issuer, account.c.subject == subject
    return as_row_or_none(AccountRow, tx.execute(_ACCOUNT.where(*theirs)).first())


def change(tx: Transaction, email: str, values: Mapping[str, Any]) -> None:
    tx.execute(sa.update(account).where(account.c.email == email).values(dict(values)))


def page(tx: Transaction, after: str, limit: int) -> Sequence[AccountRow]:
    """In order of their addresses."""
    query = _ACCOUNT.where(account.c.email > after).order_by(account.c.email).limit(limit)
    return [as_row(AccountRow, row) for row in tx.execute(query)]


def with_duty(tx: Transaction, duty: str) -> Sequence[str]:
    """Addresses of those whose accounts work."""
    query = sa.select(account.c.email).where(account.c.duty == duty, account.c.disabled_at.is_(None))
    return tx.execute(query.order_by(account.c.email)).scalars().all()


# -- sessions ------------------------------------------------------------------------------------------------------


def add_session(tx: Transaction, new: SessionRow) -> None:
    tx.execute(sa.delete(session).where(session.c.expires_at <= new.created_at))
    tx.execute(sa.insert(session).values(vars(new)))


def session_by(tx: Transaction, session_hash: str, now: datetime) -> SessionRow | None:
    query = _SESSION.where(session.c.hash == session_hash, session.c.expires_at > now)
    return as_row_or_none(SessionRow, tx.execute(query).first())


def sessions_of(tx: Transaction, email: str | None, now: datetime) -> Sequence[SessionRow]:
    """The newest first."""
    query = _SESSION.where(_whose(session, email), session.c.expires_at > now)
    return [as_row(SessionRow, row) for row in tx.execute(query.order_by(session.c.created_at.desc(), session.c.key))]


def see_session(tx: Transaction, session_hash: str, now: datetime) -> None:
    tx.execute(sa.update(session).where(session.c.hash == session_hash).values(seen_at=now))


def end_session(tx: Transaction, session_hash: str) -> None:
    tx.execute(sa.delete(session).where(session.c.hash == session_hash))


def end_session_of(tx: Transaction, email: str | None, key: str) -> bool:
    """Whether there was one."""
    query = sa.delete(session).where(_whose(session, email), session.c.key == key).returning(session.c.key)
    return tx.execute(query).first() is not None


def end_sessions(tx: Transaction, email: str | None, but: str | None = None) -> None:
    """All of a person, `but` the one with this hash."""
    query = sa.delete(session).where(_whose(session, email))
    tx.execute(query if but is None else query.where(session.c.hash != but))


def _whose(table: sa.Table, email: str | None) -> sa.ColumnElement[bool]:
    return table.c.email.is_(None) if email is None else table.c.email == email


# -- links ---------------------------------------------------------------------------------------------------------


def add_link(tx: Transaction, new: LinkRow) -> None:
    tx.execute(sa.insert(link).values(vars(new)))


def link_by(tx: Transaction, link_hash: str, now: datetime) -> LinkRow | None:
    """None where it was used, has expired or never was."""
    return as_row_or_none(LinkRow, tx.execute(_LINK.where(link.c.hash == link_hash, *_works(now))).first())


def use_link(tx: Transaction, link_hash: str, now: datetime) -> LinkRow | None:
    """The link, once."""
    used = (
        sa.update(link).where(link.c.hash == link_hash, *_works(now)).values(used_at=now)
    ).returning(*columns(link, LinkRow))  # fmt: skip
    return as_row_or_none(LinkRow, tx.execute(used).first())


def invitations(tx: Transaction, home: str | None, now: datetime) -> Sequence[LinkRow]:
    """That nobody has accepted yet, to a home; None: those to the service."""
    to = link.c.home.is_(None) if home is None else link.c.home == home
    query = _LINK.where(link.c.purpose == "invitation", to, *_works(now)).order_by(link.c.created_at, link.c.key)
    return [as_row(LinkRow, row) for row in tx.execute(query)]


def invitations_of(tx: Transaction, email: str, now: datetime) -> Sequence[LinkRow]:
    """That somebody has not accepted yet."""
    query = _LINK.where(link.c.purpose == "invitation", link.c.email == email, *_works(now))
    return [as_row(LinkRow, row) for row in tx.execute(query.order_by(link.c.created_at, link.c.key))]


def withdraw(tx: Transaction, home: str | None, key: str) -> bool:
    """Whether there was such an invitation."""
    to = link.c.home.is_(None) if home is None else link.c.home == home
    query = sa.delete(link).where(link.c.purpose == "invitation", to, link.c.key == key).returning(link.c.key)
    return tx.execute(query).first() is not None


def drop_links(tx: Transaction, email: str, purpose: str, home: str | None = None) -> None:
    """Those of a person that were not used yet: a newer one takes their place."""
    mine = link.c.email == email, link.c.purpose == purpose, link.c.used_at.is_(None)
    to = link.c.home.is_(None) if home is None else link.c.home == home
    tx.execute(sa.delete(link).where(*mine, to))


def _works(now: datetime) -> tuple[sa.ColumnElement[bool], ...]:
    return link.c.used_at.is_(None), link.c.expires_at > now


# -- tokens of programs --------------------------------------------------------------------------------------------


def add_token(tx: Transaction, new: TokenRow) -> None:
    tx.execute(sa.insert(api_token).values(vars(new)))


def token_by(tx: Transaction, token_hash: str, now: datetime) -> TokenRow | None:
    lasts = sa.or_(api_token.c.expires_at.is_(None), api_token.c.expires_at > now)
    return as_row_or_none(TokenRow, tx.execute(_TOKEN.where(api_token.c.hash == token_hash, lasts)).first())


def tokens_of(tx: Transaction, email: str) -> Sequence[TokenRow]:
    """The newest first."""
    query = _TOKEN.where(api_token.c.email == email).order_by(api_token.c.created_at.desc(), api_token.c.key)
    return [as_row(TokenRow, row) for row in tx.execute(query)]


def see_token(tx: Transaction, token_hash: str, now: datetime) -> None:
    tx.execute(sa.update(api_token).where(api_token.c.hash == token_hash).values(seen_at=now))


def end_token(tx: Transaction, email: str, key: str) -> bool:
    """Whether there was one."""
    mine = api_token.c.email == email, api_token.c.key == key
    return tx.execute(sa.delete(api_token).where(*mine).returning(api_token.c.key)).first() is not None


def end_tokens(tx: Transaction, email: str) -> None:
    tx.execute(sa.delete(api_token).where(api_token.c.email == email))


# -- people of homes -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MembershipRow:
    id: int
    key: str
    home: str
    email: str
    role: str
    since: datetime


_MEMBERSHIP = sa.select(*columns(membership, MembershipRow))


def role_in(tx: Transaction, home: str, email: str) -> str | None:
    mine = membership.c.home == home, membership.c.email == email
    role: str | None = tx.execute(sa.select(membership.c.role).where(*mine)).scalar()
    return role


def members_of(tx: Transaction, home: str) -> Sequence[MembershipRow]:
    return _memberships(tx, membership.c.home == home)


def homes_of(tx: Transaction, email: str) -> Sequence[MembershipRow]:
    return _memberships(tx, membership.c.email == email)


def join(tx: Transaction, home: str, email: str, role: str, now: datetime) -> None:
    """In another role than before, where somebody is there already."""
    new = {"key": new_key("member"), "home": home, "email": email, "role": role, "since": now}
    if not insert_unless_there(tx, membership, new):
        mine = membership.c.home == home, membership.c.email == email
        tx.execute(sa.update(membership).where(*mine).values(role=role))


def change_role(tx: Transaction, home: str, key: str, role: str) -> bool:
    """Whether there was such a member."""
    one = sa.update(membership).where(membership.c.home == home, membership.c.key == key)
    return tx.execute(one.values(role=role).returning(membership.c.key)).first() is not None


def part(tx: Transaction, key: str, email: str) -> bool:
    """Ends a membership, by the home's owner or by who is the member. Whether there was one."""
    theirs = sa.or_(membership.c.home == email, membership.c.email == email)
    one = sa.delete(membership).where(membership.c.key == key, theirs)
    return tx.execute(one.returning(membership.c.key)).first() is not None


def _memberships(tx: Transaction, which: sa.ColumnElement[bool]) -> Sequence[MembershipRow]:
    query = _MEMBERSHIP.where(which).order_by(membership.c.id)
    return [as_row(MembershipRow, row) for row in tx.execute(query)]
