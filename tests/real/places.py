"""Which real maps show the same place, and where each lies on it.

Found by the files' names and by laying each map's outline over the other maps, and looked at one by one. A pose takes the frame of the
place's first map to that of the map: x and y in metres, the turn in degrees; good to some decimetres, as the maps are bent.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import permutations
from math import radians

import numpy as np

from stillroom.maps.geometry import Pose

At = tuple[float, float, float]


@dataclass(frozen=True)
class Place:
    """`maps`: file -> pose; `parts`: the same of maps that show a part of it only."""

    name: str
    why: str
    maps: Mapping[str, At]
    parts: Mapping[str, At] = field(default_factory=dict)
    only_neighbours: bool = False
    """Only each map and the next one are pairs."""

    @property
    def files(self) -> tuple[str, ...]:
        return (*self.maps, *self.parts)

    def pose_between(self, previous: str, mission: str) -> Pose:
        """From the frame of one map to that of another."""
        everything = {**self.maps, **self.parts}
        first, second = (Pose(x, y, radians(turn)) for x, y, turn in (everything[previous], everything[mission]))
        return second.after(first.inverse())

    def pairs(self) -> Iterator[tuple[str, str]]:
        """Ordered pairs of whole maps."""
        files = list(self.maps)
        for i, j in permutations(range(len(files)), 2):
            if not self.only_neighbours or abs(i - j) == 1:
                yield files[i], files[j]

    def pairs_with_parts(self) -> Iterator[tuple[str, str]]:
        """A whole map and a part, both ways."""
        for whole in self.maps:
            for part in self.parts:
                yield whole, part
                yield part, whole


PLACES = (
    Place(
        "homeA",
        "one flat, by about seven robots; the parts are named otherwise, but are its hall, its bath, its living room",
        {
            "valetudo/homeA/S8_FW1286_with_obstacles.json": (0.00, 0.00, 0.0),
            "valetudo/homeA/d9_1058_with_custom_named_segments.json": (5.23, -6.34, -0.6),
            "valetudo/homeA/d9_1058_with_segments.json": (58.99, -5.13, -90.0),
            "valetudo/homeA/d9_1093_multi_map.json": (58.14, -4.78, -89.4),
            "valetudo/homeA/l10su_1058_goto_target.json": (60.26, -59.36, 179.0),
            "valetudo/homeA/l10su_1121_carpet.json": (60.25, -59.39, 179.0),
            "valetudo/homeA/l10su_1121_new_path.json": (60.31, -59.31, 179.1),
            "valetudo/homeA/testmap_old_format.json": (2.27, -51.34, 90.0),
            "valetudo/homeA/x10plus_1104_with_obstacle.json": (7.40, -58.16, 89.8),
            "valetudo/homeA/z10_1056_paths.json": (60.75, -58.73, -180.0),
            "valetudo/homeA/z10_1056_virtual_restrictions.json": (60.68, -58.92, 179.9),
        },
        parts={
            "valetudo/home_viomi/viomi_v6_41_no_path.json": (45.28, 3.06, -91.2),
            "valetudo/home_viomi/viomi_v6_41_virtual_restrictions_and_active_zones.json": (45.28, 3.06, -91.2),
            "valetudo/home_viomi/viomi_v7_47_cleaned_segment_ids.json": (45.29, 3.00, -91.2),
            "valetudo/single/converted_3290_no_id.json": (-3.79, 3.57, -0.7),
            "valetudo/single/converted_3290_noid_segments.json": (-5.47, -45.18, 88.2),
            "valetudo/single/d9_1058_no_segments.json": (58.45, -5.11, -90.0),
        },
    ),
    Place(
        "elsabot upstairs",
        "one floor over two years; the office is the room at its end",
        {
            "seq/elsabot_upstairs/01_20220731_upstairs.pgm": (0.00, 0.00, 0.0),
            "seq/elsabot_upstairs/02_20230115_upstairs.pgm": (5.62, -4.56, -28.1),
            "seq/elsabot_upstairs/03_20230302_upstairs.pgm": (6.85, -9.98, -23.1),
            "seq/elsabot_upstairs/04_20230704_upstairs2.pgm": (-2.83, -7.23, -112.3),
            "seq/elsabot_upstairs/05_20230821_upstairs3.pgm": (-4.47, -2.68, -116.7),
            "seq/elsabot_upstairs/06_20241111_upstairs_1111.pgm": (3.92, -4.36, -27.6),
        },
        parts={
            "seq/elsabot_office/01_20220717_office.pgm": (-4.35, -6.18, -116.4),
            "seq/elsabot_office/02_20230115_office_for_jeep.pgm": (2.22, 7.50, 86.7),
        },
    ),
    Place(
        "elsabot office",
        "by name; emptied for building something in it",
        {
            "seq/elsabot_office/01_20220717_office.pgm": (-4.35, -6.18, -116.4),
            "seq/elsabot_office/02_20230115_office_for_jeep.pgm": (2.22, 7.50, 86.7),
        },
    ),
    Place(
        "home_viomi",
        "dumps minutes apart; a part of homeA",
        {
            "valetudo/home_viomi/viomi_v6_41_no_path.json": (0.00, 0.00, 0.0),
            "valetudo/home_viomi/viomi_v6_41_virtual_restrictions_and_active_zones.json": (0.00, 0.00, 0.0),
            "valetudo/home_viomi/viomi_v7_47_cleaned_segment_ids.json": (0.01, -0.06, 0.0),
        },
    ),
    Place(
        "rodney second floor",
        "by name",
        {
            "seq/rodney_second_floor/01_20190309_second_floor.pgm": (0.00, 0.00, 0.0),
            "seq/rodney_second_floor/02_20190312_second_floor.pgm": (0.75, -0.56, 169.3),
            "seq/rodney_second_floor/03_20190328_second_floor.pgm": (-0.57, -1.04, 84.5),
        },
    ),
    Place(
        "home_1c",
        "dumps minutes apart; nearly no walls are sensed",
        {
            "valetudo/home_1c/1c_1096_areacleanup.json": (0.00, 0.00, 0.0),
            "valetudo/home_1c/1c_1096_fullcleanup.json": (0.02, 0.02, 0.0),
            "valetudo/home_1c/1c_1096_virtualwall_and_forbidden_zone.json": (0.00, -0.01, 0.0),
            "valetudo/home_1c/1c_1096_zonedcleanup.json": (0.00, 0.00, 0.0),
        },
    ),
    Place(
        "home_s5",
        "dumps minutes apart; one more, of 2.5 m2, could be anywhere",
        {
            "valetudo/home_s5/S5_FW1886_with_forbidden_zones_and_virtual_walls_and_currently_cleaned_zones.json": (
                0.00,
                0.00,
                0.0,
            ),
            "valetudo/home_s5/S5_FW1886_with_goto_target.json": (-0.01, -0.01, 0.0),
            "valetudo/home_s5/S5_FW2008_with_forbidden_zones_and_virtual_walls_and_currently_cleaned_zones.json": (
                -0.03,
                -0.03,
                0.1,
            ),
        },
    ),
    Place(
        "inb robolab",
        "by name; the corridor was explored on the second day",
        {
            "seq/inb_robolab/01_20170711_robolabINB1004.pgm": (0.00, 0.00, 0.0),
            "seq/inb_robolab/02_20170711_robolabINB1004.pgm": (0.00, 0.00, 0.0),
            "seq/inb_robolab/03_20170712_INB1004-wed.pgm": (-0.96, 0.86, 68.4),
            "seq/inb_robolab/04_20170712_INB1004-wed.pgm": (-0.96, 0.86, 68.3),
        },
    ),
    Place(
        "montreal2018",
        "a mock flat: whole (2, 4), with the hall around it (3, 5, 6), and empty (1)",
        {
            "seq/montreal2018/01_20180616_montreal-empty.pgm": (0.00, 0.00, 0.0),
            "seq/montreal2018/02_20180617_montreal_final.pgm": (17.09, 12.72, -179.8),
            "seq/montreal2018/03_20180617_montreal_final.png": (42.79, 16.47, -179.8),
            "seq/montreal2018/04_20180617_montreal_final.pgm": (17.09, 12.72, -179.8),
            "seq/montreal2018/05_20180617_montreal_final.pgm": (20.74, 13.27, -179.8),
            "seq/montreal2018/06_20180618_montreal_final_hmc.pgm": (20.74, 13.27, -179.8),
        },
    ),
    Place(
        "movecare",
        "one hall, by the closet at its corner and its bays: alone (map, map1), and with two ways around its corridor",
        {
            "ros_maps/movecare_map_05_03_2019_4.png": (0.00, 0.00, 0.0),
            "ros_maps/movecare_movecare_map.pgm": (-5.20, 0.88, 46.6),
            "ros_maps/movecare_movecare_map1.pgm": (-5.43, 1.75, 53.3),
            "ros_maps/movecare_movecare_map_integrationmeeting1903.png": (-5.18, 2.34, 46.9),
        },
    ),
    Place(
        "9401 Waples St",
        "one map raw, corrected and edited by hand: the last is bent, half of it lies up to a metre off",
        {
            "ros_maps/brain__p2_15min_9401_Waples_st.png": (0.00, 0.00, 0.0),
            "ros_maps/brain__p2_15min_9401_Waples_st_corrected.png": (0.00, 13.97, -20.0),
            "ros_maps/brain__p2_15min_9401_Waples_st_edited.png": (-0.02, 13.99, -20.0),
        },
    ),
    Place(
        "9444 Waples St",
        "one map raw and corrected",
        {
            "ros_maps/brain__p2_25min_9444_Waples_st.png": (0.00, 0.00, 0.0),
            "ros_maps/brain__p2_25min_9444_Waples_st_corrected.png": (-0.02, 10.92, -24.0),
        },
    ),
    Place(
        "strands tsc",
        "an office over two years; the maps of 2015 were cleared of furniture, _nogo has lines drawn through it",
        {
            "seq/strands_tsc/01_2015_tsc.png": (0.00, 0.00, 0.0),
            "seq/strands_tsc/02_20151214_tsc.png": (0.00, 0.00, 0.0),
            "seq/strands_tsc/03_20160523_tsc20160523.png": (-2.54, -18.41, -70.7),
            "seq/strands_tsc/04_201701_tsc_1701.png": (-2.53, -18.41, -70.6),
            "seq/strands_tsc/05_20160523nogo_tsc20160523_nogo.png": (-2.54, -18.41, -70.7),
            "seq/strands_tsc/06_201701nogo_tsc_1701_nogo.png": (-2.53, -18.41, -70.6),
        },
    ),
    Place(
        "growth cartesium",
        "one run: each map has more than the one before",
        {
            "seq/growth_cartesium/map03.png": (0.00, 0.00, 0.0),
            "seq/growth_cartesium/map04.png": (0.00, 0.00, 0.0),
            "seq/growth_cartesium/map05.png": (10.85, -1.91, 0.0),
            "seq/growth_cartesium/map06.png": (10.86, -1.91, 0.0),
            "seq/growth_cartesium/map07.png": (10.85, -1.90, 0.0),
            "seq/growth_cartesium/map08.png": (23.26, -4.09, 0.0),
            "seq/growth_cartesium/map09.png": (23.26, -4.08, 0.0),
            "seq/growth_cartesium/map10.png": (23.26, -4.07, -0.1),
            "seq/growth_cartesium/map11.png": (34.11, -5.98, -0.1),
            "seq/growth_cartesium/map12.png": (34.11, -5.97, -0.1),
            "seq/growth_cartesium/map13.png": (34.11, -5.97, -0.1),
            "seq/growth_cartesium/map14.png": (34.11, -5.97, -0.1),
            "seq/growth_cartesium/map15.png": (34.11, -5.97, -0.1),
            "seq/growth_cartesium/map16.png": (34.11, -5.97, -0.1),
            "seq/growth_cartesium/map17.png": (34.11, -5.97, -0.1),
        },
        only_neighbours=True,
    ),
)

OTHERS = (
    "ros_maps/LCAS__dis.png",
    "ros_maps/MarekWiejak__astrocent_clean.png",
    "ros_maps/MarekWiejak__home.png",
    "ros_maps/brain__vw_ground_truth_full_edited.png",
    "ros_maps/gpdas__house.pgm",
    "ros_maps/movecare_UMA_236_237.pgm",
    "ros_maps/phopley__ground_floor.png",
    "ros_maps/ryuichiueda__ueda_room.png",
    "ros_maps/sato-susumu__break_room.pgm",
    "ros_maps/sjohns09__home_2.pgm",
    "ros_maps/zerk9045__hallway.pgm",
    "ros_maps/zerk9045__living_room.pgm",
    "movecare_homes/home_01.png",
    "movecare_homes/home_03.png",
    "movecare_homes/home_05.png",
    "movecare_homes/home_07.png",
    "movecare_homes/home_09.png",
    "movecare_homes/home_11.pgm",
    "valetudo/single/S5_FW2008_with_segments.json",
    "valetudo/single/S5_FW2020_with_segments.json",
    "valetudo/single/S6_FW2652_with_active_segment_and_no_mop_zone.json",
    "valetudo/single/converted_3790.json",
    "valetudo/single/d9_1093_huge.json",
    "valetudo/single/l10su_3031_giant.json",
    "valetudo/single/misc_monastery_with_cutoff.json",
    "valetudo/single/sca075_test.json",
    "aws_small_house/map.pgm",
)
"""Maps of places of their own, all different."""


def different(count: int) -> list[tuple[str, str]]:
    """So many ordered pairs of maps of different places, always the same ones."""
    place_of = {file: file for file in OTHERS}
    for place in reversed(PLACES):
        place_of |= dict.fromkeys(place.files, place.name)
    files = sorted(place_of)
    rng = np.random.default_rng(1)
    pairs: list[tuple[str, str]] = []
    while len(pairs) < count:
        i, j = rng.integers(len(files), size=2).tolist()
        pair = files[i], files[j]
        if place_of[pair[0]] != place_of[pair[1]] and pair not in pairs:
            pairs.append(pair)
    return pairs
