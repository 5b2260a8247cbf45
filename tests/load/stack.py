"""The service as on many machines: a database, a grid store, and several processes that serve, all on this one."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType

import httpx2

from tests import object_store, postgresql
from tests.ports import free_ports

TOKEN = "operator-of-the-load"
START_S = 60.0
DURABLE = tuple(setting for setting in postgresql.SETTINGS if setting != "fsync=off")
TICKS = os.sysconf("SC_CLK_TCK")


class Stack:
    """`count` serving processes with `workers` workers each; on SQLite there is one."""

    def __init__(
        self, folder: Path, engine: str, count: int, workers: int, more: Mapping[str, str] | None = None
    ) -> None:
        self.folder, self.engine, self.workers = folder, engine, workers
        self.database: postgresql.Server | None = None
        self.store: object_store.ObjectStore | None = None
        self.environment = {"STILLROOM_DATA_DIR": str(folder), "STILLROOM_ADMIN_TOKEN": TOKEN}
        if engine == "postgresql":
            self.database = postgresql.Server(folder.with_suffix(".postgresql"), DURABLE)
            self.store = object_store.ObjectStore(folder.with_suffix(".s3"))
        self.more = dict(more or {})
        self.ports = free_ports(count)
        self.servers: dict[int, subprocess.Popen[bytes]] = {}
        self.cpu_of_the_dead = 0.0

    def __enter__(self) -> "Stack":
        self.folder.mkdir(parents=True, exist_ok=True)
        self.folder.parent.chmod(0o755)  # PostgreSQL runs as somebody else
        if self.database is not None and self.store is not None:
            with self.database.started():
                self.database.execute("CREATE DATABASE stillroom")
            self.store.ensure()
            self.environment |= object_store.ENVIRONMENT
            self.environment |= {
                "STILLROOM_DATABASE_URL": self.database.url("stillroom"),
                "STILLROOM_GRID_STORE_URL": self.store.url("grids"),
            }
        self.environment |= self.more
        self.run("migrate")
        for port in self.ports:
            self.serve(port)
        self.wait_until_ready()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self.servers.values():
            process.terminate()
        for process in self.servers.values():
            process.wait(START_S)
        if self.database is not None and self.store is not None:
            self.database.stop()
            self.store.stop()

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """A command of stillroom's, with this service's settings."""
        command = [sys.executable, "-m", "stillroom", *arguments]
        return subprocess.run(command, env=os.environ | self.environment, capture_output=True, text=True, check=False)

    def serve(self, port: int) -> None:
        command = [sys.executable, "-m", "stillroom", "serve", "--port", str(port), "--workers", str(self.workers)]
        with (self.folder / f"server-{port}.log").open("a") as log:
            self.servers[port] = subprocess.Popen(
                command, env=os.environ | self.environment, stdout=log, stderr=log, start_new_session=True
            )

    def supervise(self) -> None:
        """Starts those again that ended by themselves, as containers and systemd do: none starts without a database."""
        for port, process in list(self.servers.items()):
            if process.poll() is not None:
                self.serve(port)

    def kill(self, port: int) -> None:
        """One serving process, and what it started ends by itself."""
        self.servers[port].kill()
        self.servers[port].wait()

    def wait_until_ready(self) -> None:
        until = time.monotonic() + START_S
        for port in self.ports:
            while not self.is_ready(port):
                self.supervise()
                if time.monotonic() > until:
                    raise RuntimeError(f"the service on port {port} is not ready")
                time.sleep(0.1)

    def is_ready(self, port: int) -> bool:
        with suppress(httpx2.TransportError):
            return httpx2.get(f"http://127.0.0.1:{port}/readyz", timeout=5).status_code == 200
        return False

    def cpu_seconds(self) -> dict[str, float]:
        """User and system time so far of what runs now, by what it is for."""
        found = {"http": 0.0, "workers": 0.0}
        for process in self.servers.values():
            found["http"] += _cpu(process.pid)
            found["workers"] += sum(map(_cpu, postgresql.children(process.pid)))
        if self.database is not None and self.store is not None:
            found["database"] = _cpu(self.database.pid) + sum(map(_cpu, postgresql.children(self.database.pid)))
            found["store"] = _cpu(self.store.pid)
        return found

    def memory_mb(self) -> dict[str, float]:
        """Resident memory of each serving process and each worker."""
        found = {}
        for port, process in self.servers.items():
            found[f"server {port}"] = _resident_mb(process.pid)
            for child in postgresql.children(process.pid):
                found[f"child {child}"] = _resident_mb(child)
        return found


def _cpu(pid: int) -> float:
    """With that of children that ended and were waited for."""
    with suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / TICKS
    return 0.0


def _resident_mb(pid: int) -> float:
    with suppress(OSError):
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    return 0.0


@contextmanager
def busy_others() -> Iterator[dict[str, float]]:
    """How much CPU all of the machine used in the block, for others use it too: {"machine": seconds} afterwards."""
    used: dict[str, float] = {}
    before = _machine_cpu()
    yield used
    used["machine"] = _machine_cpu() - before


def _machine_cpu() -> float:
    user, nice, system, _idle, _iowait, irq, softirq, *_ = map(
        int, Path("/proc/stat").read_text().split("\n")[0].split()[1:]
    )
    return (user + nice + system + irq + softirq) / TICKS
