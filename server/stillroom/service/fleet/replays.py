"""What replays came to."""

from typing import get_args

from stillroom.documents.api import Page
from stillroom.documents.replays import (
    Cell,
    Measure,
    NewReplay,
    PairedTable,
    ReplayDocument,
    ReplayedMission,
    ReplayResults,
)
from stillroom.errors import NotFound
from stillroom.estimation.pairs import Pairs
from stillroom.service.fleet.replaying import Replay, start
from stillroom.service.fleet.variants import resolvers_named
from stillroom.service.paging import page_of
from stillroom.store import replays
from stillroom.store.database import Database, Transaction
from stillroom.store.replays import ReplayRow

CELLS: dict[Cell, tuple[bool, bool]] = {
    "both": (True, True),
    "only_old": (True, False),
    "only_new": (False, True),
    "neither": (False, False),
}
"""(Succeeded then, now.)"""


def begin(database: Database, new: NewReplay) -> ReplayResults:
    """Workers run it. Raises InvalidInput, AlreadyExists."""
    resolvers = resolvers_named(new.resolvers)
    what = Replay(new.name, resolvers, new.params, new.since, new.until, tuple(new.robots), in_service=True)
    start(database, what, resume=False)
    return results(database, new.name)


def list_replays(database: Database, cursor: int | None, limit: int) -> Page[ReplayDocument]:
    """The newest first."""
    with database.read() as tx:
        rows, following = page_of(replays.page(tx, cursor, limit + 1), limit, lambda row: str(row.id))
        return Page(items=[ReplayDocument.model_validate(_fields(tx, row)) for row in rows], next=following)


def results(database: Database, name: str) -> ReplayResults:
    """So far as it has been run. Raises NotFound."""
    with database.read() as tx:
        row = _find(tx, name)
        tables = [_table(tx, row.id, measure) for measure in get_args(Measure)]
        return ReplayResults.model_validate(_fields(tx, row) | {"tables": tables})


def missions(
    database: Database, name: str, measure: Measure, cell: Cell, cursor: int | None, limit: int
) -> Page[ReplayedMission]:
    """Those of one cell of a table, the newest arrivals first. Raises NotFound."""
    with database.read() as tx:
        row = _find(tx, name)
        found = replays.missions(tx, row.id, measure, *CELLS[cell], cursor, limit + 1)
    items, following = page_of(found, limit, lambda one: str(one.id))
    return Page(
        items=[
            ReplayedMission(
                robot=one.robot_id,
                map=one.map_name,
                mission=one.key,
                outcome_then=one.outcome_then,
                outcome_now=one.outcome_now,
                error=one.error,
                url=f"/api/v1/fleet/robots/{one.robot_id}/maps/{one.map_name}/missions/{one.key}",
            )
            for one in items
        ],
        next=following,
    )


def _find(tx: Transaction, name: str) -> ReplayRow:
    row = replays.by_name(tx, name)
    if row is None:
        raise NotFound(f"There is no replay {name}.")
    return row


def _table(tx: Transaction, replay_id: int, measure: Measure) -> PairedTable:
    found = replays.paired(tx, replay_id, measure)
    pairs = Pairs(**{cell: found.get(key, 0) for cell, key in CELLS.items()})
    return PairedTable(measure=measure, **vars(pairs), p=pairs.p)


def _fields(tx: Transaction, row: ReplayRow) -> dict[str, object]:
    return vars(row) | {"done": replays.count_done(tx, row.id)}
