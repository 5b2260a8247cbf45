"""Many rows at once, for fleets that are made up."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction
from stillroom.store.tables import map_, mission, robot

_CHUNK = 1000


def has_missions(tx: Transaction) -> bool:
    return tx.execute(sa.select(mission.c.id).limit(1)).first() is not None


def add_robots(tx: Transaction, robots: Sequence[tuple[str, str]], now: datetime) -> list[int]:
    """(Id, hash of its token) of each; answers with the number of the map of each. The maps have no version."""
    rows = [
        {"id": name, "name": name, "token_hash": token, "claim_code_hash": "", "created_at": now}
        for name, token in robots
    ]
    tx.execute(sa.insert(robot), rows)
    same = {"name": "ground", "title": "ground", "ordinal": 1, "review": "automatic", "used_ids": {}, "created_at": now}
    return _numbers(tx, map_, [same | {"robot_id": name} for name, _ in robots])


def add_missions(tx: Transaction, missions: Sequence[Mapping[str, Any]]) -> list[int]:
    """As if they had been processed; answers with their numbers."""
    same: dict[str, Any] = {
        "epoch": 0,
        "status": "done",
        "attempts": 1,
        "grid": "",
        "meta_digest": "",
        "base_version": 1,
        "version": 1,
        "result": {"reason": "This mission was made up."},
    }
    return _numbers(tx, mission, [same | dict(row) for row in missions])


def _numbers(tx: Transaction, table: sa.Table, rows: Sequence[Mapping[str, Any]]) -> list[int]:
    insert = sa.insert(table).returning(table.c.id, sort_by_parameter_order=True)
    found: list[int] = []
    for at in range(0, len(rows), _CHUNK):
        found += tx.execute(insert, rows[at : at + _CHUNK]).scalars()
    return found
