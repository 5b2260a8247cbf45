"""Stored missions run again with the code of today, or with other parameters, without touching anybody's map.

Each mission starts from the version that it was carried over from then, so that one difference does not grow into the next.
Maps are spread over processes; what was run is kept, so that a replay that was stopped goes on where it was.
"""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from itertools import islice
from multiprocessing import get_context
from random import sample
from typing import Any

import cv2

from stillroom import __version__
from stillroom.errors import AlreadyExists, InvalidInput, NotFound
from stillroom.pipeline.params import Params
from stillroom.pipeline.update import RESOLVERS, ResolverName
from stillroom.service.fleet.rerunning import rerun
from stillroom.service.fleet.variants import parameters, resolvers_named
from stillroom.store import clock, replays
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.replays import NewReplay, ReplayRow, Result

CHUNK = 20
"""Missions of one map that a process runs before it tells."""
SOME, AT_ONCE = 200, 3
"""Of so many that are next a worker runs so many, and then looks whether robots wait."""
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
    in_service: bool = False
    """Whether workers run it when nothing else waits; else whoever began it does."""


@dataclass(frozen=True)
class _Job:
    """What a process needs to run some missions of one map."""

    database_url: str
    grid_store_url: str
    replay_id: int
    missions: tuple[int, ...]
    resolvers: tuple[ResolverName, ...]
    params: Params


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
        runs = replays.to_run(tx, *_span(row), row.selection["robots"])
        finished = replays.done(tx, row.id)
    left = [[number for number in numbers if number not in finished] for numbers in runs.values()]
    return row, [numbers for numbers in left if numbers]


def _span(row: ReplayRow) -> tuple[datetime | None, datetime]:
    """From when to when missions were processed: what came after the replay began is no part of it."""
    said = row.selection
    since, until = (None if said[name] is None else datetime.fromisoformat(said[name]) for name in ("since", "until"))
    return since, min(until or row.created_at, row.created_at)


def run_next(database: Database, grids: GridStore) -> bool:
    """Runs some missions of a replay that is the service's to run. Whether there was one."""
    with database.read() as tx:
        row = replays.next_in_service(tx)
        if row is None:
            return False
        left = []
        if row.algorithm == __version__:  # what other code has begun ends here, as far as it came
            left = replays.left_to_run(tx, row.id, *_span(row), row.selection["robots"], SOME)
    if not left:
        with database.write() as tx:
            replays.finish(tx, row.id, clock.now(tx))
        return True
    # some of the next ones at random: workers seldom run the same mission, and where they do it is kept once
    job = _Job("", "", row.id, (), resolvers_named(row.resolvers), parameters(row.params))
    results = [_run_mission(database, grids, job, number) for number in sample(left, min(AT_ONCE, len(left)))]
    with database.write(durable=False) as tx:
        replays.keep(tx, results)
    return True


def _new(what: Replay, missions: int, now: datetime) -> NewReplay:
    since, until = (None if at is None else at.isoformat() for at in (what.since, what.until))
    selection = {"since": since, "until": until, "robots": list(what.robots), "in_service": what.in_service}
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
    chosen, params = resolvers_named(row.resolvers), parameters(row.params)
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


@contextmanager
def pool(processes: int) -> Iterator[tuple[Executor, int]]:
    """Processes of this machine, and how many there are."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as executor:
        yield executor, processes


@contextmanager
def cluster(scheduler: str) -> Iterator[tuple[Executor, int]]:
    """A cluster of Dask, and how many missions it runs at once. Its workers reach database and grid store by the same URLs.

    Raises InvalidInput where it can't be reached.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput("This needs Dask: pip install 'stillroom[replay]'.") from None
    try:
        client = Client(scheduler)
    except (OSError, TimeoutError, ValueError) as error:
        raise InvalidInput(f"No scheduler answers at {scheduler}.") from error
    with client, client.get_executor() as executor:
        yield executor, max(sum(client.ncores().values()), 1)


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
    found = rerun(database, grids, mission_id, job.resolvers, job.params)
    return Result(job.replay_id, mission_id, found.outcome, found.taken, *found.rows, found.ms, found.error)
