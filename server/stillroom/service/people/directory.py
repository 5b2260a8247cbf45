"""Accounts as operators see them: who there is, and with which duty; nothing of what is theirs."""

from typing import Any

from stillroom.documents.api import Page
from stillroom.documents.people import AccountChange, AccountDocument, InvitationDocument
from stillroom.errors import InvalidInput, NotFound
from stillroom.service.access import Person
from stillroom.service.paging import page_of
from stillroom.service.people.homes import invitation
from stillroom.store import clock, people
from stillroom.store.database import Database
from stillroom.store.people import AccountRow


def list_accounts(database: Database, after: str, limit: int) -> Page[AccountDocument]:
    with database.read() as tx:
        rows, following = page_of(people.page(tx, after, limit + 1), limit, lambda row: row.email)
    return Page(items=[_document(row) for row in rows], next=following)


def list_invitations(database: Database) -> list[InvitationDocument]:
    with database.read() as tx:
        return [invitation(row) for row in people.invitations(tx, None, clock.now(tx))]


def withdraw(database: Database, key: str) -> None:
    """Raises NotFound."""
    with database.write() as tx:
        if not people.withdraw(tx, None, key):
            raise NotFound(f"There is no invitation {key}.")


def change(database: Database, caller: Person, key: str, wanted: AccountChange) -> AccountDocument:
    """Raises NotFound, and InvalidInput for an operator who would shut themselves out."""
    with database.write() as tx:
        row = people.by_key(tx, key)
        if row is None:
            raise NotFound(f"There is no account {key}.")
        if row.email == caller.email:
            raise InvalidInput("Another operator may change your account: so that nobody shuts themselves out.")
        values: dict[str, Any] = {}
        if "duty" in wanted.model_fields_set:
            values["duty"] = wanted.duty
        if wanted.disabled is not None:
            values["disabled_at"] = (row.disabled_at or clock.now(tx)) if wanted.disabled else None
        if values:
            people.change(tx, row.email, values)
        if wanted.disabled:
            people.end_sessions(tx, row.email)
        made = people.by_key(tx, key)
    assert made is not None
    return _document(made)


def _document(row: AccountRow) -> AccountDocument:
    return AccountDocument.model_validate(
        {
            "id": row.key,
            "email": row.email,
            "duty": row.duty,
            "has_password": row.password_hash is not None,
            "has_provider": row.subject is not None,
            "created_at": row.created_at,
            "disabled_at": row.disabled_at,
        }
    )
