"""Who waits for a map to change, inside one process. Only hints pass here: the truth is read from the database every time."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class _Watch:
    map_id: int | None
    """None: every map."""
    loop: asyncio.AbstractEventLoop
    event: asyncio.Event


class Signals:
    """`wake_workers` is called after every commit that gave the workers something to do."""

    def __init__(self, wake_workers: Callable[[], None] = lambda: None) -> None:
        self.wake_workers = wake_workers
        self.closed = False
        self._watches: set[_Watch] = set()
        self._lock = threading.Lock()

    @contextmanager
    def watch(self, map_id: int | None = None) -> Iterator[asyncio.Event]:
        """An event that is set whenever the map changed; the one who waits clears it before looking."""
        watch = _Watch(map_id, asyncio.get_running_loop(), asyncio.Event())
        with self._lock:
            self._watches.add(watch)
        try:
            yield watch.event
        finally:
            with self._lock:
                self._watches.discard(watch)

    def changed(self, map_id: int) -> None:
        """A commit changed this map. From any thread."""
        self._set(lambda watch: watch.map_id in (None, map_id))

    def close(self) -> None:
        """The process is about to end: all who wait should stop."""
        self.closed = True
        self._set(lambda _watch: True)

    def _set(self, concerns: Callable[[_Watch], bool]) -> None:
        with self._lock:
            watches = [watch for watch in self._watches if concerns(watch)]
        for watch in watches:
            watch.loop.call_soon_threadsafe(watch.event.set)
