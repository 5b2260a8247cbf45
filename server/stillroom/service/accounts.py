"""Who calls: tokens, sessions and links become principals."""

import hmac
from datetime import timedelta

from stillroom.errors import Unauthenticated
from stillroom.service.access import OPERATOR, Person, Principal, Robot, Scope
from stillroom.service.people import sessions
from stillroom.service.people.sessions import Browser, SignedIn
from stillroom.service.people.tokens import PERSON, hash_of, new_secret
from stillroom.store import clock, people, robots
from stillroom.store.database import Database
from stillroom.store.people import LinkRow

LINK_LIFE = timedelta(hours=24)
_SEEN_EVERY = timedelta(minutes=10)


def by_token(database: Database, token: str, admin_token: str | None) -> Principal:
    """Raises Unauthenticated."""
    if admin_token is not None and hmac.compare_digest(token.encode(), admin_token.encode()):
        return OPERATOR
    if token.startswith(PERSON):
        return _by_person_token(database, token)
    with database.look() as tx:
        found = robots.by_token(tx, hash_of(token))
    if found is None:
        raise Unauthenticated("The token is not valid.")
    return Robot(*found)


def _by_person_token(database: Database, token: str) -> Person:
    digest = hash_of(token)
    with database.read() as tx:
        now = clock.now(tx)
        row = people.token_by(tx, digest, now)
        account = None if row is None else people.find(tx, row.email)
    if row is None:
        raise Unauthenticated("The token is not valid.")
    person = sessions.of_account(account)
    if row.seen_at is None or now - row.seen_at > _SEEN_EVERY:
        with database.write(durable=False) as tx:
            people.see_token(tx, digest, now)
    scopes: frozenset[Scope] = frozenset(row.scopes)  # type: ignore[arg-type]  # checked when it was made
    return Person(person.email, person.duty, scopes)


def by_session(database: Database, cookie: str) -> Person:
    """Raises Unauthenticated."""
    return sessions.person(database, cookie)


def new_login_link(database: Database, email: str | None = None, life: timedelta = LINK_LIFE) -> str:
    """The secret of a link that signs one browser in, once; an operator's without an address."""
    secret, owner = new_secret(), None if email is None else address(email)
    with database.write() as tx:
        now = clock.now(tx)
        people.add_link(
            tx,
            LinkRow(
                hash_of(secret), people.new_key("link"), "sign_in", owner, None, None, None, None, now, now + life, None
            ),
        )
    return secret


def has_operator(database: Database) -> bool:
    """Whether somebody has an account with that duty, and needs no link that is printed."""
    with database.read() as tx:
        return bool(people.with_duty(tx, "operator"))


def of_link(database: Database, link_secret: str) -> str | None:
    """Whom a link signs in that works still; None: nobody."""
    with database.read() as tx:
        row = people.link_by(tx, hash_of(link_secret), clock.now(tx))
    return None if row is None or row.purpose != "sign_in" else row.email or "operator"


def sign_in(database: Database, link_secret: str) -> str:
    """Uses a link up; answers with the session's cookie. Raises Unauthenticated."""
    return follow(database, link_secret, Browser()).session


def follow(database: Database, link_secret: str, browser: Browser) -> SignedIn:
    """Uses a link up that signs in; whoever it is for has an account from now on. Raises Unauthenticated."""
    key = sessions.device_key(database)
    with database.write() as tx:
        now = clock.now(tx)
        known = people.link_by(tx, hash_of(link_secret), now)
        used = people.use_link(tx, known.hash, now) if known is not None and known.purpose == "sign_in" else None
        if used is None:
            raise Unauthenticated("This sign-in link was used already or has expired.")
        if used.email is not None:
            sessions.of_account(people.find_or_add(tx, used.email, now))
        return sessions.begin(tx, used.email, "link", browser, key)


def sign_out(database: Database, cookie: str) -> None:
    with database.write() as tx:
        people.end_session(tx, hash_of(cookie))


def address(email: str) -> str:
    """As it is compared: nobody has two mailboxes that differ in capitals."""
    return email.strip().lower()
