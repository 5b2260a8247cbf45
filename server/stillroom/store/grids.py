"""Grids as the robots sent them, by content: the key is the SHA-256 of the bytes. Never altered, never deleted."""

import os
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from obstore.exceptions import AlreadyExistsError
from obstore.store import LocalStore, ObjectStore, from_url


class GridStore:
    """`location` is a folder, or the URL of an object store (`s3://…`)."""

    def __init__(self, location: str) -> None:
        self._folder = None if "://" in location else Path(location)
        self._store: ObjectStore = (
            LocalStore(self._folder, mkdir=True) if self._folder is not None else from_url(location)
        )
        self._named: set[Path] = set()
        """Folders whose own names are known to have reached the disk."""

    def put(self, content: bytes) -> str:
        """Stores the bytes durably; answers with their key. The same bytes again are the same grid."""
        key = sha256(content).hexdigest()
        with suppress(AlreadyExistsError):
            self._store.put(_path(key), content, mode="create")
        if self._folder is not None:
            self._sync(self._folder / _path(key), self._folder)
        return key

    def _sync(self, file: Path, top: Path) -> None:
        """The file and the folder that names it, and once the one that names that: else a power loss could forget a name."""
        _sync(file)
        _sync(file.parent)
        if file.parent not in self._named:
            _sync(top)
            self._named.add(file.parent)

    def get(self, key: str) -> bytes:
        """Raises FileNotFoundError where there is none, ValueError where the bytes are not those that were stored."""
        content = self._store.get(_path(key)).bytes().to_bytes()
        if sha256(content).hexdigest() != key:
            raise ValueError(f"the stored grid {key} was damaged")
        return content

    def check(self) -> None:
        """Raises where the store can't be reached."""
        next(iter(self._store.list("0", chunk_size=1)), None)
        if self._folder is not None and not os.access(self._folder, os.W_OK):
            raise PermissionError(f"{self._folder} can't be written")


def _path(key: str) -> str:
    return f"{key[:2]}/{key}"


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
