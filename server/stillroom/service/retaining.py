"""Homes say how long they keep what their robots sensed; what is older is deleted by and by."""

from datetime import timedelta

from stillroom.documents.privacy import Retention, RetentionDocument
from stillroom.service.access import Person, signature
from stillroom.service.erasing import sweep_grids
from stillroom.service.looking import KEPT
from stillroom.store import clock, erasing, lanes, looking, retaining
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.retaining import RetentionRow

AT_ONCE = 100


def show(database: Database, caller: Person) -> RetentionDocument:
    assert caller.email is not None
    with database.read() as tx:
        row = retaining.of_home(tx, caller.email)
        return _document(None if row is None else row.days, 0)


def choose(database: Database, caller: Person, wanted: Retention, dry_run: bool) -> RetentionDocument:
    """From now on; `dry_run`: only says what it would come to."""
    assert caller.email is not None
    with database.write() as tx:
        now, older = clock.now(tx), 0
        if wanted.days is not None:
            older = retaining.count_old(tx, caller.email, now - timedelta(days=wanted.days))
        if not dry_run and wanted.days is None:
            retaining.choose_nothing(tx, caller.email)
        elif not dry_run and wanted.days is not None:
            retaining.choose(tx, RetentionRow(caller.email, wanted.days, signature(caller), now))
        return _document(wanted.days, older)


def sweep(database: Database, grids: GridStore) -> bool:
    """Forgets what homes keep no longer, grids that nothing refers to, and old entries of logs. Whether some may be left."""
    more = False
    with database.read() as tx:
        homes, now = retaining.every(tx), clock.now(tx)
    for home in homes:
        with database.read() as tx:
            found = retaining.old(tx, home.home, now - timedelta(days=home.days), AT_ONCE)
        for one in found:
            with database.write(durable=False) as tx:
                lanes.lock(tx, one.map_id)
                if one in retaining.old(tx, home.home, now - timedelta(days=home.days), AT_ONCE):
                    retaining.forget_grid(tx, one)
                    erasing.discard(tx, [one.grid], now)
        more |= len(found) == AT_ONCE
    with database.read() as tx:
        waiting = bool(erasing.discarded(tx, 1))
    if waiting:
        more |= sweep_grids(database, grids)
    with database.write(durable=False) as tx:
        more |= looking.forget(tx, now - KEPT, AT_ONCE) == AT_ONCE
    return more


def _document(days: int | None, older: int) -> RetentionDocument:
    if days is None:
        text = "What the robots sensed is kept as long as the home."
    else:
        text = (
            f"What the robots sensed is deleted {days} days after it came, but for the newest {retaining.NEWEST} versions of each map, versions that "
            f"are pinned or have a name, and questions that wait. The shapes of rooms stay in the history."
        )
    return RetentionDocument(days=days, newest=retaining.NEWEST, missions=older, effect=text)
