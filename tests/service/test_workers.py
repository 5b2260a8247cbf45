"""The service as it runs, in processes that are killed: what was acknowledged is processed, once."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
import sqlalchemy as sa

from stillroom.documents.api import NewRobot
from stillroom.service.processing import process_next
from stillroom.service.robots import add_robot
from stillroom.settings import Settings
from stillroom.store import lanes
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.tables import conflict, delivery, receiver
from tests.conftest import ADMIN_TOKEN, Service
from tests.homes import ORIGIN, RESOLUTION, Image, home, png
from tests.ports import free_port
from tests.postgresql import children
from tests.telling import answering, receiving

PATIENCE_S = 120.0
PATH = "/api/v1/robots/RB-1/maps/ground"
META = {"resolution": RESOLUTION, "origin": ORIGIN}


@dataclass
class Running:
    process: subprocess.Popen[str]
    http: httpx2.Client

    def upload(
        self, mission: int, prefer: str = "", image: Image | None = None, path: str = PATH, **said: Any
    ) -> httpx2.Response:
        meta = json.dumps({"sequence": mission} | META | said)
        content = png(home() if image is None else image)
        return self.http.put(
            f"{path}/missions/{mission}",
            headers={"Prefer": prefer} if prefer else {},
            files={"meta": ("m", meta, "application/json"), "grid": ("g", content, "image/png")},
        )

    def workers(self) -> list[int]:
        return self._children("stillroom work")

    def messenger(self) -> list[int]:
        return self._children("stillroom tell")

    def _children(self, name: str) -> list[int]:
        return [pid for pid in children(self.process.pid) if _name(pid) == name]

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


def _name(pid: int) -> str:
    with suppress(OSError):  # it has ended
        return Path(f"/proc/{pid}/comm").read_text().strip()
    return ""


def eventually(holds: Callable[[], bool], what: str) -> None:
    until = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < until, f"{what}: not within {PATIENCE_S} s"
        time.sleep(0.05)


@contextmanager
def serving(settings: Settings, workers: int, token: str, **more: str) -> Iterator[Running]:
    port = free_port()
    environment = os.environ | {
        "STILLROOM_DATA_DIR": str(settings.data_dir),
        "STILLROOM_DATABASE_URL": settings.database_url,
        "STILLROOM_GRID_STORE_URL": settings.grid_store_url,
        "STILLROOM_ADMIN_TOKEN": ADMIN_TOKEN,
        **more,
    }
    command = [sys.executable, "-m", "stillroom", "serve", "--port", str(port), "--workers", str(workers)]
    with (
        subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process,
        httpx2.Client(
            base_url=f"http://127.0.0.1:{port}", headers={"Authorization": f"Bearer {token}"}, timeout=PATIENCE_S
        ) as http,
    ):
        running = Running(process, http)
        try:
            eventually(lambda: _answers(http), "the service answers")
            yield running
        finally:
            process.terminate()
            process.wait(PATIENCE_S)
            assert process.stdout is not None
            process.stdout.close()


def _answers(http: httpx2.Client) -> bool:
    try:
        return http.get("/readyz").status_code == 200
    except httpx2.TransportError:
        return False


@pytest.fixture
def token(settings: Settings) -> str:
    database = Database(settings.database_url)
    made = add_robot(database, NewRobot(id="RB-1"))
    database.dispose()
    return made.token


def expire_leases(settings: Settings) -> None:
    """As if the time of a lease had passed since the kill."""
    database = Database(settings.database_url)
    with database.write() as tx:
        lanes.expire(tx, 1)
    database.dispose()


def versions(running: Running, path: str = PATH) -> list[int]:
    return [item["version"] for item in running.http.get(f"{path}/versions").json()["items"]]


def test_every_mission_is_processed_once_whoever_is_killed_and_however_many_send_it(
    settings: Settings, token: str
) -> None:
    upstairs = PATH.replace("ground", "upstairs")
    with serving(settings, workers=0, token=token) as running:
        assert running.upload(0).status_code == 202
        database = Database(settings.database_url)
        held = lanes.claim(database)  # a worker claims it, and is never heard of again
        database.dispose()
        assert held is not None
        assert running.http.get(f"{PATH}/missions/0").json()["status"] == "processing"
        assert running.upload(0, path=upstairs).status_code == 202
        running.kill()
    expire_leases(settings)
    with serving(settings, workers=2, token=token) as running:
        for path in (PATH, upstairs):
            answer = running.upload(0, "wait=60", path=path)
            assert (answer.status_code, answer.json()["outcome"]) == (200, "created")
            assert versions(running, path) == [1]

        eventually(lambda: len(running.workers()) == 2, "both workers run")
        first = running.workers()
        for pid in first:
            os.kill(pid, signal.SIGKILL)
        expire_leases(settings)
        assert running.upload(1, "wait=60").json()["status"] == "done"
        assert versions(running) == [2, 1]
        eventually(lambda: len(set(running.workers()) - set(first)) == 2, "both are started again")
        with ThreadPoolExecutor(5) as pool:
            answers = list(pool.map(lambda _: running.upload(2, "wait=60"), range(5)))
        assert sorted(answer.status_code for answer in answers) == [200, 200, 200, 200, 201]
        assert {answer.json()["version"] for answer in answers} == {3}
        assert len(running.http.get(f"{PATH}/missions").json()["items"]) == 3
        assert versions(running) == [3, 2, 1]


@pytest.mark.parametrize("engine", ["sqlite"])
def test_a_service_that_is_told_to_end_answers_who_waits_and_leaves_the_mission_to_the_next(
    settings: Settings, token: str
) -> None:
    with (
        serving(settings, workers=0, token=token) as running,
        running.http.stream("GET", "/api/v1/events") as stream,  # it does not keep the service from ending
        ThreadPoolExecutor(1) as pool,
    ):
        assert next(stream.iter_lines()).startswith("id: ")
        waiting = pool.submit(running.upload, 0, "wait=60")

        def is_queued() -> bool:
            with httpx2.Client(
                base_url=running.http.base_url, headers=running.http.headers, timeout=PATIENCE_S
            ) as another:
                return another.get(f"{PATH}/missions/0").status_code == 200

        eventually(is_queued, "the mission is there")
        running.process.terminate()
        assert (waiting.result(PATIENCE_S).status_code, waiting.result().json()["status"]) == (202, "queued")
        assert running.process.wait(PATIENCE_S) == 0
    database = Database(settings.database_url)
    assert process_next(database, GridStore(settings.grid_store_url)) is not None
    database.dispose()


def follow(running: Running, last: int) -> Iterator[tuple[str, dict[str, object]]]:
    """Kind and content of each event after `last`; the stream must not have to be kept alive before the next one comes."""
    with running.http.stream("GET", "/api/v1/events", headers={"Last-Event-ID": str(last)}) as stream:
        kind = ""
        for line in stream.iter_lines():
            assert line != ": still here", "nobody told the stream; it looked by itself"
            if line.startswith("event: "):
                kind = line.removeprefix("event: ")
            if line.startswith("data: "):
                yield kind, json.loads(line.removeprefix("data: "))


@pytest.mark.parametrize("engine", ["postgresql"])
def test_processes_that_share_a_postgresql_hear_of_each_other(settings: Settings, token: str) -> None:
    with (
        serving(settings, workers=0, token=token) as first,
        serving(settings, workers=1, token=token) as second,
        ThreadPoolExecutor(1) as pool,
    ):
        events = follow(second, last=0)
        heard = pool.submit(lambda: [next(events), next(events)])
        uploaded = first.upload(0, "wait=60")
        assert (uploaded.status_code, uploaded.json()["outcome"]) == (201, "created")
        assert [(kind, event["version"]) for kind, event in heard.result()] == [("version", 1), ("mission", 1)]
        events.close()  # type: ignore[attr-defined]
        assert first.upload(1).status_code == 202
        assert second.upload(1, "wait=60").json()["outcome"] == "updated"
        assert versions(first) == versions(second) == [2, 1]


@pytest.mark.parametrize("engine", ["sqlite"])
def test_workers_use_the_resolvers_that_they_are_told_and_keep_deadlines_while_nobody_looks(
    service: Service, settings: Settings
) -> None:
    robot = service.add_robot()
    service.worker.paused = True
    left: dict[str, Any] = {"base_version": 1, "tracking": {"transform": [0.0, 0.0, 0.0]}}
    robot.upload("0", wait=None)
    process_next(service.database, service.grids, ())
    robot.upload("1", home(wall_between=False), wait=None, **left)
    process_next(service.database, service.grids, ())
    (asked,) = robot.get(f"{PATH}/missions/1").json()["conflicts"]
    with service.database.write() as tx:
        tx.execute(sa.update(conflict).values(due_at=datetime.now(UTC) - timedelta(seconds=1)))
    outcomes = []
    for number, resolvers in ((2, "meta_occupancy"), (3, "meta_occupancy,meta_dividers")):
        with serving(settings, workers=1, token=robot.token, STILLROOM_RESOLVERS=resolvers) as running:

            def state() -> str:
                found: str = running.http.get(f"{PATH}/conflicts/{asked}").json()["state"]
                return found

            eventually(lambda: state() == "expired", "the default takes effect")
            mission = running.upload(number, "wait=60", home(wall_between=False), **left).json()
            assert set(mission["ablation"]) == {"transfer", "meta_occupancy", "meta_dividers"}
            outcomes.append((mission["outcome"], mission["version"], mission["ablation"]["meta_dividers"]))
    assert outcomes == [("needs_review", 1, False), ("resolved", 2, True)]


@pytest.mark.parametrize("engine", ["sqlite"])
def test_messages_are_delivered_while_the_service_runs_and_after_it_was_killed(settings: Settings, token: str) -> None:
    allowed = {"STILLROOM_WEBHOOK_NETWORKS": "127.0.0.1/32", "STILLROOM_WEBHOOK_HTTP": "true"}
    operator = {"Authorization": f"Bearer {ADMIN_TOKEN}"}
    with receiving() as there:
        there.behaviour = answering(503)

        def sent() -> list[str]:
            return [request.headers["webhook-id"] for request in there.requests]

        with serving(settings, workers=1, token=token, **allowed) as running:
            wanted = {"url": there.url, "types": ["map.updated"]}
            made = running.http.post("/api/v1/webhooks", headers=operator, json=wanted)
            assert made.status_code == 201
            running.upload(0, "wait=60")
            eventually(lambda: len(sent()) == 1, "the version is told")
            (messenger,) = running.messenger()
            there.behaviour = answering(204)
            os.kill(messenger, signal.SIGKILL)
            hurry(settings)
            eventually(lambda: len(sent()) == 2, "another messenger tells it again")
            there.behaviour = answering(503)
            running.upload(1, "wait=60")
            eventually(lambda: len(running.workers() + running.messenger()) == 2, "both processes run")
            started = running.workers() + running.messenger()
            running.kill()
            eventually(lambda: not any(Path(f"/proc/{pid}").exists() for pid in started), "they end with the service")
        there.behaviour = answering(204)
        with serving(settings, workers=1, token=token, **allowed) as running:
            url = f"/api/v1/webhooks/{made.json()['id']}/deliveries"

            def states() -> list[str]:
                return [item["state"] for item in running.http.get(url, headers=operator).json()["items"]]

            hurry(settings)
            eventually(lambda: states() == ["delivered", "delivered"], "nothing was lost")
        assert len(set(sent())) == 2


def hurry(settings: Settings) -> None:
    """As if the waits before the next attempts, and the leases of who was killed, were over."""
    database = Database(settings.database_url)
    past = datetime.now(UTC) - timedelta(seconds=1)
    with database.write() as tx:
        tx.execute(sa.update(delivery).where(delivery.c.state == "waiting").values(due_at=past))
        tx.execute(sa.update(receiver).values(resume_at=None))
    database.dispose()


@pytest.mark.parametrize("engine", ["sqlite"])
def test_serve_prints_a_link_that_signs_in(settings: Settings, token: str) -> None:
    with serving(settings, workers=0, token=token) as running:
        assert running.process.stdout is not None
        lines = [running.process.stdout.readline() for _ in range(2)]
        link = re.search(r"http://\S+/login\?token=\S+", "".join(lines))
        assert link is not None
        with httpx2.Client(timeout=PATIENCE_S) as browser:
            assert browser.get(link[0]).status_code == 303
            told = browser.get(str(running.http.base_url.join("/api/v1/session"))).json()
        assert (told["kind"], told["id"]) == ("operator", None)
