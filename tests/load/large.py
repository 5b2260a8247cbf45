"""`make load-large`: 10,000 robots with 100 missions each in the database; an upload must not take longer than with none.

What is measured is the service's own work without a network, on PostgreSQL and a folder: receiving a mission, claiming it, and
what else each upload asks the database. The plans of these questions are looked at, too: each has to be answered by an index.
"""

import argparse
import secrets
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import psycopg
import sqlalchemy as sa

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

ROBOTS, MISSIONS, UPLOADS = 10_000, 100, 150
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


def _uploads(database: Database, grids: GridStore, name: str) -> dict[str, list[float]]:
    """Milliseconds of each part of an upload."""
    token = add_robot(database, NewRobot(id=name)).token
    picture, spent = png(home()), dict[str, list[float]]()

    def timed(part: str, do: Callable[[], object]) -> None:
        began = time.perf_counter()
        do()
        spent.setdefault(part, []).append(1000 * (time.perf_counter() - began))

    for number in range(UPLOADS):
        grid = with_text(picture, f"{name} {number}")
        meta = f'{{"sequence": {number}, "resolution": {RESOLUTION}, "origin": {ORIGIN}}}'.encode()
        timed("token", lambda: accounts.by_token(database, token, None))
        arguments = (database, grids, name, "ground", str(number), ("image/png", grid), meta)
        timed("receive", lambda arguments=arguments: uploads.receive(*arguments))  # type: ignore[misc]
        timed("process", lambda: process_next(database, grids))
        timed("show", lambda number=number: missions.mission_by_key(database, name, "ground", str(number)))  # type: ignore[misc]
        timed("queue", lambda: _backlog(database))
    return spent


def _backlog(database: Database) -> lanes.Backlog:
    with database.read() as tx:
        return lanes.backlog(tx, 10_000)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=ROBOTS)
    parser.add_argument("--missions", type=int, default=MISSIONS, help="of each robot")
    options = parser.parse_args(arguments)
    folder = Path(tempfile.gettempdir()) / f"stillroom-large-{secrets.token_hex(4)}"
    server = postgresql.Server(folder, postgresql.SETTINGS)
    try:
        with server.started():
            server.execute("CREATE DATABASE large")
        database = Database(server.url("large"))
        migrate(database)
        with tempfile.TemporaryDirectory() as store:
            grids = GridStore(store)
            _uploads(database, grids, "warm")
            empty = _uploads(database, grids, "before")
            for statement in FILL:
                server.execute(statement.format(robots=options.robots, missions=options.missions), database="large")
            full = _uploads(database, grids, "after")
        slow = _told(empty, full)
        scanned = _plans(server.url("large"))
        with database.read() as tx:
            size = tx.execute(sa.text("SELECT pg_size_pretty(pg_database_size(current_database()))")).scalar_one()
        print(f"\n{options.robots * options.missions} missions; the database has {size}")
        database.dispose()
    finally:
        server.stop()
    return 1 if slow or scanned else 0


def _told(empty: dict[str, list[float]], full: dict[str, list[float]]) -> list[str]:
    """Parts that take longer than they may."""
    print(f"{'ms':<12}{'empty p50':>12}{'p99':>8}{'full p50':>12}{'p99':>8}")
    slow = []
    for part in empty:
        before, after = (np.percentile(spent[part], (50, 99)) for spent in (empty, full))
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
