"""Who calls, and what each may do. Every route decides through `authorise`; what is not allowed here is refused."""

import hmac
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from typing import Literal

from stillroom.documents import api
from stillroom.errors import AlreadyExists, Forbidden, NotFound, Unauthenticated
from stillroom.store import robots
from stillroom.store.database import Database
from stillroom.store.rows import RobotRow

LINK_LIFE = timedelta(hours=24)
SESSION_LIFE = timedelta(days=30)


@dataclass(frozen=True)
class Operator:
    """Runs the service; acts as owner of the robots that belong to nobody yet, and only of those."""


@dataclass(frozen=True)
class Robot:
    id: str


@dataclass(frozen=True)
class Owner:
    email: str


Principal = Operator | Robot | Owner
Action = Literal["read", "upload", "edit"]


def authorise(caller: Principal, action: Action, robot_id: str, robot: Callable[[], RobotRow | None]) -> None:
    """Passes if `caller` may do `action` to what is the robot's. Raises Forbidden, or NotFound where the caller may know that.

    `robot` looks the robot up; a robot that calls for itself needs no look-up: its token was found.

    A robot reads and uploads to its own maps. Owners and operators read and edit; they upload nothing, because occupancy
    is the robot's.
    """
    match caller:
        case Robot(own):
            allowed = own == robot_id and action in ("read", "upload")
        case Owner(email):
            found = robot()
            allowed = found is not None and found.owner == email and action in ("read", "edit")
        case Operator():
            found = robot()
            if found is None:
                raise NotFound(f"There is no robot {robot_id}.")
            allowed = found.owner is None and action in ("read", "edit")
    if not allowed:
        raise Forbidden(f"This caller may not {action} {robot_id}.")


def authorise_operator(caller: Principal) -> None:
    if not isinstance(caller, Operator):
        raise Forbidden("Only an operator may do this.")


def visible_to(caller: Principal) -> robots.Selection:
    """The robots that `authorise` lets the caller read, as a condition for lists."""
    match caller:
        case Robot(own):
            return robots.is_robot(own)
        case Owner(email):
            return robots.owned_by(email)
        case Operator():
            return robots.owned_by(None)


def signature(caller: Principal) -> str:
    """How versions name who made them."""
    match caller:
        case Robot(own):
            return f"robot:{own}"
        case Owner(email):
            return f"user:{email}"
        case Operator():
            return "operator"


def looking_after(owner: str | None) -> str:
    """Signature of the person who is told about the robots of `owner`: the operator, where they are nobody's."""
    return signature(_person(owner))


def who(caller: Principal) -> api.Caller:
    match caller:
        case Robot(own):
            return api.Caller(kind="robot", id=own)
        case Owner(email):
            return api.Caller(kind="owner", id=email)
        case Operator():
            return api.Caller(kind="operator", id=None)


def by_token(database: Database, token: str, admin_token: str | None) -> Principal:
    """Raises Unauthenticated."""
    if admin_token is not None and hmac.compare_digest(token.encode(), admin_token.encode()):
        return Operator()
    with database.read() as tx:
        row = robots.by_token(tx, _hash(token))
    if row is None:
        raise Unauthenticated("The token is not valid.")
    return Robot(row.id)


def by_session(database: Database, cookie: str) -> Principal:
    """Raises Unauthenticated."""
    with database.read() as tx:
        found = robots.session_owner(tx, _hash(cookie), datetime.now(UTC))
    if found is None:
        raise Unauthenticated("The session has ended; open a new sign-in link.")
    return _person(*found)


def add_robot(database: Database, new: api.NewRobot) -> api.CreatedRobot:
    """Raises AlreadyExists."""
    token = f"srt_{secrets.token_urlsafe(32)}"
    claim_code = "-".join(
        "".join(secrets.choice("23456789ABCDEFGHJKLMNPQRSTUVWXYZ") for _ in range(4)) for _ in range(3)
    )
    row = RobotRow(new.id, new.name or new.id, new.owner, datetime.now(UTC))
    with database.write() as tx:
        if not robots.add(tx, row, _hash(token), _hash(claim_code)):
            raise AlreadyExists(f"There is a robot {new.id} already.")
    return api.CreatedRobot(id=row.id, name=row.name, owner=row.owner, token=token, claim_code=claim_code)


def new_login_link(database: Database, owner: str | None = None) -> str:
    """The secret of a link that signs one browser in, once; an operator's without an owner."""
    secret = secrets.token_urlsafe(32)
    with database.write() as tx:
        robots.add_login_link(tx, _hash(secret), owner, datetime.now(UTC) + LINK_LIFE)
    return secret


def sign_in(database: Database, link_secret: str) -> str:
    """Uses a link up; answers with the session's cookie. Raises Unauthenticated."""
    now, cookie = datetime.now(UTC), secrets.token_urlsafe(32)
    with database.write() as tx:
        found = robots.use_login_link(tx, _hash(link_secret), now)
        if found is None:
            raise Unauthenticated("This sign-in link was used already or has expired.")
        robots.add_session(tx, _hash(cookie), *found, now, now + SESSION_LIFE)
    return cookie


def sign_out(database: Database, cookie: str) -> None:
    with database.write() as tx:
        robots.end_session(tx, _hash(cookie))


def _person(owner: str | None) -> Principal:
    return Operator() if owner is None else Owner(owner)


def _hash(secret: str) -> str:
    # Secrets of 256 random bits need no slow hash: there is nothing to guess.
    return sha256(secret.encode()).hexdigest()
