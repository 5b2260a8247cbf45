"""Every threshold of the pipeline, in the paper's words. In metres, so that any resolution works without retuning."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Params:
    # -- constraints (paper, Tables I and II) --
    wall_reach_m: float = 0.20
    """A wall lies within this distance of an occupied pixel; 95 % of outline length does on real maps."""
    divider_reach_m: float = 0.50
    """A divider's end is moved at most this far to the wall or divider that it ends on."""
    room_overlap: float = 0.5
    """A room is transferred where precision and recall are both higher than this (paper, section V)."""

    # -- walls --
    outline_tolerance_m: float = 0.10
    """The outline of the floor is a polygon within this distance of the cells' edges (Douglas-Peucker)."""
    pillar_area_m2: float = 0.04
    """Holes in the floor smaller than this are specks, not pillars."""
    floor_speck_m2: float = 0.5
    """Free regions smaller than this are no floor."""
    slot_width_m: float = 0.05
    """A gap in a wall that is no wider, or a single cell, is noise."""
    clutter_length_m: float = 1.0
    """An obstacle that stands free and is no longer than this is clutter, whatever its shape."""
    clutter_area_m2: float = 2.5
    """A larger one is clutter up to this area, if it is also thick and full: thin long pieces are wall."""
    clutter_thickness_m: float = 0.45
    clutter_fill: float = 0.6
    clutter_shown_m2: float = 0.01
    """Clutter smaller than this is floor, but not worth a feature."""

    # -- automatic dividers (creation, discovery) --
    divider_length_m: tuple[float, float] = (0.10, 3.5)
    corner_turn_deg: float = 25.0
    """A wall corner that sticks into the floor turns at least this much."""
    divider_clearance: float = 0.25
    """Clearance at a divider's middle, as a share of its length: less, and it hugs a wall."""
    wall_support_m: float = 1.2
    """Counted length of the wall that goes on straight beyond a divider's end."""
    wall_support_slack_m: float = 0.16
    divider_sensitivity: float = 0.0
    """Higher: more dividers, more rooms; -1 and 1 are noticeably less and more."""
    divided_room_m2: float = 1.0
    """What a divider parts off is a room from this area on."""
    room_area_m2: float = 1.8
    """Other spaces that are smaller belong to a neighbour."""
    pocket_area_m2: float = 0.7
    """Spaces that no divider reaches and that are smaller than this are no rooms."""

    hallway_width_m: float = 2.5
    """A hallway is no wider than this,"""
    hallway_stretch: float = 3.0
    """covers so many squares of its width,"""
    hallway_doors: int = 3
    """and has so many dividers."""

    # -- transfer (Algorithm 1) --
    wall_classification_m: float = 0.25
    """Obstacles this near to a tracked room boundary are wall (step 2): three times the error that alignment leaves."""
    wall_spur_m: float = 0.30
    """A piece of wall that stands off the tracked wall by more than `wall_offset_m` and is shorter than this is clutter."""
    wall_offset_m: float = 0.10
    outline_margin_m: float = 0.15
    """Unexplored space this near to a tracked boundary is floor only where the space behind it was not seen either."""
    door_thickness_m: float = 0.15
    door_cover: float = 0.5
    """A divider is shut where obstacles cover more than this share of its length,"""
    door_open: float = 0.2
    """and open where they cover less than this."""
    transfer_reach_m: float = 1.0
    """A tracked divider's end is looked for this far along the divider's own line."""
    face_area_m2: float = 0.25
    """Pieces of floor smaller than this join the neighbour with the longest common edge."""

    # -- resolution --
    meta_length_m: float = 1.5
    """Sections of wall longer than this that are gone, or new, are real changes and stand (meta-occupancy): a door's width and more."""
    meta_area_m2: float = 0.5
    """The same of new obstacles, by area."""
    meta_thickness_m: float = 0.10
    """Of the walls that meta-occupancy puts back."""

    contradicted_missions: int = 5
    """A correction that so many missions contradicted becomes a question to the owner."""
    shape_overlap: float = 0.6
    """A room that passed, but of which precision or recall is lower than this, changed its shape a lot."""

    # -- drift --
    drift_recall: float = 0.9
    """A room of whose anchor less than this is left,"""
    drift_m: float = 0.25
    """and that slid farther than this against the others, has drifted."""

    # -- discovery --
    growth_area_m2: float = 0.3
    """New floor beyond all rooms that is looked at."""
    furniture_area_m2: float = 5.0
    """Furniture covers no more than this in one place: a large bed with a wardrobe beside it,"""
    door_width_m: float = 0.5
    """and no door is narrower."""
    room_enclosure: float = 0.5
    """New floor is a room where walls bound this share of it, what it shares with known rooms apart."""

    # -- alignment and registration --
    tracking_outlier_m: float = 0.20
    """A tracked vertex that stands apart from its neighbours by more than this counts little."""
    alignment_reach_m: float = 0.35
    """How far from its tracked place a wall is looked for."""
    search_reach_m: float = 1.0
    """The same where the robot tracked nothing."""
    alignment_inlier_m: float = 0.10
    registration_certain: float = 0.85
    """Where the walls in sight lie as before to this share, and nothing speaks against it, no other pose is tried."""
    registration_seen: float = 0.3
    """Of the walls known so far, so many must be in sight for that,"""
    registration_floor: float = 0.74
    """and so much of the smaller floor be common."""
    registration_fit: float = 0.53
    """A frame counts as found where a pose fits as well as this (another home reaches 0.51, the same one 0.54 and more),"""
    registration_margin: float = 0.6
    """and no other pose reaches more than this part of its fit."""

    # -- plausibility --
    plausible_length_m: float = 5.0
    """So much wall must be in sight before it says anything."""
    plausible_floor: float = 0.3
    """Where less is, a grid with less of its floor in known rooms than this shows another floor."""
    plausible_agreement: float = 0.5
    """A grid whose walls agree less than this with the previous map's shows another floor; with all furniture moved it is 0.6 and more."""
    plausible_twice: float = 0.10
    """A grid that has so much of the walls twice is wrecked. On 118 pairs of real maps of one place chance gave 0.07 at most."""


PARAMS = Params()
