"""How much comes in: uploads are put off where more waits than the workers will come to soon, or more arrives at once than one
process can hold. A robot keeps its mission and sends it again; a queue without an end would only lose time and memory.
"""

import asyncio
import random
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from time import monotonic

from stillroom.errors import Unavailable
from stillroom.settings import QueueLimits
from stillroom.store import lanes
from stillroom.store.database import Database

AT_ONCE = 32
"""Uploads that a process receives at a time; each may be 32 MiB, and more in memory while it is read."""
MOST_BEFORE = 128
"""That wait for that, unread."""
MOST_WAITERS = 256
"""Uploads of a process that are received and wait to be processed, as robots may prefer; others are answered at once."""
LOOK_S = 1.0
"""The queue is looked at so often, not for every upload."""
LATER_S = (15, 45)
"""When to come again: not all at the same time."""


@dataclass
class Intake:
    """Of one process."""

    database: Callable[[], Database]
    limits: QueueLimits
    _receiving: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(AT_ONCE))
    _before: int = 0
    _waiters: int = 0
    _looked: float = -LOOK_S
    _refused: Unavailable | None = None

    async def check(self) -> None:
        """Raises Unavailable where the queue is too long, or nobody works on it, or nobody knows."""
        if monotonic() - self._looked >= LOOK_S:
            self._looked = monotonic()  # others go by what was found before
            self._refused = await asyncio.to_thread(self._look)
        if self._refused is not None:
            raise Unavailable(self._refused.detail, random.randint(*LATER_S)) from self._refused.__cause__

    def _look(self) -> Unavailable | None:
        try:
            with self.database().look() as tx:
                found = lanes.backlog(tx, self.limits.missions)
        except Unavailable as error:
            return error
        if found.missions > self.limits.missions:
            return Unavailable(f"More than {self.limits.missions} missions wait to be processed.")
        if found.oldest_s > self.limits.age_s:
            return Unavailable(f"Missions have been waiting for {found.oldest_s:.0f} s.")
        return None

    @asynccontextmanager
    async def receiving(self) -> AsyncIterator[None]:
        """While an upload is read and stored. Raises Unavailable where too many are at it."""
        if self._before >= MOST_BEFORE:
            raise Unavailable("Too many uploads arrive at once.", random.randint(1, 5))
        self._before += 1
        try:
            await self._receiving.acquire()
        finally:
            self._before -= 1
        try:
            yield
        finally:
            self._receiving.release()

    @contextmanager
    def waiting(self) -> Iterator[bool]:
        """Whether the caller may wait for its mission."""
        self._waiters += 1
        try:
            yield self._waiters <= MOST_WAITERS
        finally:
            self._waiters -= 1
