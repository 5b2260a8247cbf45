"""Worker processes, one a core: a thread beside the API would cost its callers twenty times their waiting time.

Three pipes tie them to the process that serves: `work` (a byte: there is something to do), `hints` (lines: what their commits
changed; on PostgreSQL the database carries those) and `alive`, which nobody ever writes to: it ends when the serving process
does, however it dies. The messenger is one more process, with a pipe of its own that wakes it: missions never wait for a
receiver of messages.
"""

import multiprocessing
import multiprocessing.connection
import os
import select
import signal
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import cv2
import structlog

from stillroom import garbage, logs, tracing
from stillroom.errors import Unavailable
from stillroom.pipeline.update import ResolverName
from stillroom.service import retaining
from stillroom.service.decisions import AT_ONCE, expire
from stillroom.service.fleet import replaying
from stillroom.service.fleet.alerts import watch
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.judging import judge
from stillroom.service.fleet.shadowing import run_next_beside
from stillroom.service.messages.messenger import Messenger
from stillroom.service.processing import process_claimed
from stillroom.settings import Messaging
from stillroom.store import lanes
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.hints import Hint, decode, encode

IDLE_S = 5.0
"""A worker that was not woken looks for work this often, in case a wake-up was lost."""
AWAY_S = 1.0
"""So soon it looks again where database or grid store did not answer."""
BESIDE_S = 5.0
"""So often it looks for what may wait: missions that are run again, beside or in a replay."""
SWEEP_S = 30.0
"""So late at most does a deadline take effect."""
GATHER_S = 1.0
"""So often at most the messenger looks what there is to tell: looking for each mission by itself would cost more than telling."""
FORGET_S = 3600.0
Job = tuple[Callable[..., None], tuple[Any, ...]]
"""What a process runs, and with what."""
_RESTART_PAUSE_S = 1.0

log = structlog.get_logger()


def run_worker(
    database_url: str,
    grid_store: str,
    resolvers: tuple[ResolverName, ...],
    work: Connection,
    hints: Connection,
    alive: Connection,
) -> None:
    """The whole life of a worker process."""
    _begin("stillroom work")
    database, grids = Database(database_url, partial(_pass_on, hints)), GridStore(grid_store)
    swept, looked_beside = -SWEEP_S, -BESIDE_S
    while not _ended(alive):
        pause = IDLE_S
        try:
            if monotonic() - swept >= SWEEP_S and not _sweep(database, grids):
                swept = monotonic()
            claimed = lanes.claim_or_rest(database)
            if isinstance(claimed, lanes.Claim):
                process_claimed(database, grids, claimed, resolvers)
                continue
            if monotonic() - looked_beside >= BESIDE_S:
                if run_next_beside(database, grids) or replaying.run_next(database, grids):
                    continue
                looked_beside = monotonic()
            pause = max(min(_pause(claimed), looked_beside + BESIDE_S - monotonic()), 0.0)
        except Unavailable as error:
            log.warning("missions wait", detail=error.detail, cause=repr(error.__cause__))
            pause = AWAY_S
        except Exception:
            log.exception("a mission could not be processed; it is tried again when its lease has ended")
        _wait(work, alive, pause)


def run_messenger(
    database_url: str, grid_store: str, messaging: Messaging, wake: Connection, alive: Connection
) -> None:
    """The whole life of the process that delivers messages."""
    _begin("stillroom tell")
    os.nice(5)  # missions first
    free, freed = multiprocessing.Pipe(duplex=False)
    os.set_blocking(free.fileno(), False)
    os.set_blocking(freed.fileno(), False)
    database, grids = Database(database_url), GridStore(grid_store)
    messenger = Messenger(database, grids, messaging, finished=partial(_ring, freed))
    forgot = -FORGET_S
    while not _ended(alive):
        looked, pause = monotonic(), IDLE_S
        try:
            if monotonic() - forgot >= FORGET_S:
                messenger.forget()
                forgot = monotonic()
            pause = messenger.step()
        except Exception:
            log.exception("messages could not be looked at; they are again in a moment")
        if wake in _rest((wake, free), alive, pause):
            _rest((free,), alive, max(looked + GATHER_S - monotonic(), 0.0))
    messenger.close()


def _begin(name: str) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the serving process, which ends `alive`
    cv2.setNumThreads(1)
    logs.configure()
    tracing.configure()
    garbage.keep_what_is_there()
    with suppress(OSError):  # tells the processes apart, where the system has such names
        Path("/proc/self/comm").write_text(name)


def _sweep(database: Database, grids: GridStore) -> bool:
    """Whether there may be more to sweep at once."""
    try:
        uncounted = catch_up(database)
        judge(database)
        watch(database)
        return expire(database) == AT_ONCE or uncounted > 0 or retaining.sweep(database, grids)
    except Exception:
        log.exception("deadlines and the fleet's figures could not be looked at; missions go on")
        return False


def _pause(ready_in: float | None) -> float:
    """How long to rest: until a lease of another worker ends, if it then has not been renewed."""
    return IDLE_S if ready_in is None else min(max(ready_in, 0.05), IDLE_S)


def _ended(alive: Connection) -> bool:
    return bool(select.select([alive], [], [], 0)[0])


def _wait(work: Connection, alive: Connection, seconds: float) -> None:
    until = monotonic() + seconds
    while readable := select.select([work, alive], [], [], max(until - monotonic(), 0.0))[0]:
        if alive in readable:
            return
        with suppress(BlockingIOError):  # another was faster, and does what there is to do
            os.read(work.fileno(), 1)  # one byte wakes one worker
            return


def _pass_on(hints: Connection, hint: Hint) -> None:
    with suppress(OSError):  # the serving process is gone; the result is committed
        os.write(
            hints.fileno(), f"{encode(hint)}\n".encode()
        )  # shorter than PIPE_BUF: lines of several workers don't mix


def _ring(bell: Connection) -> None:
    with suppress(BlockingIOError):  # it rings already
        os.write(bell.fileno(), b"\n")


def _rest(bells: Sequence[Connection], alive: Connection, seconds: float) -> Sequence[Connection]:
    """Until one of the bells rings; those that did. Each is heard once, however often it rang."""
    readable, _, _ = select.select([*bells, alive], [], [], seconds)
    rang = [bell for bell in bells if bell in readable]
    for bell in rang:
        with suppress(BlockingIOError):
            os.read(bell.fileno(), 65536)
    return rang


class Workers:
    """Starts `count` worker processes, and again each that dies, until `stop`.

    With `messaging` also the process that delivers messages, where there are workers at all.
    """

    def __init__(
        self,
        database_url: str,
        grid_store: str,
        resolvers: tuple[ResolverName, ...],
        count: int,
        hear: Callable[[Hint], None],
        messaging: Messaging | None = None,
    ) -> None:
        self._hear = hear
        self._work_out, self._work_in = multiprocessing.Pipe(duplex=False)
        self._hints_out, self._hints_in = multiprocessing.Pipe(duplex=False)
        self._alive_out, self._alive_in = multiprocessing.Pipe(duplex=False)
        self._bell_out, self._bell_in = multiprocessing.Pipe(duplex=False)
        for pipe in (self._work_out, self._work_in, self._bell_out, self._bell_in):
            os.set_blocking(pipe.fileno(), False)
        work = database_url, grid_store, resolvers, self._work_out, self._hints_in, self._alive_out
        self._jobs: list[Job] = [(run_worker, work)] * count
        if messaging is not None and count:
            self._jobs.append((run_messenger, (database_url, grid_store, messaging, self._bell_out, self._alive_out)))
        self._stopping = False
        self._processes = [self._start(job) for job in self._jobs]
        self._threads = [
            threading.Thread(target=target, name=target.__name__, daemon=True)
            for target in (self._supervise, self._listen)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def pids(self) -> list[int]:
        return [process.pid for process in self._processes if process.pid is not None]

    def wake(self) -> None:
        """There is something to do."""
        _ring(self._work_in)

    def wake_messenger(self) -> None:
        """There is something to tell."""
        _ring(self._bell_in)

    def stop(self, patience_s: float = 20.0) -> None:
        """Lets each worker finish the mission it has."""
        self._stopping = True
        self._alive_in.close()
        until = monotonic() + patience_s
        for process in self._processes:
            process.join(max(until - monotonic(), 0))
            if process.is_alive():
                process.kill()

    def _start(self, job: Job) -> SpawnProcess:
        # there is a worker for every core: the linear algebra of one must not spread over those of the others
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        target, arguments = job
        process = multiprocessing.get_context("spawn").Process(target=target, args=arguments, daemon=True)
        process.start()
        return process

    def _supervise(self) -> None:
        while not self._stopping and self._processes:
            multiprocessing.connection.wait([process.sentinel for process in self._processes])
            for index, process in enumerate(self._processes):
                if not self._stopping and not process.is_alive():
                    log.error("a worker died and is started again", pid=process.pid, exitcode=process.exitcode)
                    sleep(_RESTART_PAUSE_S)
                    self._processes[index] = self._start(self._jobs[index])

    def _listen(self) -> None:
        rest = b""
        while chunk := os.read(self._hints_out.fileno(), 65536):
            *lines, rest = (rest + chunk).split(b"\n")
            for line in lines:
                hint = decode(line.decode())
                if hint is not None:
                    self._hear(hint)
