"""People of a home: its owner invites members, who edit, and viewers, who look."""

from stillroom.documents.people import Household, InvitationDocument, MemberDocument
from stillroom.errors import NotFound
from stillroom.service.access import Person
from stillroom.store import clock, people
from stillroom.store.database import Database
from stillroom.store.people import LinkRow, MembershipRow


def household(database: Database, caller: Person) -> Household:
    """Of the caller's own home, and those of others that the caller belongs to."""
    own = caller.email or ""
    with database.read() as tx:
        return Household(
            people=[_member(row) for row in people.members_of(tx, own)],
            invitations=[invitation(row) for row in people.invitations(tx, own, clock.now(tx))],
            homes=[_member(row) for row in people.homes_of(tx, own)],
        )


def change_role(database: Database, caller: Person, key: str, role: str) -> None:
    """Of somebody in the caller's home. Raises NotFound."""
    with database.write() as tx:
        if not people.change_role(tx, caller.email or "", key, role):
            raise NotFound(f"There is no member {key}.")


def part(database: Database, caller: Person, key: str) -> None:
    """Somebody of the caller's home, or the caller of somebody's. Raises NotFound."""
    with database.write() as tx:
        if not people.part(tx, key, caller.email or ""):
            raise NotFound(f"There is no member {key}.")


def withdraw(database: Database, caller: Person, key: str) -> None:
    """An invitation to the caller's home. Raises NotFound."""
    with database.write() as tx:
        if not people.withdraw(tx, caller.email or "", key):
            raise NotFound(f"There is no invitation {key}.")


def invitation(row: LinkRow) -> InvitationDocument:
    names = ("email", "role", "duty", "created_at", "expires_at")
    return InvitationDocument.model_validate({"id": row.key} | {name: getattr(row, name) for name in names})


def _member(row: MembershipRow) -> MemberDocument:
    names = ("home", "email", "role", "since")
    return MemberDocument.model_validate({"id": row.key} | {name: getattr(row, name) for name in names})
