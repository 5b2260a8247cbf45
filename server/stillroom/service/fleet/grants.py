"""Floor plans belong to owners: nobody who runs the service looks at one without leave that ends by itself, and every look is logged."""

import secrets
from datetime import datetime, timedelta

from stillroom.documents.api import Page
from stillroom.documents.inspection import (
    GrantAnswer,
    GrantDocument,
    GrantRequest,
    GrantState,
    PlanAccess,
    TestRobot,
    ViewDocument,
)
from stillroom.errors import AlreadyDecided, AlreadyExists, Forbidden, GrantRequired, NotFound
from stillroom.service.access import Principal, Robot, looking_after, may, signature
from stillroom.service.paging import page_of
from stillroom.store import clock, deliveries, grants, receivers, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.deliveries import NewDelivery
from stillroom.store.grants import GrantRow, NewGrant, NewView
from stillroom.store.robots import everything
from stillroom.store.rows import RobotRow

ANSWER_WITHIN = timedelta(days=7)
"""After this a question has expired."""


def access(tx: Transaction, robot: RobotRow, viewer: str, now: datetime) -> tuple[PlanAccess, GrantRow | None]:
    """Whether the floor plans of a robot may be looked at, and by which grant."""
    if robot.owner is None:
        return "unowned", None
    if grants.is_test(tx, robot.id):
        return "test", None
    known = [grant for grant in grants.of_robot(tx, robot.id, now) if grant.asked_by == viewer]
    holding = next((grant for grant in known if grant.holds(now)), None)
    if holding is not None:
        return "granted", holding
    asked = next((grant for grant in known if grant.is_open(now)), None)
    return ("none", None) if asked is None else ("asked", asked)


def look(database: Database, caller: Principal, robot_id: str, map_name: str, mission: str, what: str) -> None:
    """Logs that the caller looks at a floor plan, before anything of it is read. Raises NotFound, GrantRequired."""
    viewer = signature(caller)
    with database.write() as tx:
        robot, now = _robot(tx, robot_id), clock.now(tx)
        why, grant = access(tx, robot, viewer, now)
        if why in ("none", "asked"):
            raise GrantRequired(
                f"The owner of {robot_id} has not agreed that you look at the floor plan."
                + (" The question waits for an answer." if why == "asked" else " Ask with POST /api/v1/fleet/grants."),
                plan=why,
            )
        grant_id = None if grant is None else grant.id
        grants.log(tx, NewView(robot_id, map_name, mission, viewer, what, why, grant_id, now))


def ask(database: Database, caller: Principal, request: GrantRequest) -> GrantDocument:
    """Asks the owner, who is told. Raises NotFound, and AlreadyExists where there is nothing to ask."""
    viewer = signature(caller)
    with database.write() as tx:
        robot, now = _robot(tx, request.robot), clock.now(tx)
        why, _ = access(tx, robot, viewer, now)
        if why != "none":
            raise AlreadyExists(_NOTHING_TO_ASK[why], plan=why)
        key = f"grant_{secrets.token_urlsafe(16)}"
        grants.add(tx, NewGrant(key, robot.id, viewer, request.reason.strip(), request.hours, now, now + ANSWER_WITHIN))
        _tell(tx, robot, key, now)
        return _document(_find(tx, key), now)


_NOTHING_TO_ASK = {
    "granted": "The owner has agreed already.",
    "asked": "The owner was asked already.",
    "test": "This is a test robot: its floor plans may be looked at.",
    "unowned": "This robot is nobody's yet: its floor plans may be looked at.",
}


def list_grants(database: Database, caller: Principal, cursor: int | None, limit: int) -> Page[GrantDocument]:
    """An owner's: those about the own robots. An operator's: all that was asked. The newest first."""
    if isinstance(caller, Robot):
        raise Forbidden("Robots are not asked.")
    with database.read() as tx:
        of = everything() if may(caller, "triage") else robots.owned_by(caller.email)
        rows, now = grants.page(tx, of, cursor, limit + 1), clock.now(tx)
    items, following = page_of(rows, limit, lambda row: str(row.id))
    return Page(items=[_document(row, now) for row in items], next=following)


def answer(database: Database, caller: Principal, key: str, given: GrantAnswer) -> GrantDocument:
    """The owner's, once. Raises NotFound, Forbidden, AlreadyDecided."""
    with database.write() as tx:
        row, now = _find(tx, key), clock.now(tx)
        if not _owns(tx, caller, row):
            raise Forbidden("Only the owner of the robot may answer this.")
        if not row.is_open(now):
            raise AlreadyDecided(f"It is {_state(row, now)}.", decided_by=row.answered_by, decided_at=row.answered_at)
        granted = given.answer == "grant"
        values = {"granted": granted, "answered_at": now, "answered_by": signature(caller)}
        until = {"expires_at": now + timedelta(hours=row.hours)} if granted else {}
        grants.change(tx, row.id, values | until)
        return _document(_find(tx, key), now)


def end(database: Database, caller: Principal, key: str) -> GrantDocument:
    """The owner takes it back, or who asked does; at once, and as often as one likes. Raises NotFound, Forbidden."""
    with database.write() as tx:
        row, now = _find(tx, key), clock.now(tx)
        if not _owns(tx, caller, row) and row.asked_by != signature(caller):
            raise Forbidden("Only the owner of the robot, and who asked, may take this back.")
        if row.is_open(now) or row.holds(now):
            grants.change(tx, row.id, {"ended_at": now, "ended_by": signature(caller)})
        return _document(_find(tx, key), now)


def list_views(database: Database, robot_id: str, cursor: int | None, limit: int) -> Page[ViewDocument]:
    """Who looked at floor plans of the robot, the newest first."""
    with database.read() as tx:
        rows, following = page_of(grants.views(tx, robot_id, cursor, limit + 1), limit, lambda row: str(row.id))
    items = [
        ViewDocument.model_validate(
            {"map": row.map_name}
            | {name: getattr(row, name) for name in ("viewer", "at", "mission", "what", "why", "grant")}
        )
        for row in rows
    ]
    return Page(items=items, next=following)


def mark_test(database: Database, caller: Principal, robot_id: str, test: bool) -> TestRobot:
    """By whom the robot is: an owner's own, or an operator's where it is nobody's yet."""
    with database.write() as tx:
        if test:
            grants.mark_test(tx, robot_id, signature(caller), clock.now(tx))
        else:
            grants.unmark_test(tx, robot_id)
        return TestRobot(robot=robot_id, test=grants.is_test(tx, robot_id))


def is_test(database: Database, robot_id: str) -> TestRobot:
    with database.read() as tx:
        return TestRobot(robot=robot_id, test=grants.is_test(tx, robot_id))


def _tell(tx: Transaction, robot: RobotRow, key: str, now: datetime) -> None:
    """By e-mail and in browsers, whatever else the owner wants to be told: it is about the owner's privacy."""
    person = looking_after(robot.owner)
    own = [row for row in receivers.listening(tx, person) if row.person == person and row.channel != "webhook"]
    deliveries.add(tx, [NewDelivery(row.id, "grant", {"grant": key, "robot": robot.id}, now) for row in own], now)


def _robot(tx: Transaction, robot_id: str) -> RobotRow:
    row = robots.get(tx, robot_id)
    if row is None:
        raise NotFound(f"There is no robot {robot_id}.")
    return row


def _find(tx: Transaction, key: str) -> GrantRow:
    row = grants.lock(tx, key)
    if row is None:
        raise NotFound(f"There is no grant {key}.")
    return row


def _owns(tx: Transaction, caller: Principal, row: GrantRow) -> bool:
    robot = robots.get(tx, row.robot_id)
    return (
        not isinstance(caller, Robot) and robot is not None and robot.owner is not None and robot.owner == caller.email
    )


def _state(row: GrantRow, now: datetime) -> GrantState:
    if row.granted is False:
        return "refused"
    if row.ended_at is not None:
        return "withdrawn" if row.ended_by == row.asked_by else "revoked"
    if row.expires_at <= now:
        return "expired"
    return "granted" if row.granted else "asked"


def _document(row: GrantRow, now: datetime) -> GrantDocument:
    names = (
        "reason",
        "hours",
        "asked_by",
        "asked_at",
        "answered_at",
        "answered_by",
        "expires_at",
        "ended_at",
        "ended_by",
    )
    return GrantDocument.model_validate(
        {"id": row.key, "robot": row.robot_id, "state": _state(row, now)} | {name: getattr(row, name) for name in names}
    )
