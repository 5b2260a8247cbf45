"""People delete what is theirs, at once and for good. The fleet's figures keep their counts, by numbers that mean nothing any more."""

from secrets import token_urlsafe

import structlog

from stillroom.documents.privacy import Erased
from stillroom.errors import Fault, InvalidInput, NotFound
from stillroom.service.access import Person, signature
from stillroom.service.fleet import counting
from stillroom.service.people.tokens import hash_of
from stillroom.service.robots import unknown_token
from stillroom.store import clock, erasing, fleet, lanes, robots
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore

AT_ONCE = 200
"""Grids that are deleted while nobody can store one."""
NOBODY = "user:(deleted)"
"""Who did what somebody did who is not there any more, in homes of others."""

log = structlog.get_logger()


def erase_robot(database: Database, grids: GridStore, robot_id: str, confirm: str | None) -> Erased:
    """All that is known of a robot: maps, missions, versions, decisions, and who looked. The robot stays its owner's, and begins anew.

    Raises InvalidInput where `confirm` is not its id.
    """
    _check(confirm, robot_id)
    counting.catch_up(database, counting.BATCHES_AT_ONCE)
    with database.write() as tx:
        erased = _erase(tx, robot_id)
    sweep_grids(database, grids)
    return erased


def erase_home(database: Database, grids: GridStore, caller: Person, confirm: str | None) -> Erased:
    """All robots of a person as above, and the account with all that belongs to it. The robots are nobody's afterwards.

    Raises InvalidInput where `confirm` is not the e-mail address.
    """
    assert caller.email is not None
    _check(confirm, caller.email)
    counting.catch_up(database, counting.BATCHES_AT_ONCE)
    maps = missions = 0
    with database.write() as tx:
        found = robots.page(tx, robots.owned_by(caller.email), "", robots.ALL)
        for row in found:
            erased = _erase(tx, row.id)
            maps, missions = maps + erased.maps, missions + erased.missions
            if row.kept_from is not None:
                robots.remove(tx, row.id)
            else:
                robots.change(tx, row.id, _nobodys(tx, row.id) | unknown_token(row))
        erasing.erase_person(tx, caller.email, signature(caller), NOBODY)
    sweep_grids(database, grids)
    return Erased(robots=[row.id for row in found], maps=maps, missions=missions)


def sweep_grids(database: Database, grids: GridStore) -> bool:
    """Deletes grids that nothing refers to any more. Whether some may be left."""
    with database.write() as tx:
        erasing.hold_grids(tx, alone=True)
        keys = erasing.discarded(tx, AT_ONCE)
        if keys:
            # while nobody can store one: else a grid would go that somebody has just stored again
            grids.delete(sorted(erasing.unreferred(tx, keys)))
            erasing.gone(tx, keys)
    return len(keys) == AT_ONCE


def _check(confirm: str | None, name: str) -> None:
    if confirm != name:
        detail = f"Deleting is for good: say so with confirm={name}."
        raise InvalidInput(detail, (Fault("/confirm", "not the name of what is to be deleted"),))


def _erase(tx: Transaction, robot_id: str) -> Erased:
    if robots.lock(tx, robot_id) is None:
        raise NotFound(f"There is no robot {robot_id}.")
    map_ids = robots.map_ids(tx, robot_id)
    for map_id in map_ids:  # whoever works on one is done, or finds it gone
        lanes.lock(tx, map_id)
    fleet.hold(tx)
    counting.count_waiting(tx)
    missions = erasing.count_missions(tx, robot_id)
    erasing.erase_robot(tx, robot_id, clock.now(tx))
    log.info("a robot's data were deleted", maps=len(map_ids), missions=missions)
    return Erased(robots=[robot_id], maps=len(map_ids), missions=missions)


def _nobodys(tx: Transaction, robot_id: str) -> dict[str, object]:
    """Uploads nothing until somebody claims it, with a code that an operator makes."""
    return {
        "owner": None,
        "name": robot_id,
        "released_at": clock.now(tx),
        "claim_code_hash": hash_of(token_urlsafe(32)),
    }
