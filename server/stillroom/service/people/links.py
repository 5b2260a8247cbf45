"""Links that work once and for a while: invitations, and new passwords. What they hold is random and kept as a hash."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from urllib.parse import quote

import structlog

from stillroom.documents.people import LinkDocument, OneTimeLink
from stillroom.errors import AlreadyExists, Fault, InvalidInput, NotFound, TooMany, Unavailable
from stillroom.service.access import Duty, Person, signature
from stillroom.service.accounts import address, new_login_link
from stillroom.service.messages.words import Words
from stillroom.service.people import letters, passwords, sessions
from stillroom.service.people.sessions import Browser, SignedIn
from stillroom.service.people.throttling import Limit, Tries, take
from stillroom.service.people.tokens import hash_of, new_secret
from stillroom.service.people.words import Occasion
from stillroom.settings import Messaging
from stillroom.store import clock, people
from stillroom.store.database import Database, Transaction
from stillroom.store.people import AccountRow, LinkRow

INVITED_FOR = timedelta(days=7)
RESET_WITHIN = timedelta(hours=1)
OTHER_BROWSER_WITHIN = timedelta(minutes=10)
MOST_INVITATIONS = 20
_DAY = timedelta(days=1)
INVITATIONS = Limit("invitations", 30, timedelta(minutes=10), timedelta(hours=6), _DAY)
RESETS = Limit("new passwords/person", 3, timedelta(minutes=10), timedelta(hours=6), _DAY)
RESETS_FROM = Limit("new passwords/source", 20, timedelta(minutes=1), timedelta(hours=1), _DAY)
FOLLOWING = Limit("links/source", 50, timedelta(seconds=10), timedelta(minutes=15), timedelta(hours=1))
log = structlog.get_logger()


@dataclass(frozen=True)
class Post:
    """By what letters go, and in whose words."""

    messaging: Messaging
    words: Words


def invite_home(database: Database, caller: Person, email: str, role: str, by: Post) -> None:
    """Asks somebody into the caller's home, by e-mail: nobody else may see the link, because it makes an account.

    Raises Unavailable, AlreadyExists, TooMany, InvalidInput.
    """
    home, to = caller.email or "", address(email)
    server = letters.server_of(by.messaging)
    if to == home:
        raise InvalidInput("This is your own home.", (Fault("/email", "your own address"),))
    take(database, Tries(INVITATIONS, (home,)))
    with database.write() as tx:
        if people.role_in(tx, home, to) is not None:
            raise AlreadyExists(f"{to} belongs to your home already.")
        if len(people.invitations(tx, home, clock.now(tx))) >= MOST_INVITATIONS:
            raise InvalidInput(f"{MOST_INVITATIONS} invitations wait already: withdraw one first.")
        people.drop_links(tx, to, "invitation", home)
        secret, row = _add(tx, "invitation", to, INVITED_FOR, caller, home=home, role=role)
    occasion: Occasion = "member" if role == "member" else "viewer"
    url = f"{by.messaging.public_url}/invitation#{secret}"
    _post_or_drop(database, row, lambda: letters.post(server, letters.letter(
        to, occasion, url, row.expires_at, by.words, by.messaging.public_url, home)))  # fmt: skip


def invite_account(database: Database, caller: Person, email: str, duty: Duty | None, by: Post) -> OneTimeLink:
    """An operator's: makes somebody an account, with a duty or without. Where the service sends no e-mail, the link is shown.

    Raises Unavailable, AlreadyExists.
    """
    to = address(email)
    with database.write() as tx:
        if people.find(tx, to) is not None:
            raise AlreadyExists(f"{to} has an account already.")
        people.drop_links(tx, to, "invitation")
        secret, row = _add(tx, "invitation", to, INVITED_FOR, caller, duty=duty)
    url = f"{by.messaging.public_url}/invitation#{secret}"
    if by.messaging.mail is None:
        return OneTimeLink(url=url, expires_at=row.expires_at)
    server = by.messaging.mail
    _post_or_drop(database, row, lambda: letters.post(server, letters.letter(
        to, "account", url, row.expires_at, by.words, by.messaging.public_url)))  # fmt: skip
    return OneTimeLink(url=None, expires_at=row.expires_at)


def ask_reset(database: Database, browser: Browser, messaging: Messaging) -> None:
    """What can be answered at once, the same whoever it is about. Raises Unavailable, TooMany."""
    letters.server_of(messaging)
    take(database, Tries(RESETS_FROM, (browser.source,)))


def send_reset(database: Database, email: str, by: Post) -> None:
    """After the answer: a link to the account's address, if there is one. Never raises."""
    to = address(email)
    try:
        with database.read() as tx:
            account = people.find(tx, to)
        if account is None or account.disabled_at is not None:
            return
        take(database, Tries(RESETS, (to,)))
        _send_reset(database, to, by, None)
    except (TooMany, Unavailable) as error:
        log.warning("no link for a new password was sent", reason=error.detail)


def reset_of(database: Database, caller: Person, key: str, by: Post) -> OneTimeLink:
    """An operator's, for somebody who asked for help: goes to the account's address. Where the service sends no e-mail, it
    is shown. Raises NotFound, Unavailable."""
    with database.read() as tx:
        account = people.by_key(tx, key)
    if account is None:
        raise NotFound(f"There is no account {key}.")
    return _send_reset(database, account.email, by, caller)


def _send_reset(database: Database, to: str, by: Post, caller: Person | None) -> OneTimeLink:
    with database.write() as tx:
        people.drop_links(tx, to, "reset")
        secret, row = _add(tx, "reset", to, RESET_WITHIN, caller)
    url = f"{by.messaging.public_url}/new-password#{secret}"
    if by.messaging.mail is None:
        return OneTimeLink(url=url, expires_at=row.expires_at)
    letters.post(by.messaging.mail, letters.letter(
        to, "reset", url, row.expires_at, by.words, by.messaging.public_url))  # fmt: skip
    return OneTimeLink(url=None, expires_at=row.expires_at)


def for_another_browser(database: Database, caller: Person, messaging: Messaging) -> OneTimeLink:
    """Signs the caller in somewhere else."""
    with database.read() as tx:
        until = clock.now(tx) + OTHER_BROWSER_WITHIN
    secret = new_login_link(database, caller.email, OTHER_BROWSER_WITHIN)
    return OneTimeLink(url=f"{messaging.public_url}/login?token={quote(secret)}", expires_at=until)


# -- opening them --------------------------------------------------------------------------------------------------


def look(database: Database, secret: str, browser: Browser) -> LinkDocument:
    """What a link is for, before it is used. Raises NotFound, TooMany."""
    take(database, Tries(FOLLOWING, (browser.source,)))
    with database.read() as tx:
        row = _find(people.link_by(tx, hash_of(secret), clock.now(tx)))
        account = people.find(tx, row.email or "")
    return LinkDocument.model_validate(
        {name: getattr(row, name) for name in ("purpose", "email", "home", "role", "duty")}
        | {"needs_password": _needs_password(row, account)}
    )


def use(database: Database, secret: str, password: str | None, browser: Browser) -> SignedIn | None:
    """Uses it up. None: somebody who has an account has joined a home, and signs in as always.

    Raises NotFound, InvalidInput for a password that is missing or can't be one, TooMany, Unavailable.
    """
    take(database, Tries(FOLLOWING, (browser.source,)))
    key = sessions.device_key(database)
    with database.read() as tx:
        row = _find(people.link_by(tx, hash_of(secret), clock.now(tx)))
        account = people.find(tx, row.email or "")
    password_hash = None
    if row.purpose == "reset" or _needs_password(row, account):
        if password is None:
            raise InvalidInput("A password is needed.", (Fault("/password", "missing"),))
        password_hash = passwords.hashed(password, row.email or "")
    with database.write() as tx:
        now = clock.now(tx)
        row = _find(people.use_link(tx, row.hash, now))
        email = row.email or ""
        account = people.find_or_add(tx, email, now)
        if account.disabled_at is not None:
            raise NotFound("This account does not work any more: ask who runs the service.")
        apply(tx, row, account, password_hash, now)
        if password_hash is None:
            return None
        return sessions.begin(tx, email, "reset" if row.purpose == "reset" else "invitation", browser, key)


def apply(tx: Transaction, row: LinkRow, account: AccountRow, password_hash: str | None, now: datetime) -> None:
    """Gives somebody what a link is for."""
    if password_hash is not None:
        people.change(tx, account.email, {"password_hash": password_hash})
        people.end_sessions(tx, account.email)  # whoever knew the old one
        people.drop_links(tx, account.email, "reset")
    if row.duty is not None:
        people.change(tx, account.email, {"duty": row.duty})
    if row.home is not None and row.role is not None:
        people.join(tx, row.home, account.email, row.role, now)


def _needs_password(row: LinkRow, account: AccountRow | None) -> bool:
    if row.purpose == "reset":
        return True
    return account is None or (account.password_hash is None and account.subject is None)


def _find(row: LinkRow | None) -> LinkRow:
    if row is None or row.purpose == "sign_in":
        raise NotFound("This link was used already or has expired: ask for a new one.")
    return row


def _add(
    tx: Transaction,
    purpose: str,
    email: str,
    life: timedelta,
    caller: Person | None,
    home: str | None = None,
    role: str | None = None,
    duty: str | None = None,
) -> tuple[str, LinkRow]:
    secret, now = new_secret(), clock.now(tx)
    by = None if caller is None else signature(caller)
    row = LinkRow(
        hash_of(secret), people.new_key("link"), purpose, email, home, role, duty, by, now, now + life, None
    )  # fmt: skip
    people.add_link(tx, row)
    return secret, row


def _post_or_drop(database: Database, row: LinkRow, post: Callable[[], None]) -> None:
    """An invitation that could not be sent is none."""
    try:
        post()
    except Unavailable:
        with database.write() as tx:
            people.withdraw(tx, row.home, row.key)
        raise
