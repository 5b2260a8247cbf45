"""The log that an owner sees: who looked at the maps of a robot, who changed something, when, and from which network."""

import threading
from datetime import UTC, datetime, timedelta
from time import monotonic

from stillroom.documents.api import Page
from stillroom.documents.privacy import LogEntry
from stillroom.service.access import Person, signature
from stillroom.service.paging import page_of
from stillroom.store import clock, looking, robots
from stillroom.store.database import Database
from stillroom.store.looking import Access

EVERY_S = 60.0
"""Looks are written down so often at most: a page that is open asks all the time. Changes are at once."""
KEPT = timedelta(days=400)
_MOST_KNOWN = 10_000


class Log:
    """Of one process; `note` may be called by many threads."""

    def __init__(self) -> None:
        self._waiting: dict[Access, tuple[int, float]] = {}
        """Not written down yet, and when it was last."""
        self._lock = threading.Lock()

    def note(self, database: Database, who: Person, robot_id: str, did: str, what: str, source: str) -> None:
        now = datetime.now(UTC)
        access = Access(robot_id, int(now.timestamp() // 3600), signature(who), did, what[:200], source[:64])
        times = self._due(access)
        if times:
            with database.write(durable=False) as tx:
                looking.note(tx, access, times, clock.now(tx))

    def note_home(self, database: Database, who: Person, did: str, what: str, source: str) -> None:
        """All robots of a person's own home."""
        with database.read() as tx:
            found = robots.page(tx, robots.owned_by(who.email), "", robots.ALL)
        for robot in found:
            self.note(database, who, robot.id, did, what, source)

    def _due(self, access: Access) -> int:
        """How often it is to be noted now."""
        moment = monotonic()
        with self._lock:
            times, last = self._waiting.get(access, (0, -EVERY_S))
            if access.did == "look" and moment - last < EVERY_S:
                self._waiting[access] = times + 1, last
                return 0
            if len(self._waiting) >= _MOST_KNOWN:
                self._waiting.clear()
            self._waiting[access] = 0, moment
            return times + 1


def entries(database: Database, robot_id: str, cursor: int | None, limit: int) -> Page[LogEntry]:
    """The newest first; the cursor is a moment in microseconds."""
    before = None if cursor is None else datetime.fromtimestamp(min(cursor, 10**17) / 1e6, UTC)
    with database.read() as tx:
        rows = looking.entries(tx, robot_id, before, limit + 1)
    items, following = page_of(rows, limit, lambda row: str(round(row.last_at.timestamp() * 1e6)))
    return Page(
        items=[
            LogEntry.model_validate(
                {"at": row.last_at} | {name: getattr(row, name) for name in ("who", "did", "what", "source", "times")}
            )
            for row in items
        ],
        next=following,
    )
