"""The account page: one's password, browsers that are signed in, and tokens for one's programs."""

from datetime import timedelta

from stillroom.documents.people import CreatedToken, NewToken, OwnAccount, SessionDocument, TokenDocument
from stillroom.errors import InvalidInput, NotFound
from stillroom.service.access import SCOPES, Person, Scope, may
from stillroom.service.people import passwords, sessions
from stillroom.service.people.sessions import Browser, SignedIn
from stillroom.service.people.signing_in import check_own
from stillroom.service.people.tokens import PERSON, hash_of, new_secret
from stillroom.store import clock, people
from stillroom.store.database import Database
from stillroom.store.people import SessionRow, TokenRow

MOST_TOKENS = 50


def account(database: Database, caller: Person) -> OwnAccount:
    with database.read() as tx:
        row = None if caller.email is None else people.find(tx, caller.email)
    return OwnAccount(
        email=caller.email,
        duty=caller.duty,
        has_password=row is not None and row.password_hash is not None,
        has_provider=row is not None and row.subject is not None,
    )


def set_password(database: Database, caller: Person, current: str | None, new: str, browser: Browser) -> SignedIn:
    """Ends all other sessions, and this one gets a new cookie. Raises InvalidInput, Forbidden, TooMany, Unavailable."""
    email = _email(caller)
    with database.read() as tx:
        row = people.find(tx, email)
    check_own(database, email, current, None if row is None else row.password_hash)
    password_hash, key = passwords.hashed(new, email, "/new"), sessions.device_key(database)
    with database.write() as tx:
        people.change(tx, email, {"password_hash": password_hash})
        people.drop_links(tx, email, "reset")
        people.end_sessions(tx, email)
        return sessions.begin(tx, email, "password", browser, key)


# -- browsers ------------------------------------------------------------------------------------------------------


def list_sessions(database: Database, caller: Person, cookie: str | None) -> list[SessionDocument]:
    """The newest first. Without an account: those of all operators who have none."""
    current = None if cookie is None else hash_of(cookie)
    with database.read() as tx:
        rows = people.sessions_of(tx, caller.email, clock.now(tx))
    return [_session(row, row.hash == current) for row in rows]


def end_session(database: Database, caller: Person, key: str) -> None:
    """Raises NotFound."""
    with database.write() as tx:
        if not people.end_session_of(tx, caller.email, key):
            raise NotFound(f"There is no session {key}.")


def end_others(database: Database, caller: Person, cookie: str | None) -> None:
    with database.write() as tx:
        people.end_sessions(tx, caller.email, None if cookie is None else hash_of(cookie))


def _session(row: SessionRow, current: bool) -> SessionDocument:
    names = ("way", "agent", "created_at", "seen_at", "expires_at")
    return SessionDocument.model_validate(
        {"id": row.key, "current": current} | {name: getattr(row, name) for name in names}
    )


# -- programs ------------------------------------------------------------------------------------------------------


def list_tokens(database: Database, caller: Person) -> list[TokenDocument]:
    """The newest first."""
    with database.read() as tx:
        rows = [] if caller.email is None else people.tokens_of(tx, caller.email)
    return [TokenDocument.model_validate(_token(row)) for row in rows]


def add_token(database: Database, caller: Person, new: NewToken) -> CreatedToken:
    """It may do what its scopes allow, as long as the person may. Raises InvalidInput."""
    email, secret = _email(caller), new_secret(PERSON)
    scopes = [scope for scope in SCOPES if scope in new.scopes]
    useless = [scope for scope in scopes if not is_useful(caller, scope)]
    if useless:
        raise InvalidInput(f"Your account may not do what {', '.join(useless)} is for.")
    with database.write() as tx:
        if len(people.tokens_of(tx, email)) >= MOST_TOKENS:
            raise InvalidInput(f"There are {MOST_TOKENS} tokens already: revoke one first.")
        now = clock.now(tx)
        until = None if new.days is None else now + timedelta(days=new.days)
        row = TokenRow(hash_of(secret), people.new_key("token"), email, new.name.strip(), scopes, now, until, None)
        people.add_token(tx, row)
    return CreatedToken.model_validate(_token(row) | {"token": secret})


def end_token(database: Database, caller: Person, key: str) -> None:
    """Raises NotFound."""
    with database.write() as tx:
        if not people.end_token(tx, caller.email or "", key):
            raise NotFound(f"There is no token {key}.")


def is_useful(caller: Person, scope: Scope) -> bool:
    """Whether the caller may do anything in the service that is for this scope alone."""
    match scope:
        case "fleet:read" | "fleet:triage":
            return may(caller, "figures")
        case "robots":
            return may(caller, "register")
        case _:
            return True


def _token(row: TokenRow) -> dict[str, object]:
    names = ("name", "scopes", "created_at", "expires_at", "seen_at")
    return {"id": row.key} | {name: getattr(row, name) for name in names}


def _email(caller: Person) -> str:
    """Raises InvalidInput for an operator without an account."""
    if caller.email is None:
        raise InvalidInput("This needs an account: invite yourself on the page of accounts.")
    return caller.email
