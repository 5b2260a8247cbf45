"""Real maps that nobody tracked: the same place is found or honestly parked, another one never taken for it.

A sample; `make bench-registration` prints the table of all of them.
"""

import pytest

from tests.real.places import PLACES, different
from tests.real.registering import DIFFERENT, Try, attempt, of_places
from tests.real.shared import DATA, EVERYTHING

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"there are no real maps in {DATA}")

SURE = ("homeA", "elsabot upstairs", "rodney second floor", "home_1c", "home_s5", "home_viomi")
FEW = 12
SAMPLE = 20
LIGHT = (
    "valetudo/home",
    "valetudo/single/S",
    "valetudo/single/c",
    "seq/elsabot",
    "seq/rodney",
    "ros_maps/zerk",
    "ros_maps/sato",
)
PARTS = (
    ("valetudo/homeA/l10su_1121_carpet.json", "valetudo/single/d9_1058_no_segments.json"),
    ("valetudo/homeA/x10plus_1104_with_obstacle.json", "valetudo/single/converted_3290_noid_segments.json"),
    ("seq/elsabot_upstairs/02_20230115_upstairs.pgm", "seq/elsabot_office/02_20230115_office_for_jeep.pgm"),
)


def place(name: str) -> list[Try]:
    """All pairs of a place, or a few that take each of its maps at least once."""
    (found,) = (place for place in PLACES if place.name == name)
    pairs = list(found.pairs())
    chosen = pairs if EVERYTHING else pairs[:: max(1, len(pairs) // FEW)]
    return [attempt(a, b, found.pose_between(a, b)) for a, b in chosen]


@pytest.mark.parametrize("name", SURE)
def test_maps_of_one_home_are_found_on_each_other(name: str) -> None:
    tries = place(name)
    assert [t for t in tries if not (t.found and t.plausible)] == []


@pytest.mark.parametrize(("whole", "part"), PARTS)
def test_a_part_of_a_home_is_found_or_parked_but_never_put_elsewhere(whole: str, part: str) -> None:
    (home,) = (place for place in PLACES if whole in place.maps)
    for a, b in ((whole, part), (part, whole)):
        assert not attempt(a, b, home.pose_between(a, b)).wrong


def test_no_map_is_taken_for_one_of_another_home() -> None:
    pairs = different(DIFFERENT)
    if not EVERYTHING:
        pairs = [pair for pair in pairs if all(file.startswith(LIGHT) for file in pair)][:SAMPLE]
    assert len(pairs) >= SAMPLE
    assert [t for t in (attempt(a, b, None) for a, b in pairs) if t.accepted] == []


@pytest.mark.skipif(not EVERYTHING, reason="all pairs take a minute: STILLROOM_ALL_MAPS=1")
def test_of_all_pairs_none_is_found_wrongly() -> None:
    assert [t for _, row in of_places() for t in row if t.wrong] == []
