"""`make load-large`: 10,000 robots with 100 missions each in the database; an upload must not take longer than with none.

What is measured is the service's own work without a network, on PostgreSQL and a folder: receiving a mission, claiming it, and
what else each upload asks the database. The plans of these questions are looked at, too: each has to be answered by an index.
"""

import argparse
import logging
import secrets
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import psycopg
import sqlalchemy as sa
import structlog

from stillroom.documents.api import NewRobot
from stillroom.service import accounts, missions, uploads
from stillroom.service.processing import process_next
from stillroom.service.robots import add_robot
from stillroom.store import lanes
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.migrate import migrate
from tests import postgresql
from tests.homes import ORIGIN, RESOLUTION, home, png
from tests.load.robots import with_text

ROBOTS, MISSIONS = 10_000, 100
WARM, UPLOADS = 20, 150
MOST_SLOWER = 1.3
"""Of medians: a shared machine is not even."""
FILL = (
    (
        "INSERT INTO robot (id, name, token_hash, claim_code_hash, created_at) "
        "SELECT 'many-' || n, 'many', 'hash-' || n, '', now() FROM generate_series(1, {robots}) n"
    ),
    (
        "INSERT INTO map (robot_id, name, title, ordinal, review, head, epoch, sequence, used_ids, created_at) "
        "SELECT 'many-' || n, 'ground', 'ground', 1, 'automatic', 1, 0, {missions}, '{{}}', now() FROM generate_series(1, {robots}) n"
    ),
    "INSERT INTO lane (map_id) SELECT id FROM map WHERE robot_id LIKE 'many-%'",
    (
        "INSERT INTO mission (map_id, key, epoch, sequence, status, attempts, grid, meta, meta_digest, received_at, finished_at, "
        "outcome, base_version, version, algorithm, result) SELECT map.id, n::text, 0, n, 'done', 1, md5(map.id::text || n), "
        "json_build_object('sequence', n, 'firmware', '5.1', 'model', 'S9'), md5(n::text), now() - n * interval '1 day', "
        "now() - n * interval '1 day', 'updated', 1, 1, '1.0.0', json_build_object('reason', repeat('as many words ', 20)) "
        "FROM map, generate_series(1, {missions}) n WHERE map.robot_id LIKE 'many-%'"
    ),
    (
        "INSERT INTO event (robot_id, map_id, kind, data, created_at) SELECT robot_id, map.id, 'mission', "
        "json_build_object('mission', n::text, 'outcome', 'updated', 'version', 1), now() "
        "FROM map, generate_series(1, {missions}) n WHERE map.robot_id LIKE 'many-%'"
    ),
    "ANALYZE",
)
QUESTIONS = {
    "a token": "SELECT id FROM robot WHERE token_hash = 'hash-77'",
    "a map": "SELECT id FROM map WHERE robot_id = 'many-77' AND name = 'ground'",
    "a mission by its id": "SELECT id FROM mission WHERE map_id = 77 AND key = '50'",
    "the next mission": "SELECT id FROM mission WHERE map_id = 77 AND status <> 'done' ORDER BY epoch, sequence, id LIMIT 1",
    "a lane that is ready": "SELECT map_id FROM lane WHERE ready_at <= 1e10 ORDER BY ready_at LIMIT 1 FOR UPDATE SKIP LOCKED",
    "the queue": "SELECT count(*) FROM (SELECT 1 FROM mission WHERE status <> 'done' LIMIT 10001) q",
    "a map's newest missions": "SELECT id FROM mission WHERE map_id = 77 ORDER BY id DESC LIMIT 101",
    "events of a robot": "SELECT id FROM event WHERE robot_id = 'many-77' AND id > 0 ORDER BY id LIMIT 100",
}


class _Robot:
    """That uploads to one database, step by step; `spent`: milliseconds of each part."""

    def __init__(self, database: Database, grids: GridStore) -> None:
        self._database, self._grids, self._picture = database, grids, png(home())
        self._token = add_robot(database, NewRobot(id="measured")).token
        self.spent: dict[str, list[float]] = {}

    def upload(self, number: int) -> None:
        database, grids = self._database, self._grids
        grid = "image/png", with_text(self._picture, f"{database.url.database} {number}")
        meta = f'{{"sequence": {number}, "resolution": {RESOLUTION}, "origin": {ORIGIN}}}'.encode()
        self._timed("token", lambda: accounts.by_token(database, self._token, None))
        self._timed("receive", lambda: uploads.receive(database, grids, "measured", "ground", str(number), grid, meta))
        self._timed("process", lambda: process_next(database, grids))
        self._timed("show", lambda: missions.mission_by_key(database, "measured", "ground", str(number)))
        self._timed("queue", lambda: _backlog(database))

    def _timed(self, part: str, do: Callable[[], object]) -> None:
        began = time.perf_counter()
        do()
        self.spent.setdefault(part, []).append(1000 * (time.perf_counter() - began))


def _backlog(database: Database) -> lanes.Backlog:
    with database.read() as tx:
        return lanes.backlog(tx, 10_000)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=ROBOTS)
    parser.add_argument("--missions", type=int, default=MISSIONS, help="of each robot")
    options = parser.parse_args(arguments)
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
    folder = Path(tempfile.gettempdir()) / f"stillroom-large-{secrets.token_hex(4)}"
    server = postgresql.Server(folder, postgresql.SETTINGS)
    try:
        with server.started():
            databases = []
            for name in ("small", "large"):
                server.execute(f"CREATE DATABASE {name}")
                databases.append(Database(server.url(name)))
                migrate(databases[-1])
        for statement in FILL:
            server.execute(statement.format(robots=options.robots, missions=options.missions), database="large")
        with tempfile.TemporaryDirectory() as store:
            empty, full = (_Robot(database, GridStore(store)) for database in databases)
            for number in range(WARM + UPLOADS):  # in turn: whatever else the machine does concerns both
                empty.upload(number)
                full.upload(number)
        slow = _told(empty.spent, full.spent)
        scanned = _plans(server.url("large"))
        with databases[-1].read() as tx:
            size = tx.execute(sa.text("SELECT pg_size_pretty(pg_database_size(current_database()))")).scalar_one()
        print(f"\n{options.robots * options.missions} missions; the database has {size}")
        for database in databases:
            database.dispose()
    finally:
        server.stop()
    return 1 if slow or scanned else 0


def _told(empty: dict[str, list[float]], full: dict[str, list[float]]) -> list[str]:
    """Parts that take longer than they may."""
    print(f"{'ms':<12}{'empty p50':>12}{'p99':>8}{'full p50':>12}{'p99':>8}")
    slow = []
    for part in empty:
        before, after = (np.percentile(spent[part][WARM:], (50, 99)) for spent in (empty, full))
        print(f"{part:<12}{before[0]:12.2f}{before[1]:8.2f}{after[0]:12.2f}{after[1]:8.2f}")
        if after[0] > before[0] * MOST_SLOWER + 0.2:
            slow.append(part)
    return slow


def _plans(url: str) -> list[str]:
    """Questions that are not answered by an index."""
    scanned = []
    with psycopg.connect(url, autocommit=True) as connection:
        for name, question in QUESTIONS.items():
            plan = "\n".join(
                row[0] for row in connection.execute(f"EXPLAIN (ANALYZE, COSTS OFF, TIMING OFF) {question}")
            )
            used = [line.strip(" ->") for line in plan.split("\n") if "Scan" in line]
            print(f"{name:<26}{'; '.join(used)[:110]}")
            if "Seq Scan" in plan:
                scanned.append(name)
    return scanned


if __name__ == "__main__":
    sys.exit(main())
