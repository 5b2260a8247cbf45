"""Sorties on disk: what a robot does never depends on what a service answers, so that each needs to be simulated only once."""

import ast
import os
import pickle
import zlib
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path

import numpy as np

import stillroom
from stillroom.maps.grid import Mask
from stillroom.simulator.fleet import SimulatedRobot, Sortie

_SOURCES = Path(stillroom.__file__).parent
_LEVEL = 3
_NOTHING: Mask = np.zeros((0, 0), bool)
_LIBRARIES = ("numpy", "opencv-python-headless", "shapely")


def default_folder() -> Path:
    """Below the user's cache folder (XDG base directory specification)."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "stillroom" / "sorties"


def sorties_of(robot: SimulatedRobot, missions: int, folder: Path | None) -> Sequence[Sortie]:
    """The robot's first missions; from `folder` where the same robot's were simulated before by the same program.

    Without the rasters of what the robot saw. What an older program left in `folder` is never read again.
    """
    if folder is None:
        return [_lean(robot.sortie(number)) for number in range(missions)]
    home = b"".join(shape.wkb for shape in (robot.home.walls, *(piece.solid for piece in robot.home.furniture)))
    key = repr((robot.streams, robot.effects, robot.resolution, missions)).encode()
    kept = folder / _fingerprint() / f"{sha256(key + home).hexdigest()[:32]}.zlib"
    if kept.exists():
        found: list[Sortie] = pickle.loads(zlib.decompress(kept.read_bytes()))
        return found
    fresh = [_lean(robot.sortie(number)) for number in range(missions)]
    kept.parent.mkdir(parents=True, exist_ok=True)
    half = kept.with_suffix(f".{os.getpid()}")
    half.write_bytes(zlib.compress(pickle.dumps(fresh, pickle.HIGHEST_PROTOCOL), _LEVEL))
    half.replace(kept)
    return fresh


def _lean(sortie: Sortie) -> Sortie:
    floor = replace(sortie.sensed.floor, solid=_NOTHING, glass=_NOTHING)
    return replace(sortie, sensed=replace(sortie.sensed, floor=floor, seen=_NOTHING))


@cache
def _fingerprint() -> str:
    """Of all that sorties depend on: the simulator's sources with what they import, and the libraries."""
    digest = sha256()
    for source in sorted(sources("stillroom.simulator.fleet")):
        digest.update(source.read_bytes())
    for library in _LIBRARIES:
        digest.update(metadata.version(library).encode())
    return digest.hexdigest()[:16]


def sources(module: str) -> frozenset[Path]:
    """The files of a module of this package and of all that it imports from it."""
    found: set[Path] = set()
    waiting = [_file(module)]
    while waiting:
        file = waiting.pop()
        if file is None or file in found:
            continue
        found.add(file)
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                waiting += [_file(node.module), *(_file(f"{node.module}.{name.name}") for name in node.names)]
            elif isinstance(node, ast.Import):
                waiting += [_file(name.name) for name in node.names]
    return frozenset(found)


def _file(module: str) -> Path | None:
    package, *inner = module.split(".")
    if package != "stillroom":
        return None
    path = _SOURCES.joinpath(*inner)
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)
