"""Grids are kept by content and never altered."""

from hashlib import sha256
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillroom.store.grids import GridStore


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "grids"


@given(content=st.binary(max_size=100))
def test_what_was_stored_comes_back(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    store = GridStore(str(tmp_path_factory.mktemp("grids")))
    key = store.put(content).key
    assert key == sha256(content).hexdigest()
    assert store.get(key) == content


def test_the_same_bytes_are_stored_once_and_the_file_is_left_alone(folder: Path) -> None:
    store = GridStore(str(folder))
    store.put(b"grid")
    (file,) = (path for path in folder.rglob("*") if path.is_file())
    before = file.stat()
    store.put(b"grid")
    assert [path for path in folder.rglob("*") if path.is_file()] == [file]
    assert (file.stat().st_mtime_ns, file.stat().st_ino) == (before.st_mtime_ns, before.st_ino)


def test_a_grid_that_is_not_there_is_missing(folder: Path) -> None:
    with pytest.raises(FileNotFoundError):
        GridStore(str(folder)).get("0" * 64)


def test_a_grid_that_was_damaged_on_the_disk_is_noticed(folder: Path) -> None:
    store = GridStore(str(folder))
    key = store.put(b"grid").key
    (folder / key[:2] / key).write_bytes(b"gird")
    with pytest.raises(ValueError, match="damaged"):
        store.get(key)


def test_grid_and_folders_are_synced_before_put_returns(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[str] = []
    monkeypatch.setattr(
        "stillroom.store.grids.os.fsync", lambda fd: synced.append(str(Path(f"/proc/self/fd/{fd}").readlink()))
    )
    store = GridStore(str(folder))
    key = store.put(b"grid").key
    names = [str(folder / key[:2] / key), str(folder / key[:2])]
    assert synced == [*names, str(folder)]
    synced.clear()
    store.put(b"grid")  # again: whoever wrote it first may have been stopped before it was synced
    assert synced == names
    synced.clear()
    GridStore(str(folder)).put(b"grid")
    assert synced == [*names, str(folder)]
