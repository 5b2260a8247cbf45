"""`stillroom bench`: how long the pipeline's stages take, how long an upload takes over HTTP, and how many a second fit.

A service of its own, on SQLite and local files in a temporary folder; simulated homes of ten rooms, about 330 x 250 cells, at 0.05 m a
cell. Compare figures of one run only: machines differ, and are shared.
"""

import os
import secrets
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx2
import numpy as np

from stillroom.simulator.building import draw_home
from stillroom.simulator.client import WAIT_S, Client, Json
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot, Sortie
from stillroom.simulator.homes import Home

ROOMS = 10
CELLS = 330 * 250
WIDEST = 0.25
"""A home is of the size wanted where its grid has so much more or fewer cells at most."""
START_S = 30
Told = Callable[[str], None]
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Bench:
    missions: int = 60
    """Of one robot, one after the other: latency and stages."""
    robots: int = 4
    """That upload at once: throughput."""
    rounds: int = 30
    """Missions of each of them."""


@dataclass(frozen=True)
class Upload:
    seconds: float
    mission: Json


def bench(of: Bench, told: Told) -> None:
    """Tells the figures, line by line."""
    homes = [_home(number) for number in range(of.robots)]
    with tempfile.TemporaryDirectory() as folder, _service(Path(folder)) as (http, token, process):
        operator = Client(http, token, _quiet)
        drivers = [_Driver(operator, number, home, of) for number, home in enumerate(homes)]
        first = drivers[0]
        frame = first.sorties[0].sensed.grid.frame
        told(f"A home of {ROOMS} rooms, {frame.width} x {frame.height} cells; {of.missions} missions of one robot")
        _tell_latency([first.upload() for _ in range(of.missions)][1:], told)
        for driver in drivers[1:]:
            driver.upload()
        _tell_throughput(drivers, of, process, told)


class _Driver:
    """One robot: its missions are drawn beforehand, its tracking when it knows the map in force."""

    def __init__(self, operator: Client, number: int, home: Home, of: Bench) -> None:
        name = f"bench-{number}"
        token = operator.add_robot(name, name)
        if token is None:
            raise RuntimeError(f"there is a robot {name} in an empty service")
        self.client = Client(operator.http, token, _quiet)
        self.path = f"/api/v1/robots/{name}/maps/ground"
        self.robot = SimulatedRobot(home, Streams(7, number), Effects.DEMO)
        count = of.rounds + (of.missions if number == 0 else 1)
        self.sorties: list[Sortie] = [self.robot.sortie(k) for k in range(count)]
        self.pictures = [sortie.png() for sortie in self.sorties]
        self.next = 0

    def upload(self) -> Upload:
        sortie, picture = self.sorties[self.next], self.pictures[self.next]
        meta = self.robot.meta(sortie, self.client.map_in_force(self.path))
        meta |= {"started_at": "2026-01-01T00:00:00Z", "ended_at": "2026-01-01T00:40:00Z"}
        began = time.perf_counter()
        mission = self.client.upload(self.path, str(self.next), picture, meta)
        self.next += 1
        return Upload(time.perf_counter() - began, mission)


def _tell_latency(uploads: Sequence[Upload], told: Told) -> None:
    stages: dict[str, list[float]] = defaultdict(list)
    for upload in uploads:
        for stage, spent in upload.mission["timings_ms"].items():
            stages[stage].append(spent)
    updated, resolved = (
        sum(upload.mission["outcome"] == outcome for upload in uploads) for outcome in ("updated", "resolved")
    )
    told(f"{updated + resolved} of {len(uploads)} missions updated the map, {resolved} of them after resolution\n")
    told(f"{'stage':<24}{'p50 ms':>8}{'p99 ms':>8}")
    for stage, spent in stages.items():
        told(f"{stage:<24}{_line(spent)}")
    told(f"{'upload over HTTP':<24}{_line([1000 * upload.seconds for upload in uploads])}\n")


def _line(values: Sequence[float]) -> str:
    return f"{np.percentile(values, 50):8.1f}{np.percentile(values, 99):8.1f}"


def _tell_throughput(drivers: Sequence[_Driver], of: Bench, process: int, told: Told) -> None:
    before, own, began = _cpu_seconds(process), time.process_time(), time.perf_counter()
    with ThreadPoolExecutor(len(drivers)) as pool:
        list(pool.map(lambda driver: [driver.upload() for _ in range(of.rounds)], drivers))
    wall, own, used = time.perf_counter() - began, time.process_time() - own, _cpu_seconds(process) - before
    count = of.rounds * len(drivers)
    cores = os.cpu_count() or 1
    told(
        f"{len(drivers)} robots at once: {count / wall:.1f} uploads/s on {cores} cores, this process's own load included"
    )
    told(f"CPU of the service {1000 * used / count:.1f} ms an upload, of the robots {1000 * own / count:.1f} ms")
    told(f"the service's CPU alone would allow {cores * count / used:.1f} uploads/s")


def _home(number: int) -> Home:
    """A home of about the size wanted, the same for the same number."""
    for attempt in range(200):
        home = draw_home(Streams(11 + attempt, number).of("home"), ROOMS)
        frame = SimulatedRobot(home, Streams(7, number), Effects.NONE).sortie(0).sensed.grid.frame
        if abs(frame.width * frame.height / CELLS - 1) <= WIDEST:
            return home
    raise RuntimeError("no home of the size wanted was drawn")


@contextmanager
def _service(folder: Path) -> Iterator[tuple[httpx2.Client, str, int]]:
    """A client of a service, its operator token and its process."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    token = secrets.token_urlsafe(16)
    environment = os.environ | {"STILLROOM_DATA_DIR": str(folder), "STILLROOM_ADMIN_TOKEN": token}
    for name in ("STILLROOM_DATABASE_URL", "STILLROOM_GRID_STORE_URL"):
        environment.pop(name, None)
    command = [sys.executable, "-m", "stillroom", "serve", "--port", str(port)]
    child = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        url = f"http://127.0.0.1:{port}"
        _wait_until_ready(url)
        with httpx2.Client(base_url=url, timeout=WAIT_S + 30) as http:
            yield http, token, child.pid
    finally:
        child.terminate()
        child.wait(START_S)


def _wait_until_ready(url: str) -> None:
    end = time.monotonic() + START_S
    while time.monotonic() < end:
        try:
            if httpx2.get(f"{url}/readyz").is_success:
                return
        except httpx2.TransportError:
            threading.Event().wait(0.1)
    raise RuntimeError("the service did not start")


def _cpu_seconds(process: int) -> float:
    """User and system time of a process and its children so far (Linux: /proc)."""
    total = 0.0
    for found in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = found.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(found.parent.name) == process or int(fields[1]) == process:
            total += (int(fields[11]) + int(fields[12])) / TICKS
    return total


def _quiet(_text: str) -> None:
    pass
