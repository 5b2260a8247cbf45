"""Sessions of browsers: begun anew with each sign-in, ended by their person, listed on the account page."""

import hmac
import secrets
from dataclasses import dataclass
from datetime import timedelta
from hashlib import sha256
from typing import Literal

from stillroom.errors import Unauthenticated
from stillroom.service.access import OPERATOR, Duty, Person
from stillroom.service.people.tokens import hash_of, new_secret
from stillroom.store import clock, people, receivers
from stillroom.store.database import Database, Transaction
from stillroom.store.people import AccountRow, SessionRow

LIFE = timedelta(days=30)
_SEEN_EVERY = timedelta(minutes=10)
_KNOWN_TO = "devices"
Way = Literal["link", "password", "invitation", "reset", "oidc"]


@dataclass(frozen=True)
class Browser:
    """What there is to know of who signs in, before it is known who that is."""

    source: str = ""
    """Where the request comes from: see `throttling.network`."""
    agent: str = ""
    session: str | None = None
    """Of the cookie, of whomever: it ends when somebody signs in."""
    device: str | None = None
    """Of the cookie that says who has signed in here before."""


@dataclass(frozen=True)
class SignedIn:
    email: str | None
    session: str
    """The session's cookie."""
    device: str | None
    """The cookie by which this browser is known to its person from now on."""


def begin(tx: Transaction, email: str | None, way: Way, browser: Browser, device_key: bytes) -> SignedIn:
    """A new session, whatever cookie the browser sent: nobody can know it beforehand."""
    now, secret = clock.now(tx), new_secret()
    if browser.session is not None:
        people.end_session(tx, hash_of(browser.session))
    agent = " ".join(browser.agent.split())[:300]
    key = people.new_key("session")
    people.add_session(tx, SessionRow(hash_of(secret), key, email, way, agent, now, now, now + LIFE))
    return SignedIn(email, secret, None if email is None else _device(email, device_key))


def person(database: Database, cookie: str) -> Person:
    """Who is signed in. Raises Unauthenticated."""
    digest = hash_of(cookie)
    with database.read() as tx:
        now = clock.now(tx)
        row = people.session_by(tx, digest, now)
        account = None if row is None or row.email is None else people.find(tx, row.email)
    if row is None:
        raise Unauthenticated("The session has ended: sign in again.")
    found = OPERATOR if row.email is None else of_account(account)
    if now - row.seen_at > _SEEN_EVERY:
        with database.write(durable=False) as tx:
            people.see_session(tx, digest, now)
    return found


def of_account(account: AccountRow | None) -> Person:
    """Raises Unauthenticated where there is none, or it was switched off."""
    if account is None or account.disabled_at is not None:
        raise Unauthenticated("This account does not work any more: ask who runs the service.")
    duties: dict[str | None, Duty] = {"operator": "operator", "engineer": "engineer"}
    return Person(account.email, duties.get(account.duty))


# -- known devices -------------------------------------------------------------------------------------------------


def device_key(database: Database) -> bytes:
    with database.read() as tx:
        known = receivers.known_secret(tx, _KNOWN_TO)
    if known is None:
        with database.write() as tx:
            known = receivers.service_secret(tx, _KNOWN_TO, secrets.token_hex(32))
    return bytes.fromhex(known)


def _device(email: str, key: bytes) -> str:
    name = secrets.token_urlsafe(12)
    return f"{name}.{_mac(email, name, key)}"


def known_device(cookie: str | None, email: str, key: bytes) -> str | None:
    """Its name, where `email` has signed in with this browser before."""
    name, _, mac = (cookie or "").partition(".")
    return name if name and hmac.compare_digest(_mac(email, name, key).encode(), mac.encode()) else None


def _mac(email: str, name: str, key: bytes) -> str:
    return hmac.new(key, f"{name}\n{email}".encode(), sha256).hexdigest()
