"""`make bench-fleet`: how fast a dashboard's questions are answered about a year of a large fleet, on SQLite and PostgreSQL.

Each question goes through the whole application, without a network. Ends with 1 where a question takes longer than it may.
"""

import argparse
import gc
import logging
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import numpy as np
import structlog
from starlette.testclient import TestClient

from stillroom.app import create_app
from stillroom.service.fleet.seeding import Seed, seed_fleet
from stillroom.settings import Settings
from stillroom.store.database import Database
from stillroom.store.migrate import migrate
from tests import postgresql

MOST_MS = {"postgresql": 150, "sqlite": 400}
"""95 of 100 answers are not slower."""
TOKEN = "operator-of-the-benchmark"


def questions(today: date, cause: str) -> dict[str, str]:
    def days(count: int) -> str:
        return f"from={today - timedelta(days=count - 1)}&to={today}"

    year, month = days(365), days(30)
    return {
        "rates, a year by day": f"failure-rates?{year}&group_by=day",
        "rates, a year by week": f"failure-rates?{year}&group_by=week",
        "rates, a year by firmware": f"failure-rates?{year}&group_by=firmware",
        "rates, a year by model": f"failure-rates?{year}&group_by=model",
        "rates, a year by algorithm": f"failure-rates?{year}&group_by=algorithm",
        "rates, a year by size": f"failure-rates?{year}&group_by=size",
        "rates, a year by cause": f"failure-rates?{year}&group_by=cause",
        "rates, a year of one model by day": f"failure-rates?{year}&group_by=day&model=S9",
        "rates, 30 days by day": f"failure-rates?{month}&group_by=day",
        "rates, today": f"failure-rates?{days(1)}",
        "rates as CSV, a year by week": f"failure-rates.csv?{year}&group_by=week",
        "filters": "filters",
        "worst robots, a year": f"robots?{year}&sort=-lower_bound",
        "worst robots, 30 days": f"robots?{month}",
        "causes, a year": f"causes?{year}",
        "causes, 30 days": f"causes?{month}",
        "one cause, a year": f"causes/{cause}?{year}",
        "missions of a cause": f"missions?{year}&cause={cause}",
        "missions that escaped": f"missions?{year}&escaped=true",
        "missions that failed": f"missions?{year}",
    }


@contextmanager
def database_url(engine: str, folder: Path) -> Iterator[str]:
    if engine == "sqlite":
        yield f"sqlite:///{folder / 'fleet.sqlite'}"
        return
    server = postgresql.Server(folder / "postgresql")
    try:
        with server.started():
            server.execute("CREATE DATABASE fleet")
        yield server.url("fleet")
    finally:
        server.stop()


def measure(engine: str, folder: Path, what: Seed, times: int) -> bool:
    """Whether all is fast enough."""
    with database_url(engine, folder) as url:
        settings = Settings(folder, url, str(folder / "grids"), TOKEN)
        database = Database(url)
        migrate(database)
        began = time.perf_counter()
        seed_fleet(database, what, lambda _text: None)
        tell(f"{engine}: {what.missions:,} missions seeded in {time.perf_counter() - began:.0f} s")
        database.dispose()
        app = create_app(settings)
        with TestClient(app, headers={"Authorization": f"Bearer {TOKEN}"}) as http:
            causes = http.get("/api/v1/fleet/causes").raise_for_status().json()["items"]
            gc.collect()
            gc.freeze()  # as `stillroom serve` does
            fast = [
                _ask(http, name, path, MOST_MS[engine], times)
                for name, path in questions(what.until, causes[0]["id"]).items()
            ]
        app.state.parts.database.dispose()
    return all(fast)


def tell(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _ask(http: TestClient, name: str, path: str, most_ms: int, times: int) -> bool:
    taken, worked = [], []
    for _ in range(times + 1):
        began, cpu = time.perf_counter(), time.process_time()
        answer = http.get(f"/api/v1/fleet/{path}").raise_for_status()
        taken.append((time.perf_counter() - began) * 1000)
        worked.append((time.process_time() - cpu) * 1000)
    middle, high = np.percentile(taken[1:], [50, 95])  # the first warms up
    mark = "" if high <= most_ms else f"  over {most_ms} ms"
    cpu = np.median(worked[1:])  # of this process; on SQLite that is all of it
    size = len(answer.content) / 1000
    tell(f"  {name:36} p50 {middle:6.1f} ms  p95 {high:6.1f} ms  CPU {cpu:6.1f} ms  {size:7.1f} kB{mark}")
    return not mark


def main() -> int:
    # a line in the log for each question is no part of the figures
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--missions", type=int, default=1_000_000)
    options.add_argument("--robots", type=int, default=10_000)
    options.add_argument("--times", type=int, default=20)
    options.add_argument("--engine", choices=tuple(MOST_MS))
    chosen = options.parse_args()
    what = Seed(chosen.missions, chosen.robots, 365, 1, datetime.now(UTC).date())
    engines = [chosen.engine] if chosen.engine else list(MOST_MS)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)  # PostgreSQL runs as nobody where this runs as root
        fast = [measure(engine, Path(folder), what, chosen.times) for engine in engines]
    return 0 if all(fast) else 1


if __name__ == "__main__":
    sys.exit(main())
