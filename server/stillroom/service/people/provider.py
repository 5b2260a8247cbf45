"""People that an identity provider vouches for. It says who somebody is; who may come in, is decided here, by invitation."""

from stillroom.errors import Forbidden
from stillroom.service.accounts import address
from stillroom.service.people import links, sessions
from stillroom.service.people.sessions import Browser, SignedIn
from stillroom.store import clock, people
from stillroom.store.database import Database, Transaction
from stillroom.store.people import AccountRow


def by_provider(
    database: Database, issuer: str, subject: str, email: str | None, verified: bool, browser: Browser
) -> SignedIn:
    """Signs somebody in whom the provider knows as `subject`.

    At first by the e-mail address, where the provider has verified it; from then on by `subject` alone, so that whoever is
    given the same address later does not get the account. Raises Forbidden for who was not invited.
    """
    key = sessions.device_key(database)
    with database.write() as tx:
        account = people.by_subject(tx, issuer, subject)
        if account is None and email is not None and verified:
            account = _first(tx, issuer, subject, address(email))
        if account is None or account.disabled_at is not None:
            raise Forbidden("Nobody with this e-mail address is invited here.")
        return sessions.begin(tx, account.email, "oidc", browser, key)


def _first(tx: Transaction, issuer: str, subject: str, email: str) -> AccountRow | None:
    now = clock.now(tx)
    invitations = people.invitations_of(tx, email, now)
    account = people.find_or_add(tx, email, now) if invitations else people.find(tx, email)
    if account is None or account.subject is not None or account.disabled_at is not None:
        return None
    for invitation in invitations:
        links.apply(tx, invitation, account, None, now)
        people.use_link(tx, invitation.hash, now)
    people.change(tx, email, {"issuer": issuer, "subject": subject})
    return account
