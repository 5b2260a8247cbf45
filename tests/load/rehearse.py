"""`make rehearse`: a backup taken while robots upload is restored beside the service, and must hold what it was taken of.

The database first, then the grids: these are only ever added, so that every grid which the database refers to is there.
"""

import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import psycopg

from stillroom.store.grids import GridStore
from tests import object_store, postgresql
from tests.load.driving import Driver, Load
from tests.load.load import add_robots, check, settle
from tests.load.robots import draw_homes
from tests.load.stack import Stack
from tests.ports import free_port

ROBOTS, SECONDS, RATE = 12, 12.0, 3.0


def main() -> int:
    homes = draw_homes(4, 4)
    with tempfile.TemporaryDirectory() as folder, Stack(Path(folder) / "service", "postgresql", 1, 1) as stack:
        assert stack.database is not None
        assert stack.store is not None
        robots = add_robots(stack, homes, ROBOTS, "kept")
        kept = Driver(stack.ports, robots, Load(RATE, SECONDS / 2)).run()
        going_on = Driver(stack.ports, robots, Load(RATE, SECONDS, wait_s=0))
        thread = threading.Thread(target=going_on.run)
        thread.start()
        dump = Path(folder) / "stillroom.dump"
        _program("pg_dump", "--format=custom", f"--file={dump}", stack.database.url("stillroom"))
        print(f"  database saved: {dump.stat().st_size / 2**20:.1f} MB", flush=True)
        copied = _copy(stack.store.url("grids"), stack.store.url("saved"))
        print(f"  grids saved: {copied}", flush=True)
        thread.join()
        settle(stack)
        holds = check(stack, [*kept.acknowledged, *going_on.figures.acknowledged])

        stack.database.execute("CREATE DATABASE restored")
        _program("pg_restore", "--exit-on-error", f"--dbname={stack.database.url('restored')}", str(dump))
        stack.environment["STILLROOM_DATABASE_URL"] = stack.database.url("restored")
        stack.environment["STILLROOM_GRID_STORE_URL"] = stack.store.url("saved")
        with psycopg.connect(stack.database.url("restored")) as connection:
            (missions,) = connection.execute("SELECT count(*) FROM mission").fetchone() or (0,)
        print(f"  restored: {missions} missions", flush=True)
        # What robots sent after the database was saved is in the saved grids and in no row: orphans, until it is sent again.
        holds = check(stack, kept.acknowledged, 3600) and holds
        port = free_port()
        stack.ports = [port]
        stack.serve(port)
        stack.wait_until_ready()
        again = Driver([port], robots, Load(RATE, 4.0)).run()
        settle(stack)
        print(f"  {len(again.acknowledged)} missions more on what was restored", flush=True)
        holds = check(stack, again.acknowledged, 3600) and not again.bad and holds
        return 0 if holds else 1


def _copy(source: str, target: str) -> int:
    """As `aws s3 sync` or `rclone sync` do."""
    for name, value in object_store.ENVIRONMENT.items():
        os.environ[name] = value
    there, here = GridStore(source), GridStore(target)
    keys = [stored.path.rpartition("/")[2] for stored in there.list()]
    for key in keys:
        here.put(there.get(key))
    return len(keys)


def _program(name: str, *arguments: str) -> None:
    folder = postgresql.programs()
    path = folder / name if folder is not None and (folder / name).exists() else name
    subprocess.run([str(path), *arguments], check=True)


if __name__ == "__main__":
    sys.exit(main())
