"""What a person may want to know or decide about a mission: kinds, causes, sentences, and the maps that there could be instead."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon

from stillroom.maps.geometry import Pose
from stillroom.maps.grid import Cell, OccupancyGrid
from stillroom.maps.motion import IDENTITY
from stillroom.maps.semantics import Ids, Restriction, SemanticMap
from stillroom.pipeline.conflicts import Conflict, Naming, detect_conflicts, loss, wrong_map
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.resolution import Attempt
from stillroom.pipeline.scores import RoomScore, score_rooms
from stillroom.pipeline.transfer import track, transfer_semantics
from stillroom.pipeline.update import RESOLVERS, MapUpdate, ResolverName
from tests.drawing import paint, rectangle
from tests.golden.homes import CORRIDOR, FOUR_ROOMS
from tests.golden.uploads import assert_valid, between, conflicts_of, first_map, upload
from tests.missions import sense

HOME = FOUR_ROOMS.grid
BASE = first_map(FOUR_ROOMS)
GAPPED = paint(HOME, Cell.FREE, rectangle(3.2, 2.0, 4.0, 2.2))
HALF_SEEN_GAP = paint(
    paint(HOME, Cell.UNEXPLORED, rectangle(2.8, 2.0, 4.0, 2.2)), Cell.FREE, rectangle(3.2, 2.0, 3.4, 2.2)
)
BREACH = paint(HOME, Cell.FREE, rectangle(4.2, 1.95, 6.4, 2.25))
LOST = ("room_lost", "room_recall", "room_precision")


def about_rooms(update: MapUpdate) -> list[Conflict]:
    return [conflict for conflict in update.conflicts if conflict.kind in LOST]


# -- names and ids ---------------------------------------------------------------------------------------------------


def test_an_id_depends_on_the_mission_the_kind_and_the_subjects_in_any_order() -> None:
    one = Naming(BASE, "7")
    assert one.id_of("shape", ["r1", "r2"]) == one.id_of("shape", ["r2", "r1"])
    others = [
        one.id_of("shape", ["r1"]),
        one.id_of("drift", ["r1", "r2"]),
        Naming(BASE, "8").id_of("shape", ["r1", "r2"]),
        Naming(replace(BASE, ids=Ids("2-")), "7").id_of("shape", ["r1", "r2"]),
    ]
    assert len({one.id_of("shape", ["r1", "r2"]), *others}) == 5


def test_rooms_are_listed_as_people_would() -> None:
    ids = {room.name: room.id for room in BASE.rooms}
    naming = Naming(BASE, "1")
    assert naming.rooms([ids["A"]]) == "A"
    assert naming.rooms([ids["A"], ids["B"]]) == "A and B"
    assert naming.rooms([ids["A"], ids["B"], ids["C"]]) == "A, B and C"
    assert naming.rooms(["r99"]) == "r99"


@pytest.mark.parametrize(
    ("precision", "recall", "said"),
    [
        (0.0, 0.0, "Kitchen was not found again"),
        (0.97, 0.41, "59% of Kitchen is gone"),
        (0.37, 1.0, "Kitchen ran into its surroundings, only 37% of it was Kitchen before"),
    ],
)
def test_a_loss_is_told_in_words(precision: float, recall: float, said: str) -> None:
    assert loss(RoomScore("r3", "Kitchen", precision, recall, passed=False)) == said


# -- rooms -----------------------------------------------------------------------------------------------------------


def test_a_mission_without_changes_has_no_conflict() -> None:
    for seed in range(3):
        grid = sense(HOME, Pose(), np.random.default_rng(seed), 0.1)
        assert upload(BASE, grid, noise_m=0.03, seed=seed).conflicts == ()


def test_rooms_that_ran_into_each_other_are_one_conflict() -> None:
    update = upload(BASE, GAPPED, resolvers=())
    (conflict,) = about_rooms(update)
    failed = {score.id for score in update.rooms if not score.passed}
    assert {score.id for score in conflict.rooms} == failed
    assert not conflict.resolved
    assert (conflict.kind, conflict.id.startswith("c")) == ("room_lost", True)


def test_rooms_that_failed_apart_from_each_other_are_conflicts_of_their_own() -> None:
    """C and A run into each other on the left, B and D on the right."""
    both = paint(BREACH, Cell.FREE, rectangle(2.2, 1.95, 4.0, 2.25))
    walled = paint(both, Cell.OCCUPIED, rectangle(4.0, 0.0, 4.2, 4.6))
    update = upload(BASE, walled, resolvers=())
    conflicts = about_rooms(update)
    assert len(conflicts) == 2
    groups = [{score.id for score in conflict.rooms} for conflict in conflicts]
    assert not groups[0] & groups[1]
    assert len({conflict.id for conflict in conflicts}) == 2


@pytest.mark.parametrize(
    ("grid", "cause"), [(HALF_SEEN_GAP, "wall_gap"), (GAPPED, "new_passage")], ids=["a sixth seen", "seen"]
)
def test_a_gap_of_which_little_was_seen_is_a_gap_and_one_that_was_seen_is_a_passage(
    grid: OccupancyGrid, cause: str
) -> None:
    update = upload(BASE, grid)
    assert update.outcome == "resolved", update.reason
    assert [conflict.cause for conflict in about_rooms(update)] == [cause]


def test_the_conflict_that_was_settled_names_its_rooms_its_dividers_and_its_scores_before() -> None:
    update = upload(BASE, GAPPED)
    (conflict,) = about_rooms(update)
    (score,) = conflict.rooms
    assert score.name in ("A", "C")
    assert min(score.precision, score.recall) <= 0.5
    assert not score.passed
    assert between(BASE, "A", "C").id in conflict.dividers
    assert conflict.summary.startswith(f"{score.name} was kept as before although ")


@pytest.mark.parametrize("grid", [GAPPED, BREACH], ids=["gap", "breach"])
def test_of_the_maps_that_there_could_be_the_first_is_recommended_and_all_are_valid(grid: OccupancyGrid) -> None:
    rows: tuple[tuple[ResolverName, ...], ...] = ((), RESOLVERS)
    for resolvers in rows:
        update = upload(BASE, grid, resolvers=resolvers)
        assert update.conflicts
        for conflict in update.conflicts:
            assert [p.recommended for p in conflict.proposals] == [True, *[False] * (len(conflict.proposals) - 1)][
                : len(conflict.proposals)
            ]
            assert len({p.id for p in conflict.proposals}) == len(conflict.proposals)
            for proposal in conflict.proposals:
                assert_valid(proposal.map, HOME if proposal.map is BASE else grid)


def test_a_mission_that_was_not_taken_can_be_left_or_taken_as_it_was_sensed() -> None:
    update = upload(BASE, GAPPED, resolvers=())
    (conflict,) = about_rooms(update)
    assert [(p.action, p.recommended) for p in conflict.proposals] == [("keep_previous", True), ("take_new", False)]
    assert conflict.proposals[0].map is BASE
    assert len(conflict.proposals[1].map.rooms) == len(BASE.rooms) - 1
    assert update.outcome == "needs_review"


# -- other criteria --------------------------------------------------------------------------------------------------


def attempt(base: SemanticMap = BASE, grid: OccupancyGrid = HOME) -> Attempt:
    transfer = transfer_semantics(track(base, IDENTITY, grid.frame), grid, "1", PARAMS)
    return Attempt(transfer, score_rooms(transfer.tracked, transfer.candidate, transfer.visited, PARAMS), grid)


def test_a_divider_without_a_wall_to_end_on_is_told() -> None:
    divider, made = between(BASE, "B", "D").id, attempt()
    rest = tuple(d for d in made.transfer.candidate.dividers if d.id != divider)
    candidate = replace(made.transfer.candidate, dividers=rest)
    best = replace(made, transfer=replace(made.transfer, candidate=candidate, lost_dividers=(divider,)))
    (conflict,) = detect_conflicts(BASE, made, best, "1", True, PARAMS)
    assert (conflict.kind, conflict.dividers, conflict.resolved) == ("divider_lost", (divider,), False)
    assert {score.name for score in conflict.rooms} == {"B", "D"}
    assert "B and D" in conflict.summary or "D and B" in conflict.summary


@pytest.mark.parametrize("gap", [rectangle(4.2, 1.95, 6.6, 2.25), rectangle(4.2, 1.95, 8.2, 2.25)])
def test_a_divider_beside_a_wall_that_is_gone_is_kept_or_told(gap: Polygon) -> None:
    update = upload(BASE, paint(HOME, Cell.FREE, gap))
    assert update.taken, update.reason
    divider = between(BASE, "B", "D").id
    told = [d for conflict in conflicts_of(update, "divider_lost") for d in conflict.dividers]
    assert (update.map.divider(divider) is None) == (divider in told)


@pytest.mark.parametrize(
    ("precision", "recall", "said"), [(0.97, 0.55, "45% of D is gone."), (0.55, 0.97, "D grew: 45% of it is new.")]
)
def test_a_large_change_of_shape_is_told_although_the_room_passed(precision: float, recall: float, said: str) -> None:
    made = attempt()
    changed = [
        replace(score, precision=precision, recall=recall) if score.name == "D" else score for score in made.scores
    ]
    best = replace(made, scores=tuple(changed))
    (conflict,) = detect_conflicts(BASE, best, best, "1", True, PARAMS)
    assert (conflict.kind, conflict.summary, conflict.resolved) == ("shape", said, False)
    assert [score.name for score in conflict.rooms] == ["D"]


def test_the_shape_of_a_room_that_was_not_visited_says_nothing() -> None:
    made = attempt()
    unseen = [replace(score, recall=0.2, visited=False) for score in made.scores]
    best = replace(made, scores=tuple(unseen))
    assert detect_conflicts(BASE, best, best, "1", True, PARAMS) == ()


def test_a_zone_that_finds_no_place_is_told_once() -> None:
    zone = Restriction("z1", "no_go", ((1.0, 3.0), (1.5, 3.0), (1.5, 3.5), (1.0, 3.5)))
    base, lost = replace(BASE, restrictions=(zone,)), replace(zone, placed=False)
    made = attempt(base)
    candidate = replace(made.transfer.candidate, restrictions=(lost,))
    best = replace(made, transfer=replace(made.transfer, candidate=candidate))
    (conflict,) = detect_conflicts(base, made, best, "1", True, PARAMS)
    assert (conflict.kind, conflict.restrictions, conflict.resolved) == ("restriction_unplaced", ("z1",), False)
    before = replace(base, restrictions=(lost,))
    assert detect_conflicts(before, made, best, "2", True, PARAMS) == ()


def test_a_map_that_breaks_a_rule_although_all_rooms_are_there_is_one_conflict() -> None:
    made = attempt()
    changed = tuple(replace(score, recall=0.55) for score in made.scores)
    best = replace(made, scores=changed)
    (conflict,) = detect_conflicts(BASE, best, best, "1", False, PARAMS)
    assert (conflict.kind, conflict.resolved, conflict.rooms) == ("shape", False, ())
    assert conflict.proposals[0].action == "keep_previous"


def test_a_map_of_another_place_is_one_conflict_without_rooms() -> None:
    conflict = wrong_map(BASE, "7", "This is another floor.")
    assert (conflict.kind, conflict.cause, conflict.rooms, conflict.proposals) == ("wrong_map", "unknown", (), ())
    assert conflict.summary == "This is another floor."
    again = upload(BASE, CORRIDOR.grid, number=7)
    assert [c.id for c in again.conflicts] == [conflict.id]
