"""`make load-cost`: CPU milliseconds of a mission by part, and bytes that it leaves behind; one process, on PostgreSQL and S3.

CPU time of the thread that works: what others do on the machine disturbs it little. The database's and the store's own processes
are in the figures of `make load`.
"""

import json
import logging
import os
import secrets
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import sqlalchemy as sa
import structlog

from stillroom.documents.api import NewRobot
from stillroom.documents.grids import read_grid, read_mission_map
from stillroom.documents.stored import decode_map
from stillroom.pipeline.update import create_semantic_map, update_map
from stillroom.service import gathering, maps, processing, uploads
from stillroom.service.processing import process_next
from stillroom.service.robots import add_robot
from stillroom.service.versions import new_version
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.migrate import migrate
from tests import object_store, postgresql
from tests.load.robots import LoadRobot, draw_homes
from tests.load.stack import DURABLE

HOMES, MISSIONS = 8, 12


class Clock:
    """CPU seconds of this thread, by part; what a part asks of another counts for the other alone."""

    def __init__(self) -> None:
        self.spent: dict[str, list[float]] = {}
        self._now: dict[str, float] = {}
        self._stack: list[str] = []
        self._since = 0.0

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        self._charge()
        self._stack.append(name)
        try:
            yield
        finally:
            self._charge()
            self._stack.pop()

    def mission_ends(self) -> None:
        for name, seconds in self._now.items():
            self.spent.setdefault(name, []).append(1000 * seconds)
        self._now.clear()

    def timed(self, name: str, do: Any) -> Any:
        def timed(*arguments: Any, **named: Any) -> Any:
            with self.part(name):
                return do(*arguments, **named)

        return timed

    def _charge(self) -> None:
        now = time.thread_time()
        if self._stack:
            self._now[self._stack[-1]] = self._now.get(self._stack[-1], 0.0) + now - self._since
        self._since = now


def _measure(database: Database, grids: GridStore, clock: Clock) -> None:
    homes = draw_homes(HOMES, MISSIONS)
    robots = [
        LoadRobot(f"cost-{n}", add_robot(database, NewRobot(id=f"cost-{n}")).token, home)
        for n, home in enumerate(homes)
    ]
    for number in range(MISSIONS):
        for robot in robots:
            base = None if number == 0 else _base(database, robot.id)
            meta, grid = json.dumps(robot.meta(number, base)).encode(), robot.grid(number)
            with clock.part("receive: checks"):
                uploads.receive(database, grids, robot.id, "ground", str(number), ("image/png", grid), meta)
            with clock.part("process: rest"):
                process_next(database, grids)
            if number > 1:
                clock.mission_ends()
            else:
                clock.mission_ends()
                clock.spent.clear()


def _base(database: Database, robot: str) -> Mapping[str, Any]:
    return maps.show_map(database, robot, "ground")


def _bytes(database: Database) -> None:
    query = (
        "SELECT avg(pg_column_size(m.*)) + avg(octet_length(m.result::text)) AS mission, "
        "(SELECT avg(octet_length(packed)) FROM version) AS document, "
        "(SELECT avg(pg_column_size(version.*)) FROM version) AS stored FROM mission m"
    )
    with database.read() as tx:
        row = tx.execute(sa.text(query)).one()
        size = tx.execute(
            sa.text(
                "SELECT sum(pg_total_relation_size(c.oid)) FROM pg_class c JOIN pg_namespace n "
                "ON n.oid = c.relnamespace WHERE n.nspname = 'public' AND c.relkind = 'r'"
            )
        ).scalar_one()
    print(f"bytes: a map's document {float(row.document):.0f} (compressed), a version's row {float(row.stored):.0f}")
    print(
        f"all tables with their indexes {int(size) / HOMES / MISSIONS:.0f} bytes a mission, of {HOMES * MISSIONS} missions"
    )


def main() -> int:
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
    os.environ |= object_store.ENVIRONMENT
    folder = Path(tempfile.gettempdir()) / f"stillroom-cost-{secrets.token_hex(4)}"
    server, store = postgresql.Server(folder.with_suffix(".postgresql"), DURABLE), object_store.ObjectStore(folder)
    clock = Clock()
    try:
        with server.started():
            server.execute("CREATE DATABASE cost")
        store.ensure()
        database, grids = Database(server.url("cost")), GridStore(store.url("cost"))
        migrate(database)
        with (
            patch.object(GridStore, "put", clock.timed("store", GridStore.put)),
            patch.object(GridStore, "get", clock.timed("store", GridStore.get)),
            patch.object(uploads, "read_grid", clock.timed("receive: decode", read_grid)),
            patch.object(gathering, "read_mission_map", clock.timed("process: decode", read_mission_map)),
            patch.object(gathering, "update_map", clock.timed("pipeline", update_map)),
            patch.object(gathering, "create_semantic_map", clock.timed("pipeline", create_semantic_map)),
            patch.object(gathering, "decode_map", clock.timed("process: documents", decode_map)),
            patch.object(processing, "new_version", clock.timed("process: documents", new_version)),
            patch.object(sa.Connection, "execute", clock.timed("database client", sa.Connection.execute)),
        ):
            _measure(database, grids, clock)
        print(f"CPU ms of a mission of {HOMES} homes of 5 to 12 rooms, {MISSIONS - 2} missions of each")
        for name, spent in sorted(clock.spent.items(), key=lambda item: -sum(item[1])):
            print(
                f"{name:<20} mean {np.mean(spent):7.2f}  p50 {np.percentile(spent, 50):7.2f}  p99 {np.percentile(spent, 99):7.2f}"
            )
        print(f"{'sum':<20} mean {sum(map(np.mean, clock.spent.values())):7.2f}")
        sizes = [stored.size for stored in grids.list()]
        print(f"bytes: a grid {np.mean(sizes):.0f} on average, {max(sizes)} at most")
        _bytes(database)
        database.dispose()
    finally:
        server.stop()
        store.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main())
