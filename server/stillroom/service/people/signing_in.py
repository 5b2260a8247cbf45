"""Signing in by password, so that guessing is slow, nobody is shut out by others, and nobody learns who has an account."""

from datetime import timedelta

from stillroom.errors import Forbidden, Unauthenticated
from stillroom.service.accounts import address
from stillroom.service.people import passwords, sessions
from stillroom.service.people.sessions import Browser, SignedIn
from stillroom.service.people.throttling import Limit, Tries, clear, forgive, take
from stillroom.store import people
from stillroom.store.database import Database

_HOUR = timedelta(hours=1)
FROM_HERE = Limit("sign-in/person and source", 5, timedelta(seconds=15), timedelta(minutes=15), _HOUR)
SOURCE = Limit("sign-in/source", 50, timedelta(seconds=30), timedelta(minutes=15), _HOUR)
ANYWHERE = Limit("sign-in/person", 100, timedelta(seconds=30), timedelta(minutes=15), 24 * _HOUR)
"""Of all sources together. Browsers that the person has signed in with are not counted here, and never wait for others."""
DEVICE = Limit("sign-in/known browser", 10, timedelta(seconds=15), timedelta(minutes=15), _HOUR)
_REFUSED = "The e-mail address or the password is not right."


def by_password(database: Database, email: str, password: str, browser: Browser) -> SignedIn:
    """Raises Unauthenticated, the same for whatever is wrong, and TooMany."""
    email, key = address(email), sessions.device_key(database)
    tries = _tries(email, browser, key)
    take(database, *tries)
    with database.read() as tx:
        account = people.find(tx, email)
    password_hash = None if account is None else account.password_hash
    # The same work whether there is such an account or not, and whether it has a password or not.
    right = passwords.matches(password_hash, password)
    if not right or account is None or password_hash is None or account.disabled_at is not None:
        raise Unauthenticated(_REFUSED)
    clear(database, tries[0])
    forgive(database, *tries[1:])
    renewed = passwords.rehashed(password_hash, password)
    with database.write() as tx:
        if renewed is not None:
            people.change(tx, email, {"password_hash": renewed})
        return sessions.begin(tx, email, "password", browser, key)


def _tries(email: str, browser: Browser, key: bytes) -> tuple[Tries, ...]:
    """What a try counts against. The first of them is forgotten when it was right."""
    known = sessions.known_device(browser.device, email, key)
    if known is not None:
        return (Tries(DEVICE, (email, known)),)
    return (
        Tries(FROM_HERE, (email, browser.source)),
        Tries(SOURCE, (browser.source,)),
        Tries(ANYWHERE, (email,)),
    )


def check_own(database: Database, email: str, password: str | None, password_hash: str | None) -> None:
    """Before somebody who is signed in changes the password: it is the person, and not the browser left open.

    Raises Forbidden, TooMany.
    """
    if password_hash is None:
        return
    tries = Tries(DEVICE, (email, "own"))
    take(database, tries)
    if password is None or not passwords.matches(password_hash, password):
        raise Forbidden("The current password is not right.")
    clear(database, tries)
