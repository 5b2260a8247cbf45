"""Grids as the robots sent them, by content: the key is the SHA-256 of the bytes. Never altered; deleted with the last that refers to it."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple
from urllib.parse import parse_qs, urlsplit, urlunsplit

from obstore.exceptions import AlreadyExistsError, BaseError
from obstore.store import LocalStore, ObjectStore, S3Store

from stillroom.errors import NotFound, Unavailable

if TYPE_CHECKING:
    from obstore.store import S3Config

_REGION: Literal["us-east-1"] = "us-east-1"
"""What servers of one's own call theirs."""
_CONNECT = timedelta(seconds=2)
_ANSWER = timedelta(seconds=5)
_GIVE_UP = timedelta(seconds=5)
"""Whoever waits for the store is a robot that can wait better, or a worker that can do something else."""
_RETRIES = 2


class Stored(NamedTuple):
    """An object as the store lists it."""

    path: str
    size: int
    at: datetime


class Put(NamedTuple):
    key: str
    made: bool
    """False where the bytes were there already."""


class GridStore:
    """`location` is a folder, or the URL of a bucket of an S3-compatible store, with what all keys begin with:
    `s3://bucket/prefix`.

    `?endpoint=http://host:port` says where a store is that is not Amazon's. Region and credentials come from the
    environment, by the names that all programs know (AWS_REGION, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, …).

    Every method raises Unavailable where the store does not answer, or has no room left.
    """

    def __init__(self, location: str) -> None:
        self._folder = None if "://" in location else Path(location)
        self._store: ObjectStore = (
            LocalStore(self._folder, mkdir=True) if self._folder is not None else _object_store(location)
        )
        self._named: set[Path] = set()
        """Folders whose own names are known to have reached the disk."""
        self.sweeps: int | None = None
        """How many there had been when this process last knew it for certain."""

    def put(self, content: bytes) -> Put:
        """Stores the bytes durably. The same bytes again are the same grid."""
        key, made = sha256(content).hexdigest(), True
        with _unavailable_when_out():
            try:
                self._store.put(path_of(key), content, mode="create")
            except AlreadyExistsError:
                made = False
                if not self._is_whole(key):  # a power loss came between its name and its bytes
                    self._store.put(path_of(key), content)
            if self._folder is not None:
                self._sync(self._folder / path_of(key), self._folder)
        return Put(key, made)

    def _is_whole(self, key: str) -> bool:
        return sha256(self._store.get(path_of(key)).bytes().to_bytes()).hexdigest() == key

    def _sync(self, file: Path, top: Path) -> None:
        """The file and the folder that names it, and once the one that names that: else a power loss could forget a name."""
        _sync(file)
        _sync(file.parent)
        if file.parent not in self._named:
            _sync(top)
            self._named.add(file.parent)

    def get(self, key: str) -> bytes:
        """Raises NotFound where a grid is kept no longer, FileNotFoundError where there is none, ValueError where the bytes are not
        those that were stored."""
        if not key:
            raise NotFound("What the robot sensed is not kept any more.")
        try:
            with _unavailable_when_out():
                content = self._store.get(path_of(key)).bytes().to_bytes()
        except FileNotFoundError:
            self.check()  # a folder that is not mounted, and a bucket that is gone, have lost no grid
            raise
        if sha256(content).hexdigest() != key:
            raise ValueError(f"the stored grid {key} was damaged")
        return content

    def list(self) -> Iterator[Stored]:
        """All that the store holds, grids and what else there may be."""
        with _unavailable_when_out():
            for chunk in self._store.list():
                for entry in chunk:
                    yield Stored(entry["path"], entry["size"], entry["last_modified"])

    def keep(self, key: str, content: bytes) -> None:
        """Stores bytes once more that were deleted since they were stored: nothing referred to them then."""
        try:
            with _unavailable_when_out():
                self._store.head(path_of(key))
        except FileNotFoundError:
            self.put(content)

    def delete(self, keys: Sequence[str]) -> None:
        """Those that are there."""
        with _unavailable_when_out():
            for key in keys:
                with suppress(FileNotFoundError):
                    self._store.delete(path_of(key))

    def check(self) -> None:
        """Raises Unavailable where the store can't be reached."""
        with _unavailable_when_out():
            try:
                next(iter(self._store.list("0", chunk_size=1)), None)
            except FileNotFoundError as error:
                raise Unavailable("There is no grid store where it should be.") from error
            if self._folder is not None and not os.access(self._folder, os.W_OK):
                raise Unavailable(f"{self._folder} can't be written.")


def path_of(key: str) -> str:
    """Where a grid lies in the store."""
    return f"{key[:2]}/{key}"


def _object_store(location: str) -> ObjectStore:
    parts = urlsplit(location)
    (endpoint,) = parse_qs(parts.query).get("endpoint", [""])
    config: S3Config = {"endpoint": endpoint} if endpoint else {}
    if not os.environ.keys() & {"AWS_REGION", "AWS_DEFAULT_REGION"}:
        config["region"] = _REGION
    return S3Store.from_url(
        urlunsplit(parts._replace(query="")),
        config=config,
        client_options={
            "allow_http": urlsplit(endpoint).scheme == "http",
            "connect_timeout": _CONNECT,
            "timeout": _ANSWER,
        },
        retry_config={"max_retries": _RETRIES, "retry_timeout": _GIVE_UP},
    )


@contextmanager
def _unavailable_when_out() -> Iterator[None]:
    try:
        yield
    except FileNotFoundError:
        raise
    except (BaseError, OSError) as error:
        raise Unavailable("The grid store does not answer at the moment.") from error


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
