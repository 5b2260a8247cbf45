"""Who may do what. Every route asks `authorise` or `authorise_service`; what the table does not allow is refused."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from stillroom.documents import api
from stillroom.errors import Forbidden, NotFound
from stillroom.store import people, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.rows import RobotRow

Duty = Literal["operator", "engineer"]
Scope = Literal["maps:read", "maps:edit", "fleet:read", "fleet:triage", "messages", "robots", "archives"]
Role = Literal[
    "robot",  # itself, where somebody has it
    "owner",  # of the robot
    "member",  # of its home
    "viewer",
    "caretaker",  # an operator, of a robot that is nobody's
    "person",  # whoever has an account
    "engineer",
    "operator",
]
Action = Literal[
    "read", "upload", "edit", "manage", "archive", "rekey", "disconnect", "release",
    "list", "account", "household", "messages", "figures", "triage", "fleet messages", "register", "accounts",
]  # fmt: skip

RIGHTS: Mapping[Action, frozenset[Role]] = {
    # to what is a robot's
    "read": frozenset({"robot", "owner", "member", "viewer", "caretaker"}),
    "upload": frozenset({"robot"}),  # occupancy is the robot's alone
    "edit": frozenset({"owner", "member", "caretaker"}),
    "manage": frozenset({"owner", "caretaker"}),  # its name, who looked, whether it is for tests
    "archive": frozenset(
        {"owner", "caretaker", "person"}
    ),  # all of a robot, or of one's own home, to be kept elsewhere
    "rekey": frozenset({"owner", "caretaker"}),  # a new token; who has it reads the robot's maps
    "disconnect": frozenset({"owner", "caretaker", "operator"}),
    "release": frozenset({"owner"}),
    # of the service
    "list": frozenset({"robot", "person", "engineer", "operator"}),  # what one may see, and nothing else
    "account": frozenset({"person", "operator"}),  # one's own
    "household": frozenset({"person"}),  # people of one's own home, and robots for it
    "messages": frozenset({"person", "operator"}),
    "figures": frozenset({"engineer", "operator"}),
    "triage": frozenset({"engineer", "operator"}),  # a floor plan with its owner's leave alone: service.fleet.grants
    "fleet messages": frozenset({"operator"}),
    "register": frozenset({"operator"}),
    "accounts": frozenset({"operator"}),
}

SCOPES: Mapping[Scope, frozenset[Action]] = {
    # what a person's token may be for; a session may do all that its person may
    "maps:read": frozenset({"list", "read"}),
    "maps:edit": frozenset({"list", "read", "edit"}),
    "fleet:read": frozenset({"figures"}),
    "fleet:triage": frozenset({"figures", "triage"}),
    "messages": frozenset({"messages", "fleet messages"}),
    "robots": frozenset({"list", "register"}),
    "archives": frozenset({"list", "archive"}),  # for backups; bringing in and deleting takes somebody who is signed in
}


@dataclass(frozen=True)
class Robot:
    id: str
    homeless: bool = False
    """Its owner gave it up, and nobody has claimed it since."""


@dataclass(frozen=True)
class Person:
    email: str | None
    """None: whoever has the operator's token, or a link that was printed on the machine."""
    duty: Duty | None = None
    scopes: frozenset[Scope] | None = None
    """Of the token that stands for the person; None: all."""


Principal = Person | Robot
OPERATOR = Person(None, "operator")


def authorise(database: Database, caller: Principal, action: Action, robot_id: str) -> None:
    """Passes if `caller` may do `action` to what is the robot's. Raises Forbidden, or NotFound where the caller may know that."""
    robot = role = None
    if isinstance(caller, Person):
        with database.read() as tx:
            robot = robots.get(tx, robot_id)
            if robot is not None and robot.owner is not None and caller.email not in (None, robot.owner):
                role = people.role_in(tx, robot.owner, caller.email or "")
    roles = _roles_towards(caller, robot_id, robot, role)
    if robot is None and "operator" in roles:
        raise NotFound(f"There is no robot {robot_id}.")
    if not RIGHTS[action] & roles:
        raise Forbidden(f"This caller may not {action} {robot_id}.")
    _check_scope(caller, action)


def authorise_service(caller: Principal, action: Action) -> None:
    """Passes if `caller` may do `action` to what is no robot's. Raises Forbidden."""
    if not RIGHTS[action] & roles_in_service(caller):
        raise Forbidden(_REFUSALS.get(action, "This caller may not do this."))
    _check_scope(caller, action)


_REFUSALS: Mapping[Action, str] = {
    "messages": "A robot is sent no messages: it hears of its maps from the answers to its own requests.",
    "register": "Only an operator may do this.",
    "accounts": "Only an operator may do this.",
    "figures": "Only a fleet engineer or an operator may do this.",
    "triage": "Only a fleet engineer or an operator may do this.",
    "fleet messages": "Only an operator may be told about the whole fleet.",
}


def may(caller: Principal, action: Action) -> bool:
    """Whether `authorise_service` lets pass."""
    try:
        authorise_service(caller, action)
    except Forbidden:
        return False
    return True


def roles_in_service(caller: Principal) -> set[Role]:
    if isinstance(caller, Robot):
        return {"robot"}
    roles: set[Role] = set() if caller.email is None else {"person"}
    return roles if caller.duty is None else roles | {caller.duty}


def _roles_towards(caller: Principal, robot_id: str, robot: RobotRow | None, role: str | None) -> set[Role]:
    """Towards one robot; `role`: in its home, of somebody who does not own it."""
    if isinstance(caller, Robot):
        return {"robot"} if caller.id == robot_id and not caller.homeless else set()
    roles: set[Role] = {"operator"} if caller.duty == "operator" else set()
    if robot is None:
        return roles
    if robot.owner is None:
        return roles | {"caretaker"} if roles else roles
    if robot.owner == caller.email:
        return roles | {"owner"}
    return roles | {"member"} if role == "member" else roles | {"viewer"} if role == "viewer" else roles


def _check_scope(caller: Principal, action: Action) -> None:
    """Raises Forbidden for a person's token that was made for other things."""
    if not _in_scope(caller, action):
        needed = [scope for scope, actions in SCOPES.items() if action in actions]
        raise Forbidden(
            f"This needs a token of the scope {' or '.join(needed)}." if needed else "No token may do this: sign in.",
        )


def _in_scope(caller: Principal, action: Action) -> bool:
    """Of the token that stands for the caller."""
    return isinstance(caller, Robot) or caller.scopes is None or any(action in SCOPES[one] for one in caller.scopes)


def visible_to(caller: Principal) -> robots.Selection:
    """The robots that `authorise` lets the caller read, as a condition for lists."""
    if isinstance(caller, Robot):
        return robots.any_of([] if caller.homeless else [robots.is_robot(caller.id)])
    seen = []
    if caller.email is not None:
        seen += [robots.owned_by(caller.email), robots.in_homes_of(caller.email)]
    if caller.duty == "operator":
        seen.append(robots.owned_by(None))
    return robots.any_of(seen)


def signature(caller: Principal) -> str:
    """How versions name who made them."""
    match caller:
        case Robot(own):
            return f"robot:{own}"
        case Person(None):
            return "operator"
        case Person(email):
            return f"user:{email}"


def looking_after(owner: str | None) -> str:
    """Signature of the person who is told about the robots of `owner`: the operator, where they are nobody's."""
    return signature(OPERATOR if owner is None else Person(owner))


def told_about(tx: Transaction, owner: str | None) -> tuple[str, ...]:
    """Signatures of those who are told about the robots of `owner`: members of the home as well, and all operators where they
    are nobody's. Viewers look, and are asked nothing."""
    if owner is None:
        return looking_after(None), *(signature(Person(email)) for email in people.with_duty(tx, "operator"))
    members = (row.email for row in people.members_of(tx, owner) if row.role == "member")
    return looking_after(owner), *(signature(Person(email)) for email in members)


def who(caller: Principal) -> api.Caller:
    may_do: list[str] = sorted(action for action in RIGHTS if action in _SERVICE and may(caller, action))
    if isinstance(caller, Robot):
        return api.Caller(kind="robot", id=caller.id, may=may_do)
    return api.Caller(kind=caller.duty or "person", id=caller.email, may=may_do)


def rights_towards(tx: Transaction, caller: Principal, rows: Sequence[RobotRow]) -> Mapping[str, list[str]]:
    """What the caller may do to each of some robots, by their ids."""
    email = caller.email if isinstance(caller, Person) else None
    homes = {} if email is None else {row.home: row.role for row in people.homes_of(tx, email)}
    return {
        row.id: [
            action
            for action in _OF_ROBOTS
            if RIGHTS[action] & _roles_towards(caller, row.id, row, homes.get(row.owner or ""))
            and _in_scope(caller, action)
        ]
        for row in rows
    }


_OF_ROBOTS: tuple[Action, ...] = ("read", "upload", "edit", "manage", "archive", "rekey", "disconnect", "release")
_SERVICE: tuple[Action, ...] = ("account", "household", "messages", "figures", "triage", "register", "accounts")
