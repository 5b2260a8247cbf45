"""A stored mission run once more, from the version that it was carried over from then; nobody's map is touched."""

import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass

from stillroom.errors import Unavailable
from stillroom.pipeline.params import Params
from stillroom.pipeline.update import ResolverName
from stillroom.service.gathering import Timings, carry_over, gather_as_then
from stillroom.store.database import Database
from stillroom.store.grids import GridStore


@dataclass(frozen=True)
class Rerun:
    outcome: str
    taken: bool
    rows: tuple[bool, bool, bool]
    """Of the results table: transfer, with meta-occupancy, with meta-dividers."""
    ms: float
    error: str | None = None


def rerun(
    database: Database, grids: GridStore, mission_id: int, resolvers: Sequence[ResolverName], params: Params
) -> Rerun:
    """Where processing fails, nothing is taken; that, too, is a result. Raises Unavailable."""
    began = time.perf_counter()

    def ms() -> float:
        return (time.perf_counter() - began) * 1000

    try:
        gathered = gather_as_then(database, mission_id)
        update, _ = carry_over(gathered, gathered.previous, grids, Timings(), resolvers, params)
    except Unavailable:
        raise
    except Exception:
        return Rerun("reverted", False, (False, False, False), ms(), traceback.format_exc())
    found = update.ablation
    rows = (False, False, False) if found is None else (found.transfer, found.meta_occupancy, found.meta_dividers)
    return Rerun(update.outcome, update.taken, rows, ms())
