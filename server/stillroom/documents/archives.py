"""An archive: all that is known of a robot's maps, or of all robots of a home, as a zip, to be kept, and to be brought into another service again.

`manifest.json` comes last and names each other file with its SHA-256. What is read here comes from strangers: nothing is unpacked
that the list of contents does not allow, and nothing is taken that the models below do not.
"""

import re
import stat
import zipfile
from collections.abc import Mapping
from hashlib import sha256
from typing import IO, Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stillroom.documents.json_text import load_json
from stillroom.documents.missions import MISSION_ID, Moment, faults_of
from stillroom.errors import Fault, InvalidInput, TooLarge

MANIFEST = "manifest.json"
MOST_FILES = 200_000
MOST_BYTES = 4 * 2**30
"""Of all files together, unpacked."""
MOST_OF_ONE = 64 * 2**20
MOST_OF_DOCUMENT = 8 * 2**20
"""Of a file that becomes objects, which take many times as much memory; of the manifest, `MOST_OF_ONE`."""
MOST_OF_CONTENTS = 20 * 2**20
"""Of a zip's list of its files, which is read at once: enough for `MOST_FILES`."""
MOST_RATIO = 100
"""How many times larger than the archive its files may be together, where they are more than `SMALL`."""
SMALL = 256 * 2**20
_LAYOUT = re.compile(
    r"manifest\.json|README\.txt|home\.json"
    r"|grids/[0-9a-f]{64}\.(png|pgm|json)"
    r"|(robots/[1-9][0-9]{0,3}/)?(robot\.json|(log|grants)\.jsonl"
    r"|maps/[1-9][0-9]{0,3}/(map\.json|(versions|missions)/[0-9]{6,9}\.json|(decisions|events)\.jsonl"
    r"|current/map\.(geojson|png|yaml|pgm|json)))"
)
_GRID = len("grids/"), len("grids/") + 64
_DOCUMENT = re.compile(r"(robots/\d+/)?(robot\.json|maps/\d+/(map\.json|(versions|missions)/\d+\.json))")
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 0x1

Text = Annotated[str, Field(max_length=400, pattern=r"^[^\x00]*$")]
Name = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
Id = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]*$")]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Number = Annotated[int, Field(ge=0, le=2**31 - 1)]
Large = Annotated[int, Field(ge=0, le=2**53 - 1)]
Key = Annotated[str, Field(pattern=r"^[A-Za-z0-9._~-]{1,130}$")]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


class FileEntry(_Strict):
    path: Text
    size: Large
    sha256: Digest


class Manifest(_Strict):
    format: Literal[1] = 1
    service: Text
    """Which program wrote it, in which version."""
    robot: Id | None = None
    """None: it is a home's, and each robot has a folder."""
    made_at: Moment
    files: list[FileEntry]


class ArchivedRobot(_Strict):
    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    name: Name
    created_at: Moment


class ArchivedRoom(_Strict):
    id: Id
    segment_id: Number
    name: Name
    retired: bool
    survivor: Id | None


class ArchivedMap(_Strict):
    name: Annotated[str, Field(pattern=MISSION_ID)]
    title: Name
    ordinal: Annotated[int, Field(ge=1, le=9999)]
    review: Literal["automatic", "ask_first"]
    head: Number | None
    pinned: Number | None
    epoch: Large | None
    sequence: Large | None
    used_ids: dict[Annotated[str, Field(pattern=r"^[a-z_]{1,20}$")], Number]
    created_at: Moment
    rooms: list[ArchivedRoom]


class ArchivedVersion(_Strict):
    number: Annotated[int, Field(ge=1, le=2**31 - 1)]
    parent: Number | None
    cause: Literal["created", "mission", "edit", "decision", "restore", "import"]
    mission: Key | None
    made_by: Text
    created_at: Moment
    algorithm: Annotated[str, Field(max_length=32)]
    grid: Digest | Literal[""]
    frame_from: Number | None
    motion: dict[str, Any] | None
    name: Annotated[str, Field(max_length=100)] | None
    document: dict[str, Any]
    """As in docs/formats.md."""


class ArchivedMission(_Strict):
    key: Key
    epoch: Large
    sequence: Large
    status: Literal["queued", "processing", "done"]
    grid: Digest | Literal[""]
    meta: dict[str, Any]
    received_at: Moment
    finished_at: Moment | None
    outcome: Annotated[str, Field(max_length=16)] | None
    succeeded_at: Annotated[str, Field(max_length=16)] | None
    ablation: tuple[bool, bool, bool] | None
    base_version: Number | None
    version: Number | None
    algorithm: Annotated[str, Field(max_length=32)] | None
    result: dict[str, Any] | None
    placed_from: tuple[Number, Key] | None
    """The parked mission that a person put here: its map's ordinal, and its key."""
    placed_by: Text | None


Model = TypeVar("Model", bound=BaseModel)


class Archive:
    """One that was opened and whose list of contents is in order. Every file is checked against the manifest as it is read.

    Raises InvalidInput, and TooLarge, like all methods; `file` can be sought in.
    """

    def __init__(self, file: IO[bytes]) -> None:
        try:
            _check_contents(file)
            self._zip = zipfile.ZipFile(file)
            self._entries = _checked(self._zip, file.seek(0, 2))
            self.manifest = parse(Manifest, self._unpack(MANIFEST), MANIFEST)
        except (zipfile.BadZipFile, NotImplementedError, EOFError, OSError, ValueError) as error:
            raise _refused("", f"no zip that can be read: {error}") from None
        self._said = {entry.path: entry for entry in self.manifest.files}
        if len(self._said) != len(self.manifest.files) or self._said.keys() != self._entries.keys() - {MANIFEST}:
            raise _refused(MANIFEST, "does not name each file once, and no other")
        grids = self.below("grids")
        self._grids = {path[slice(*_GRID)]: path for path in grids}
        if len(self._grids) != len(grids):
            raise _refused("grids", "one is there twice")

    def read(self, path: str) -> bytes:
        if path not in self._said:
            raise _refused(path, "missing")
        content, said = self._unpack(path), self._said[path]
        if len(content) != said.size or sha256(content).hexdigest() != said.sha256:
            raise _refused(path, "not what the manifest says")
        if path.startswith("grids/") and said.sha256 not in path:
            raise _refused(path, "not the grid that it is called")
        return content

    def load(self, model: type[Model], path: str) -> Model:
        return parse(model, self.read(path), path)

    def check(self) -> None:
        """Every file, also those that nobody needs here."""
        for path in self._said:
            self.read(path)

    def robots(self) -> list[str]:
        """The beginnings of all paths of each robot."""
        if self.manifest.robot is not None:
            return [""]
        found = {path[: path.index("/", len("robots/")) + 1] for path in self._said if path.startswith("robots/")}
        return sorted(found, key=lambda folder: (len(folder), folder))

    def grid(self, key: str) -> str:
        """The path of a grid."""
        if key not in self._grids:
            raise _refused(f"grids/{key}", "missing")
        return self._grids[key]

    def below(self, folder: str) -> list[str]:
        """The paths of all files in a folder, in order."""
        return sorted(path for path in self._said if path.startswith(folder + "/"))

    def _unpack(self, path: str) -> bytes:
        info = self._entries.get(path)
        if info is None:
            raise _refused(path, "missing")
        try:
            with self._zip.open(info) as packed:
                return packed.read(MOST_OF_ONE + 1)
        except Exception as error:  # zlib's own class of errors has no name that all versions know
            raise _refused(path, f"can't be unpacked: {error}") from None


_SIZE_OF_CONTENTS = 5


def _check_contents(file: IO[bytes]) -> None:
    """Raises TooLarge before the list of contents is read. The end of a zip is found in more than one way: what counts is where
    `zipfile` itself will look."""
    end = zipfile._EndRecData(file)  # type: ignore[attr-defined]
    if end and end[_SIZE_OF_CONTENTS] > MOST_OF_CONTENTS:
        raise TooLarge(f"An archive has at most {MOST_FILES} files.")


def _checked(archive: zipfile.ZipFile, size: int) -> Mapping[str, zipfile.ZipInfo]:
    """By the list of contents alone, before anything is unpacked."""
    found: dict[str, zipfile.ZipInfo] = {}
    total = 0
    for info in archive.infolist():
        problem = _problem_of(info, found)
        if problem is not None:
            raise _refused(info.filename[:100], problem)
        found[info.filename] = info
        total += info.file_size
        if len(found) > MOST_FILES:
            raise TooLarge(f"An archive has at most {MOST_FILES} files.")
    if total > MOST_BYTES or (total > SMALL and total > MOST_RATIO * size):
        raise TooLarge(f"The archive's files have {total} bytes; that is too much for an archive of {size}.")
    return found


def _problem_of(info: zipfile.ZipInfo, found: Mapping[str, zipfile.ZipInfo]) -> str | None:
    kind = stat.S_IFMT(info.external_attr >> 16)
    if _LAYOUT.fullmatch(info.filename) is None or info.orig_filename != info.filename:
        return "no file of an archive is called so"
    if info.filename in found:
        return "there twice"
    if kind not in (0, stat.S_IFREG):
        return "no plain file"
    if info.flag_bits & _ENCRYPTED or info.compress_type not in _PACKED:
        return "encrypted, or packed in another way than is read here"
    most = MOST_OF_DOCUMENT if _DOCUMENT.fullmatch(info.filename) else MOST_OF_ONE
    return f"more than {most} bytes" if info.file_size > most else None


def parse(model: type[Model], content: bytes, path: str) -> Model:
    """Raises InvalidInput with pointers below the file's path."""
    load_json(content, f"/{path}")
    try:
        return model.model_validate_json(content)
    except ValidationError as error:
        raise InvalidInput(f"{path} can't be used.", faults_of(error, f"/{path}")) from None


def _refused(path: str, why: str) -> InvalidInput:
    return InvalidInput("The archive can't be used.", (Fault(f"/{path}", why),))
