"""Stored missions run again with the code of today, or with other parameters, without touching anybody's map.

Each mission starts from the version that it was carried over from then, so that one difference does not grow into the next.
Maps are spread over processes; what was run is kept, so that a replay that was stopped goes on where it was.
"""

import os
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from itertools import islice
from multiprocessing import get_context
from typing import Any, get_args

import cv2

from stillroom import __version__
from stillroom.errors import AlreadyExists, Fault, InvalidInput, NotFound
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.update import RESOLVERS, ResolverName
from stillroom.service.gathering import Timings, carry_over, gather_as_then
from stillroom.store import clock, replays
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.replays import NewReplay, ReplayRow, Result

CHUNK = 20
"""Missions of one map that a process runs before it tells."""
AHEAD = 4
"""Chunks for each process that wait for it."""


@dataclass(frozen=True)
class Replay:
    name: str
    resolvers: tuple[ResolverName, ...] = RESOLVERS
    params: Mapping[str, Any] = field(default_factory=dict)
    """Those that differ from `PARAMS`, by name."""
    since: datetime | None = None
    until: datetime | None = None
    robots: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Job:
    """What a process needs to run some missions of one map."""

    database_url: str
    grid_store_url: str
    replay_id: int
    missions: tuple[int, ...]
    resolvers: tuple[ResolverName, ...]
    params: Params


def parameters(changed: Mapping[str, Any]) -> Params:
    """Raises InvalidInput for a parameter that there is not, or whose value is of another type."""
    known = {one.name: getattr(PARAMS, one.name) for one in fields(Params)}
    faults = []
    values: dict[str, Any] = {}
    for name, value in changed.items():
        if name not in known:
            faults.append(Fault(f"/params/{name}", "no such parameter"))
        elif not _fits(value, known[name]):
            faults.append(Fault(f"/params/{name}", f"must be like {known[name]!r}"))
        else:
            values[name] = tuple(value) if isinstance(known[name], tuple) else type(known[name])(value)
    if faults:
        raise InvalidInput("These parameters can't be used.", tuple(faults))
    return replace(PARAMS, **values)


def _fits(value: Any, like: Any) -> bool:
    if isinstance(like, tuple):
        return isinstance(value, list | tuple) and len(value) == len(like) and all(map(_fits, value, like))
    if isinstance(like, bool) or isinstance(value, bool):
        return isinstance(like, bool) and isinstance(value, bool)
    if isinstance(like, int):
        return isinstance(value, int)
    return isinstance(value, int | float) and abs(value) < float("inf") if isinstance(like, float) else False


def start(database: Database, what: Replay, resume: bool) -> tuple[ReplayRow, list[list[int]]]:
    """The replay, and what there is to run, map by map.

    Raises InvalidInput, AlreadyExists where there is one of that name, NotFound where there is none to go on with.
    """
    parameters(what.params)
    with database.write() as tx:
        row = replays.by_name(tx, what.name)
        if row is None and resume:
            raise NotFound(f"There is no replay {what.name} to go on with.")
        if row is not None and not resume:
            raise AlreadyExists(f"There is a replay {what.name} already; go on with it, or choose another name.")
        if row is None:
            runs = replays.to_run(tx, what.since, what.until, what.robots)
            replays.add(tx, _new(what, sum(map(len, runs.values())), clock.now(tx)))
            row = replays.by_name(tx, what.name)
        assert row is not None
        told = row.selection
        since, until = (
            None if told[name] is None else datetime.fromisoformat(told[name]) for name in ("since", "until")
        )
        # what was processed after the replay began is no part of it
        runs = replays.to_run(tx, since, min(until or row.created_at, row.created_at), told["robots"])
        finished = replays.done(tx, row.id)
    left = [[number for number in numbers if number not in finished] for numbers in runs.values()]
    return row, [numbers for numbers in left if numbers]


def _new(what: Replay, missions: int, now: datetime) -> NewReplay:
    since, until = (None if at is None else at.isoformat() for at in (what.since, what.until))
    selection = {"since": since, "until": until, "robots": list(what.robots)}
    return NewReplay(what.name, __version__, list(what.resolvers), dict(what.params), selection, missions, now)


def run(
    database: Database,
    grid_store_url: str,
    row: ReplayRow,
    maps: Sequence[Sequence[int]],
    executor: Executor,
    at_once: int,
    tell: Callable[[int, int], None],
) -> None:
    """Runs what is left; `tell` is told how many missions are done, of how many. Raises InvalidInput for another algorithm version."""
    if row.algorithm != __version__:
        raise InvalidInput(f"The replay was begun with the algorithm {row.algorithm}; this is {__version__}.")
    chosen = tuple(name for name in get_args(ResolverName) if name in row.resolvers)
    params = parameters(row.params)
    url = database.url.render_as_string(hide_password=False)
    jobs = (
        _Job(url, grid_store_url, row.id, tuple(chunk), chosen, params)
        for numbers in maps
        for chunk in _chunks(numbers)
    )
    left = sum(map(len, maps))
    total = left
    waiting: set[Future[list[Result]]] = {executor.submit(_run_job, job) for job in islice(jobs, at_once * AHEAD)}
    while waiting:
        finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
        for future in finished:
            results = future.result()
            with database.write(durable=False) as tx:
                replays.keep(tx, results)
            left -= len(results)
            tell(total - left, total)
        waiting |= {executor.submit(_run_job, job) for job in islice(jobs, len(finished))}
    with database.write() as tx:
        replays.finish(tx, row.id, clock.now(tx))


def pool(processes: int) -> ProcessPoolExecutor:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    return ProcessPoolExecutor(processes, mp_context=get_context("spawn"))


def _chunks(numbers: Sequence[int]) -> Iterator[Sequence[int]]:
    return (numbers[at : at + CHUNK] for at in range(0, len(numbers), CHUNK))


def _run_job(job: _Job) -> list[Result]:
    cv2.setNumThreads(1)
    database, grids = Database(job.database_url), GridStore(job.grid_store_url)
    try:
        return [_run_mission(database, grids, job, number) for number in job.missions]
    finally:
        database.dispose()


def _run_mission(database: Database, grids: GridStore, job: _Job, mission_id: int) -> Result:
    """Where processing fails, nothing is taken; that, too, is a result."""
    began = time.perf_counter()
    try:
        gathered = gather_as_then(database, mission_id)
        update, _ = carry_over(gathered, gathered.previous, grids, Timings(), job.resolvers, job.params)
    except Exception:
        ms = (time.perf_counter() - began) * 1000
        return Result(job.replay_id, mission_id, "reverted", False, False, False, False, ms, traceback.format_exc())
    ms, found = (time.perf_counter() - began) * 1000, update.ablation
    rows = (False, False, False) if found is None else (found.transfer, found.meta_occupancy, found.meta_dividers)
    return Result(job.replay_id, mission_id, update.outcome, update.taken, *rows, ms)
