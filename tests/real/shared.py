"""Real maps, where they are at hand: a folder beside the checkout, which is no part of it."""

import os
from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
FOLDERS = ("ros_maps", "movecare_homes", "valetudo", "ipa_room_segmentation", "seq")
EVERYTHING = os.environ.get("STILLROOM_ALL_MAPS") == "1"
"""All maps take some minutes: STILLROOM_ALL_MAPS=1 tests with them instead of a few of each kind."""
SUFFIXES = (".png", ".pgm", ".json")


def maps(*patterns: str) -> list[Path]:
    """Map files of the patterns, or all there are."""
    if EVERYTHING:
        patterns = tuple(f"{folder}/**/*" for folder in FOLDERS)
    return sorted({path for pattern in patterns for path in DATA.glob(pattern) if path.suffix in SUFFIXES})


def parameters(*patterns: str) -> list[object]:
    """A parameter for each map; without any, one that is skipped with the reason."""
    found = [pytest.param(path, id=str(path.relative_to(DATA))) for path in maps(*patterns)]
    missing = pytest.param(None, marks=pytest.mark.skip(reason=f"there are no real maps in {DATA}"))
    return list(found) or [missing]
