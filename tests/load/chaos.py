"""`make chaos`: robots upload while processes are killed, the database is restarted and killed, the grid store is gone, a worker
is frozen past its lease, and a disk fills up. Afterwards `stillroom verify` must find everything that was acknowledged, processed
once and in order.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from tests import postgresql
from tests.load.driving import Driver, Load
from tests.load.load import HOMES, SORTIES, add_robots, check, settle
from tests.load.robots import Home, draw_homes
from tests.load.stack import Stack

EVERY_S = 8.0
"""From one kill of a serving process to the next."""
FROZEN_S = 13.0
"""Longer than a lease: another takes the mission, and both come to an end with it."""
SMALL_DISK_MB = 9


class Chaos:
    """What goes wrong, and when, while the robots upload."""

    def __init__(self, stack: Stack, seconds: float, seed: int) -> None:
        assert stack.database is not None
        assert stack.store is not None
        self._stack, self._random = stack, random.Random(seed)
        self._database, self._store = stack.database, stack.store
        self._began = time.monotonic()
        self._until = self._began + seconds
        self._over = threading.Event()
        self._lock = threading.Lock()
        gone_s = min(60.0, seconds / 5)
        self._plan: list[tuple[float, Callable[[], None]]] = [
            (0.10 * seconds, self._freeze_a_worker),
            (0.20 * seconds, self._restart_database),
            (0.32 * seconds, self._kill_database),
            (0.45 * seconds, lambda: self._lose_store(gone_s)),
            (0.80 * seconds, self._freeze_a_worker),
            (0.88 * seconds, self._kill_database),
        ]
        self._threads = [threading.Thread(target=target) for target in (self._kill_servers, self._follow_plan)]
        for thread in self._threads:
            thread.start()

    def end(self) -> None:
        """All is mended when this returns."""
        self._over.set()
        for thread in self._threads:
            thread.join()
        self._stack.wait_until_ready()

    def _kill_servers(self) -> None:
        while not self._over.wait(self._random.uniform(0.5, 1.5) * EVERY_S) and time.monotonic() < self._until:
            port = self._random.choice(self._stack.ports)
            with self._lock:
                self._stack.supervise()
                self._tell(f"kill -9 of the process on port {port}")
                self._stack.kill(port)
                time.sleep(self._random.uniform(0.0, 2.0))
                self._stack.serve(port)

    def _follow_plan(self) -> None:
        for at, do in self._plan:
            if not self._over.wait(max(self._began + at - time.monotonic(), 0.0)):
                do()

    def _freeze_a_worker(self) -> None:
        with self._lock:
            server = self._stack.servers[self._random.choice(self._stack.ports)].pid
            workers = [
                pid
                for pid in postgresql.children(server)
                if Path(f"/proc/{pid}/comm").read_text().strip() == "stillroom work"
            ]
            if not workers:
                return
            self._tell(f"a worker is frozen for {FROZEN_S:g} s")
            os.kill(workers[0], signal.SIGSTOP)
            time.sleep(FROZEN_S)
            os.kill(workers[0], signal.SIGCONT)

    def _restart_database(self) -> None:
        self._tell("PostgreSQL is restarted")
        self._database.restart()

    def _kill_database(self) -> None:
        self._tell("kill -9 of PostgreSQL")
        self._database.kill()
        time.sleep(3)
        self._database.recover()
        self._tell("PostgreSQL is back")

    def _lose_store(self, seconds: float) -> None:
        self._tell(f"kill -9 of the grid store, for {seconds:.0f} s")
        self._store.kill()
        time.sleep(seconds)
        self._store.start()
        self._tell("the grid store is back")

    def _tell(self, what: str) -> None:
        print(f"  {time.monotonic() - self._began:6.1f} s  {what}", flush=True)


def many_machines(folder: Path, homes: Sequence[Home], rate: float, seconds: float, seed: int) -> bool:
    print(f"\n{rate:g} missions/s for {seconds:g} s to two processes on PostgreSQL and S3 (seed {seed})")
    with Stack(folder / "service", "postgresql", 2, 1) as stack:
        robots = add_robots(stack, homes, max(int(20 * rate), 24), "chaos")
        chaos = Chaos(stack, seconds, seed)
        driver = Driver(stack.ports, robots, Load(rate, seconds, wait_s=10, twice=0.1, late=0.1, timeout_s=20.0), seed)
        figures = driver.run()
        chaos.end()
        print(f"  {len(figures.acknowledged)} missions acknowledged; answers {dict(sorted(figures.statuses.items()))}")
        for bad in figures.bad[:10]:
            print(f"  SHOULD NOT BE: {bad}")
        print(f"  nothing waits after another {settle(stack, 300.0):.1f} s")
        return check(stack, figures.acknowledged) and not figures.bad


def full_disk(folder: Path, homes: Sequence[Home], seed: int) -> bool:
    """Database (SQLite) and grids lie on a file system that becomes full, and is made larger after a while."""
    disk = folder / "disk"
    disk.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={SMALL_DISK_MB}m", "none", str(disk)], check=False
    ).returncode:
        print("\nno file system can be mounted here: the full disk was left out")
        return True
    try:
        print(f"\n8 missions/s onto a disk of {SMALL_DISK_MB} MB, which fills up; SQLite and files")
        with Stack(disk / "service", "sqlite", 1, 2) as stack:
            robots = add_robots(stack, homes, 64, "disk")
            driver = Driver(stack.ports, robots, Load(8, 60, wait_s=0, late=0.0), seed)
            thread = threading.Thread(target=driver.run, daemon=True)
            thread.start()
            while thread.is_alive() and not driver.figures.statuses["PUT 503"]:
                time.sleep(0.2)
            print(f"  full after {len(driver.figures.acknowledged)} missions: {_free_mb(disk):.1f} MB left")
            time.sleep(10)
            subprocess.run(["mount", "-o", "remount,size=512m", str(disk)], check=True)
            print("  the disk is larger")
            thread.join()
            figures = driver.figures
            print(
                f"  {len(figures.acknowledged)} missions acknowledged; answers {dict(sorted(figures.statuses.items()))}"
            )
            for bad in figures.bad[:10]:
                print(f"  SHOULD NOT BE: {bad}")
            print(f"  nothing waits after another {settle(stack, 300.0):.1f} s")
            return check(stack, figures.acknowledged) and not figures.bad and figures.statuses["PUT 503"] > 0
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


def _free_mb(disk: Path) -> float:
    found = os.statvfs(disk)
    return found.f_bavail * found.f_frsize / 2**20


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="of uploads to many machines (default: %(default)s)"
    )
    parser.add_argument("--rate", type=float, default=4.0, help="missions a second (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=int(time.time()) % 10_000, help="(default: another each time)")
    parser.add_argument("--only", choices=("machines", "disk"))
    options = parser.parse_args(arguments)
    homes = draw_homes(HOMES, SORTIES)
    holds = True
    with tempfile.TemporaryDirectory() as folder:
        if options.only != "disk":
            holds = many_machines(Path(folder), homes, options.rate, options.seconds, options.seed)
        if options.only != "machines":
            holds = full_disk(Path(folder), homes, options.seed) and holds
    print("\nall that was promised holds" if holds else "\nNOT ALL THAT WAS PROMISED HOLDS")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
