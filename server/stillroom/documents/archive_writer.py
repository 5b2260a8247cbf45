"""A zip that is written piece by piece while it is sent: see `documents.archives` for what is in it."""

import stat
import zipfile
from collections.abc import Iterator
from datetime import datetime
from hashlib import sha256

from stillroom.documents.archives import MANIFEST, FileEntry, Manifest


class ArchiveWriter:
    """What each method answers with is to be sent. `robot`: None for a home's; `made_at`: when everything in it was so."""

    def __init__(self, service: str, robot: str | None, made_at: datetime) -> None:
        self._pieces = _Pieces()
        self._zip = zipfile.ZipFile(self._pieces, "w", zipfile.ZIP_DEFLATED)
        self._time = made_at.timetuple()[:6]
        self._manifest = Manifest(service=service, robot=robot, made_at=made_at, files=[])

    def add(self, path: str, content: bytes) -> bytes:
        said = FileEntry(path=path, size=len(content), sha256=sha256(content).hexdigest())
        self._manifest.files.append(said)
        self._write(path, content)
        return self._pieces.take()

    def lines(self, path: str, documents: Iterator[bytes]) -> bytes:
        """A file of one document a line."""
        return self.add(path, b"".join(document + b"\n" for document in documents))

    def end(self) -> bytes:
        self._write(MANIFEST, self._manifest.model_dump_json(indent=1, exclude_none=True).encode())
        self._zip.close()
        return self._pieces.take()

    def _write(self, path: str, content: bytes) -> None:
        info = zipfile.ZipInfo(path, self._time)
        info.external_attr = (stat.S_IFREG | 0o600) << 16
        packed = zipfile.ZIP_STORED if path.endswith(".png") else zipfile.ZIP_DEFLATED
        self._zip.writestr(info, content, packed)


class _Pieces:
    """What was written since it was last taken."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def write(self, data: bytes) -> int:
        self._pieces.append(bytes(data))
        return len(data)

    def flush(self) -> None:
        pass

    def close(self) -> None:
        pass

    def take(self) -> bytes:
        taken, self._pieces = b"".join(self._pieces), []
        return taken
