"""Who waits for a map to change, inside one process."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from stillroom.store.hints import Hint

EVERY, NONE_YET = -1, -2
"""Instead of a map's number."""


@dataclass(eq=False)
class Watch:
    map_id: int
    loop: asyncio.AbstractEventLoop
    changed: asyncio.Event
    """Set whenever the map changed; the one who waits clears it before looking."""

    def follow(self, map_id: int) -> None:
        """What is watched from now on. From any thread."""
        self.map_id = map_id


class Signals:
    """Hears hints and passes them on: that there is something to do, or to tell, and to whoever watches that a map changed."""

    def __init__(
        self, wake_workers: Callable[[], None] = lambda: None, wake_messenger: Callable[[], None] = lambda: None
    ) -> None:
        self.wake_workers, self.wake_messenger = wake_workers, wake_messenger
        self.closed = False
        self._watches: set[Watch] = set()
        self._lock = threading.Lock()

    @contextmanager
    def watch(self, map_id: int = EVERY) -> Iterator[Watch]:
        watch = Watch(map_id, asyncio.get_running_loop(), asyncio.Event())
        with self._lock:
            self._watches.add(watch)
        try:
            yield watch
        finally:
            with self._lock:
                self._watches.discard(watch)

    def hear(self, hint: Hint) -> None:
        """From any thread."""
        if hint.kind == "work":
            self.wake_workers()
        elif hint.kind == "message":
            self.wake_messenger()
        else:
            self._set(lambda watch: watch.map_id in (EVERY, hint.map_id))

    def catch_up(self) -> None:
        """Hints may have been missed: all look for themselves."""
        self.wake_workers()
        self.wake_messenger()
        self._set(lambda _watch: True)

    def close(self) -> None:
        """The process is about to end: all who wait should stop."""
        self.closed = True
        self._set(lambda _watch: True)

    def _set(self, concerns: Callable[[Watch], bool]) -> None:
        with self._lock:
            watches = [watch for watch in self._watches if concerns(watch)]
        for watch in watches:
            watch.loop.call_soon_threadsafe(watch.changed.set)
