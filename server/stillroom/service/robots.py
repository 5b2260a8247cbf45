"""Robots: registered by operators, claimed by owners, given up, and their tokens."""

from dataclasses import replace
from datetime import timedelta
from secrets import token_hex

from stillroom.documents import api
from stillroom.documents.robots import ClaimCode, RobotDocument, RobotToken
from stillroom.errors import AlreadyExists, NotFound
from stillroom.service.access import Person
from stillroom.service.accounts import address
from stillroom.service.paging import page_of
from stillroom.service.people.throttling import Limit, Tries, forgive, take
from stillroom.service.people.tokens import ROBOT, hash_of, new_claim_code, new_secret
from stillroom.store import clock, erasing, lanes, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.rows import RobotRow

_REVOKED: dict[str, object] = {"token_made_at": None, "token_shown": False}
_KEPT = ".kept-"
CLAIMS = Limit("claims", 10, timedelta(minutes=1), timedelta(hours=1), timedelta(hours=6))


def add_robot(database: Database, new: api.NewRobot) -> api.CreatedRobot:
    """Raises AlreadyExists."""
    token, claim_code = new_secret(ROBOT), new_claim_code()
    owner = None if new.owner is None else address(new.owner)
    with database.write() as tx:
        row = RobotRow(new.id, new.name or new.id, owner, clock.now(tx))
        if not robots.add(tx, row, hash_of(token), _code_hash(claim_code)):
            raise AlreadyExists(f"There is a robot {new.id} already.")
    return api.CreatedRobot(id=row.id, name=row.name, owner=row.owner, token=token, claim_code=claim_code)


def robot(database: Database, robot_id: str) -> RobotDocument:
    with database.read() as tx:
        return _document(_find(robots.get(tx, robot_id), robot_id))


def rename(database: Database, robot_id: str, name: str) -> RobotDocument:
    with database.write() as tx:
        robots.change(tx, robot_id, {"name": name})
        return _document(_find(robots.get(tx, robot_id), robot_id))


def list_all(database: Database, after: str, limit: int) -> api.Page[RobotDocument]:
    """For who registers them: whose they are, and nothing of their maps. Without what owners kept of robots they gave up."""
    with database.read() as tx:
        rows, following = page_of(robots.page(tx, robots.registered(), after, limit + 1), limit, lambda row: row.id)
    return api.Page(items=[_document(row) for row in rows], next=following)


def claim(database: Database, caller: Person, code: str, source: str) -> RobotDocument:
    """Makes a robot the caller's that is nobody's. Raises NotFound for a wrong code, and TooMany."""
    assert caller.email is not None
    tries = Tries(CLAIMS, ("person", caller.email)), Tries(CLAIMS, ("source", source))
    take(database, *tries)
    with database.write() as tx:
        row = robots.by_claim_code(tx, _code_hash(code))
        if row is None:
            raise NotFound("There is no robot with this code that waits for an owner.")
        robots.change(tx, row.id, {"owner": caller.email, "released_at": None})
        made = _document(_find(robots.get(tx, row.id), row.id))
    forgive(database, *tries)
    return made


def release(database: Database, robot_id: str) -> ClaimCode:
    """Gives a robot up. Its maps stay with who gives it up, under another name; the robot itself has none any more.

    Until it is claimed with the new code it uploads nothing: what it still sees is the old home. A token that its owner was
    shown ends. Raises AlreadyExists for what was kept of another.
    """
    code = new_claim_code()
    with database.write() as tx:
        row = _find(robots.lock(tx, robot_id), robot_id)
        _check_not_kept(row)
        maps, now = robots.map_ids(tx, robot_id), clock.now(tx)
        for map_id in maps:  # whoever works on one is done, or begins again with what it is from now on
            lanes.lock(tx, map_id)
        if maps:
            robots.hand_over(tx, robot_id, keep(tx, row))
        else:
            erasing.erase_robot(tx, robot_id, now)  # who had it is not for who has it next
        free = {"owner": None, "released_at": now, "claim_code_hash": _code_hash(code)}
        robots.change(tx, robot_id, free | unknown_token(row))
    return ClaimCode(robot=robot_id, claim_code=code)


def new_code(database: Database, robot_id: str) -> ClaimCode:
    """Takes the place of one that was lost. Raises NotFound, and AlreadyExists where the robot has an owner."""
    code = new_claim_code()
    with database.write() as tx:
        row = _find(robots.lock(tx, robot_id), robot_id)
        if row.owner is not None:
            raise AlreadyExists(f"{robot_id} has an owner, who may give it up.")
        robots.change(tx, robot_id, {"claim_code_hash": _code_hash(code)})
    return ClaimCode(robot=robot_id, claim_code=code)


def new_token(database: Database, robot_id: str) -> RobotToken:
    """The old one does not work any more."""
    token = new_secret(ROBOT)
    with database.write() as tx:
        row = _find(robots.lock(tx, robot_id), robot_id)
        _check_not_kept(row)
        made = {"token_hash": hash_of(token), "token_made_at": clock.now(tx), "token_shown": row.owner is not None}
        robots.change(tx, robot_id, made)
    return RobotToken(robot=robot_id, token=token)


def revoke_token(database: Database, robot_id: str) -> None:
    with database.write() as tx:
        robots.change(tx, robot_id, _REVOKED | {"token_hash": _nobodys()})


def keep(tx: Transaction, of: RobotRow) -> str:
    """Adds what an owner keeps of a robot, which uploads nothing; its id."""
    origin = of.id.partition(_KEPT)[0]
    made = replace(
        of, id=f"{origin[:48]}{_KEPT}{token_hex(4)}", token_made_at=None, token_shown=False, kept_from=origin
    )
    robots.add(tx, made, _nobodys(), _nobodys())
    return made.id


def unknown_token(row: RobotRow) -> dict[str, object]:
    """What changes in a robot that gets another owner: whoever had it must know no token that reads its maps."""
    return _REVOKED | {"token_hash": _nobodys()} if row.token_shown else {}


def _check_not_kept(row: RobotRow) -> None:
    """Raises AlreadyExists."""
    if row.kept_from is not None:
        raise AlreadyExists("This is what was kept of a robot that was given up: there is no robot behind it any more.")


def _find(row: RobotRow | None, robot_id: str) -> RobotRow:
    if row is None:
        raise NotFound(f"There is no robot {robot_id}.")
    return row


def _code_hash(code: str) -> str:
    """However it was typed."""
    return hash_of("".join(character for character in code.upper() if character.isalnum()))


def _nobodys() -> str:
    return hash_of(new_secret())


def _document(row: RobotRow) -> RobotDocument:
    return RobotDocument(
        id=row.id,
        name=row.name,
        owner=row.owner,
        created_at=row.created_at,
        token_made_at=row.token_made_at,
        released_at=row.released_at,
        kept_from=row.kept_from,
    )
