"""A service in this process: the real application and database, with a worker in a thread instead of processes."""

import json
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import hypothesis
import pytest
import sqlalchemy as sa
from httpx2 import Response
from starlette.testclient import TestClient

from stillroom import logs
from stillroom.app import create_app
from stillroom.service import gathering
from stillroom.service.processing import process_next
from stillroom.service.signals import Signals
from stillroom.settings import Settings
from stillroom.store import lanes
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.migrate import migrate
from stillroom.store.tables import metadata
from tests import object_store, postgresql
from tests.conflicts import Core
from tests.homes import ORIGIN, RESOLUTION, Image, home, png

# How fast the machine is, is not under test. The same questions are asked every time; `make fuzz` asks new ones.
hypothesis.settings.register_profile(
    "stillroom",
    deadline=None,
    derandomize="STILLROOM_FUZZ_S" not in os.environ,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.load_profile("stillroom")

ADMIN_TOKEN = "operator-of-the-tests"
ENGINES = ("sqlite", "postgresql")
ON_BOTH_ENGINES = ("store", "service", "api", "test_migrations.py")
"""Tests of these files and folders run twice, with SQLite and files and with PostgreSQL and an S3 store; all others with SQLite and files."""
Json = dict[str, Any]


@dataclass
class InlineWorker:
    """Processes what is queued in a thread of its own, one mission after the other; `paused` it leaves all in the queue."""

    database: Database
    grids: GridStore
    _paused: bool = False
    _pool: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))
    _last: Future[None] | None = None

    @property
    def paused(self) -> bool:
        return self._paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        """When this returns, nothing is being processed any more."""
        self._paused = paused
        if paused:
            self.settle()

    def wake(self) -> None:
        if not self.paused:
            self._last = self._pool.submit(self._drain)

    def resume(self) -> None:
        """Processes all that waits and returns when it is done."""
        self.paused = False
        self.wake()
        self.settle()

    def settle(self) -> None:
        if self._last is not None:
            self._last.result()

    def _drain(self) -> None:
        while process_next(self.database, self.grids) is not None or self._is_any_ready():
            pass

    def _is_any_ready(self) -> bool:
        """A lane that an upload holds just now is passed over, as by a real worker, which looks again a little later."""
        with self.database.read() as tx:
            ready_in = lanes.seconds_to_next(tx)
        return ready_in is not None and ready_in <= 0

    def stop(self) -> None:
        self._pool.shutdown()
        self.settle()


@dataclass
class Caller:
    """Somebody who calls the API, with a credential or without."""

    http: TestClient
    headers: dict[str, str]

    def request(self, method: str, path: str, headers: dict[str, str] | None = None, **rest: Any) -> Response:
        return self.http.request(method, path, headers=self.headers | (headers or {}), **rest)

    def get(self, path: str, headers: dict[str, str] | None = None) -> Response:
        return self.request("GET", path, headers)

    def edit(self, path: str, version: int, *operations: Json, dry_run: bool = False) -> Response:
        query = "?dry_run=true" if dry_run else ""
        return self.request(
            "POST", f"{path}/edits{query}", {"If-Match": f'"v{version}"'}, json={"operations": list(operations)}
        )


@dataclass
class RobotCaller(Caller):
    id: str = ""
    token: str = ""

    def path(self, map_name: str = "ground") -> str:
        return f"/api/v1/robots/{self.id}/maps/{map_name}"

    def upload(
        self,
        mission: str,
        image: Image | bytes | None = None,
        *,
        map_name: str = "ground",
        wait: int | None = 30,
        grid_type: str = "image/png",
        **meta: Any,
    ) -> Response:
        content = image if isinstance(image, bytes) else png(home() if image is None else image)
        sequence = int(mission) if mission.isdecimal() else 0
        document = {"sequence": sequence, "resolution": RESOLUTION, "origin": ORIGIN} | meta
        return self.request(
            "PUT",
            f"{self.path(map_name)}/missions/{mission}",
            {} if wait is None else {"Prefer": f"wait={wait}"},
            files={
                "meta": ("meta.json", json.dumps(document), "application/json"),
                "grid": ("grid", content, grid_type),
            },
        )


@dataclass
class Service:
    settings: Settings
    http: TestClient
    database: Database
    grids: GridStore
    worker: InlineWorker

    @property
    def operator(self) -> Caller:
        return Caller(self.http, {"Authorization": f"Bearer {ADMIN_TOKEN}"})

    @property
    def stranger(self) -> Caller:
        return Caller(self.http, {})

    def add_robot(self, robot_id: str = "RB-1", owner: str | None = None) -> RobotCaller:
        made = self.operator.request("POST", "/api/v1/robots", json={"id": robot_id, "name": robot_id, "owner": owner})
        assert made.status_code == 201, made.text
        token = made.json()["token"]
        return RobotCaller(self.http, {"Authorization": f"Bearer {token}"}, robot_id, token)


@pytest.fixture(scope="session", autouse=True)
def plain_logs() -> None:
    logs.configure()


_folder = pytest.StashKey[Path]()
"""Of the servers of this run."""


def pytest_configure(config: pytest.Config) -> None:
    told: dict[str, str] = getattr(config, "workerinput", {})
    config.stash[_folder] = Path(told.get("folder") or f"{tempfile.gettempdir()}/stillroom-{secrets.token_hex(4)}")


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """xdist: one PostgreSQL and one object store for all processes of a run."""
    node.workerinput["folder"] = str(node.config.stash[_folder])


def pytest_unconfigure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput"):
        _postgresql_server(config).stop()
        _object_store(config).stop()


def _postgresql_server(config: pytest.Config) -> postgresql.Server:
    return postgresql.Server(config.stash[_folder].with_suffix(".postgresql"))


def _object_store(config: pytest.Config) -> object_store.ObjectStore:
    return object_store.ObjectStore(config.stash[_folder].with_suffix(".s3"))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    chosen = any(mark.args[0] == "engine" for mark in metafunc.definition.iter_markers("parametrize"))
    if "engine" in metafunc.fixturenames and not chosen:
        top = metafunc.definition.path.relative_to(Path(__file__).parent).parts[0]
        metafunc.parametrize("engine", ENGINES if top in ON_BOTH_ENGINES else ENGINES[:1])


@pytest.fixture(scope="session")
def postgresql_server(request: pytest.FixtureRequest) -> postgresql.Server:
    """With a migrated database to be copied."""
    server = _postgresql_server(request.config)
    with server.started() as first:
        if first:
            server.execute(f"CREATE DATABASE {postgresql.TEMPLATE}")
            database = Database(server.url(postgresql.TEMPLATE))
            migrate(database)
            database.dispose()
    return server


@pytest.fixture(scope="session")
def postgresql_url(postgresql_server: postgresql.Server, worker_id: str) -> str:
    """Of a database that this process of the tests has for itself."""
    with postgresql_server.started():
        postgresql_server.execute(f"CREATE DATABASE of_{worker_id} TEMPLATE {postgresql.TEMPLATE}")
    return postgresql_server.url(f"of_{worker_id}")


@pytest.fixture(scope="session")
def s3_store(request: pytest.FixtureRequest) -> Iterator[object_store.ObjectStore]:
    """An S3-compatible store, and its credentials in the environment."""
    store = _object_store(request.config)
    store.ensure()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in object_store.ENVIRONMENT.items():
            patch.setenv(name, value)
        yield store


@pytest.fixture(scope="session")
def migrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty database at the newest schema, to be copied."""
    file = tmp_path_factory.mktemp("database") / "stillroom.sqlite"
    database = Database(f"sqlite:///{file}")
    migrate(database)
    database.dispose()
    return file


@pytest.fixture
def database_url(engine: str, tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """An empty database at the newest schema."""
    if engine == "postgresql":
        url: str = request.getfixturevalue("postgresql_url")
        empty(url)
        return url
    file = tmp_path / "stillroom.sqlite"
    shutil.copy(request.getfixturevalue("migrated"), file)
    return f"sqlite:///{file}"


def empty(url: str) -> None:
    """As after the migrations; much sooner than TRUNCATE, which makes every table's files anew."""
    database = Database(url)
    rows = [
        sa.select(sa.literal(name)).where(sa.exists().select_from(table)) for name, table in metadata.tables.items()
    ]
    with database.write() as tx:
        used = set(tx.execute(sa.union_all(*rows)).scalars())
        for table in reversed(metadata.sorted_tables):
            if table.name in used:
                tx.execute(sa.delete(table))
        again = "setval(format('%I.%I', schemaname, sequencename)::regclass, start_value, false)"
        tx.execute(sa.text(f"SELECT {again} FROM pg_sequences WHERE last_value IS NOT NULL"))
    database.dispose()


@pytest.fixture
def grid_store_url(engine: str, tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """An empty store."""
    if engine == "postgresql":
        store: object_store.ObjectStore = request.getfixturevalue("s3_store")
        return store.url(secrets.token_hex(8))
    return str(tmp_path / "grids")


@pytest.fixture
def settings(tmp_path: Path, database_url: str, grid_store_url: str) -> Settings:
    return Settings(
        data_dir=tmp_path,
        database_url=database_url,
        grid_store_url=grid_store_url,
        admin_token=ADMIN_TOKEN,
    )


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    opened = Database(settings.database_url)
    yield opened
    opened.dispose()


@pytest.fixture
def service(settings: Settings) -> Iterator[Service]:
    grids, signals = GridStore(settings.grid_store_url), Signals()
    database = Database(settings.database_url, signals.hear)
    worker = InlineWorker(database, grids)
    signals.wake_workers = worker.wake
    app = create_app(settings, signals, static=settings.data_dir / "static")
    with TestClient(app, base_url="http://stillroom.test", raise_server_exceptions=False) as http:
        yield Service(settings, http, database, grids, worker)
    worker.stop()
    database.dispose()
    app.state.parts.database.dispose()


@pytest.fixture
def robot(service: Service) -> RobotCaller:
    return service.add_robot()


@pytest.fixture
def mapped(robot: RobotCaller) -> RobotCaller:
    """A robot whose first mission made a map."""
    first = robot.upload("0")
    assert first.status_code == 201, first.text
    assert first.json()["outcome"] == "created"
    return robot


@pytest.fixture
def core(monkeypatch: pytest.MonkeyPatch) -> Core:
    """The core's answers can be planned."""
    stand_in = Core()
    monkeypatch.setattr(gathering, "update_map", stand_in)
    return stand_in


def features(document: Json, semantic: str) -> list[Json]:
    return [f for f in document["features"] if f["properties"]["semantic"] == semantic]
