"""Robots that upload at a given rate, however long the answers take; each tries again until its mission was acknowledged."""

import http.client
import json
import random
import threading
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from queue import Empty, Queue
from typing import Any

from tests.load.robots import LoadRobot

GIVE_UP_S = 300.0
_BOUNDARY = "part-of-a-mission"
_ERRORS = (OSError, http.client.HTTPException)


@dataclass(frozen=True)
class Load:
    rate: float
    """Missions a second; those of all robots."""
    seconds: float
    wait_s: int = 30
    """As robots prefer; 0: they don't wait."""
    twice: float = 0.02
    """Missions that are sent twice at once."""
    late: float = 0.02
    """Missions that are sent after the next one."""
    timeout_s: float = 60.0


@dataclass
class Figures:
    """What came of it; `seconds` of each mission that was done when its last answer came, retries and waits included."""

    began: float = field(default_factory=time.monotonic)
    seconds: list[float] = field(default_factory=list)
    acknowledged: list[str] = field(default_factory=list)
    ack_seconds: list[float] = field(default_factory=list)
    """From the first attempt until it was acknowledged, done or not."""
    refused_seconds: list[float] = field(default_factory=list)
    statuses: Counter[str] = field(default_factory=Counter)
    outcomes: Counter[str] = field(default_factory=Counter)
    bad: list[str] = field(default_factory=list)
    """Answers that should not be."""
    ended: float = 0.0
    behind: int = 0
    """Missions that no robot was free for."""
    lock: threading.Lock = field(default_factory=threading.Lock)


class Driver:
    def __init__(self, ports: Sequence[int], robots: Sequence[LoadRobot], load: Load, seed: int = 1) -> None:
        self.figures = Figures()
        self._ports, self._load = ports, load
        self._idle: Queue[LoadRobot] = Queue()
        for robot in robots:
            self._idle.put(robot)
        self._random = random.Random(seed)
        self._pool = ThreadPoolExecutor(len(robots) + 8)
        self._local = threading.local()
        self._connections: list[http.client.HTTPConnection] = []

    def run(self) -> Figures:
        """Until the time is over and every mission was acknowledged."""
        figures, load = self.figures, self._load
        figures.began = time.monotonic()
        jobs = []
        for number in range(int(load.rate * load.seconds)):
            time.sleep(max(figures.began + number / load.rate - time.monotonic(), 0.0))
            try:
                robot = self._idle.get_nowait()
            except Empty:
                figures.behind += 1
                continue
            jobs.append(self._pool.submit(self._mission, robot, self._random.random(), self._random.random()))
        for job in jobs:
            job.result()
        figures.ended = time.monotonic()
        self._pool.shutdown()
        for connection in self._connections:
            connection.close()
        return figures

    def _mission(self, robot: LoadRobot, twice: float, late: float) -> None:
        try:
            number = robot.next
            robot.next += 1
            if number > 1 and late < self._load.late:
                robot.held_back.append(number)
                number = robot.next
                robot.next += 1
            numbers = [number, *robot.held_back]
            robot.held_back.clear()
            for one in numbers:
                self._send(robot, one, twice < self._load.twice)
        finally:
            self._idle.put(robot)

    def _send(self, robot: LoadRobot, number: int, twice: bool) -> None:
        base = None if number == 0 else self._until(robot, "GET", robot.path, None, {200, 404})[1]
        meta = robot.meta(number, base if base is not None and "features" in base else None)
        body = multipart(meta, robot.grid(number))
        path = f"{robot.path}/missions/{number}"
        again = self._pool.submit(self._once, robot, "PUT", path, body) if twice else None
        began = time.perf_counter()
        status, mission = self._until(robot, "PUT", path, body, {200, 201, 202})
        took = time.perf_counter() - began
        if again is not None:
            again.result()
        with self.figures.lock:
            self.figures.acknowledged.append(path)
            self.figures.ack_seconds.append(took)
            if status != 202:
                self.figures.seconds.append(took)
                self.figures.outcomes[mission["outcome"]] += 1

    def _until(
        self, robot: LoadRobot, method: str, path: str, body: bytes | None, wanted: set[int]
    ) -> tuple[int, dict[str, Any]]:
        """The first answer of those wanted; tries again whatever happens, as a robot does."""
        end, pause = time.monotonic() + GIVE_UP_S, 0.2
        while True:
            status, headers, content = self._once(robot, method, path, body)
            if status in wanted:
                return status, content
            if time.monotonic() > end:
                raise RuntimeError(f"{method} {path} was never answered; last: {status} {content}")
            after = float(headers.get("Retry-After", 0)) if status in (429, 503) else 0.0
            time.sleep((after or pause) * random.uniform(0.8, 1.2))
            pause = min(2 * pause, 5.0)

    def _once(
        self, robot: LoadRobot, method: str, path: str, body: bytes | None
    ) -> tuple[int, Mapping[str, str], dict[str, Any]]:
        """Status, headers and document; 0 where there was no answer."""
        headers = {"Authorization": f"Bearer {robot.token}"}
        if body is not None:
            headers["Content-Type"] = f"multipart/form-data; boundary={_BOUNDARY}"
            if self._load.wait_s:
                headers["Prefer"] = f"wait={self._load.wait_s}"
        began = time.perf_counter()
        try:
            connection = self._connection()
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            content = answer.read()
        except _ERRORS as error:
            self._connection().close()
            self._local.connection = None
            self._note(f"{method} {type(error).__name__}")
            return 0, {}, {}
        self._note(f"{method} {answer.status}")
        if answer.status == 503:
            with self.figures.lock:
                self.figures.refused_seconds.append(time.perf_counter() - began)
        if answer.status >= 400 and (method, answer.status) != ("GET", 404):
            retry = answer.headers.get("Retry-After")
            if answer.status not in (429, 503) or retry is None:
                with self.figures.lock:
                    self.figures.bad.append(f"{method} {path}: {answer.status} {content[:300]!r}")
        is_json = answer.headers.get_content_subtype() in ("json", "geo+json", "problem+json")
        named = {name.title(): value for name, value in answer.headers.items()}
        return answer.status, named, json.loads(content) if is_json else {}

    def _connection(self) -> http.client.HTTPConnection:
        """This thread's own; a new one goes to any of the processes."""
        found: http.client.HTTPConnection | None = getattr(self._local, "connection", None)
        if found is None:
            found = http.client.HTTPConnection("127.0.0.1", random.choice(self._ports), timeout=self._load.timeout_s)
            self._local.connection = found
            self._connections.append(found)
        return found

    def _note(self, what: str) -> None:
        with self.figures.lock:
            self.figures.statuses[what] += 1


def multipart(meta: Mapping[str, Any], grid: bytes) -> bytes:
    head = f'--{_BOUNDARY}\r\nContent-Disposition: form-data; name="meta"\r\nContent-Type: application/json\r\n\r\n'
    middle = f'\r\n--{_BOUNDARY}\r\nContent-Disposition: form-data; name="grid"\r\nContent-Type: image/png\r\n\r\n'
    return head.encode() + json.dumps(meta).encode() + middle.encode() + grid + f"\r\n--{_BOUNDARY}--\r\n".encode()
