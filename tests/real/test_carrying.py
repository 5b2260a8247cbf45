"""Real maps of one home, by several robots over years, as missions that nobody tracked: the first map's rooms stay under their ids."""

import pytest

from tests.real.carrying import CARRIED, carry
from tests.real.places import PLACES
from tests.real.shared import DATA

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"there are no real maps in {DATA}")
MOST = 0.8


@pytest.mark.parametrize("name", CARRIED)
def test_rooms_are_carried_through_maps_of_several_robots_in_frames_of_their_own(name: str) -> None:
    (place,) = (place for place in PLACES if place.name == name)
    missions = list(carry(place))
    taken = [mission for mission in missions if mission.update.taken]
    assert len(taken) >= MOST * len(missions)
    for mission in taken:
        assert set(mission.again) | mission.asked >= set(mission.expected), mission.file
    assert sum(set(mission.again) == set(mission.expected) for mission in taken) >= MOST * len(missions)
