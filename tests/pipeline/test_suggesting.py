"""Rooms parted anew at another sensitivity: as edits that leave alone what people drew."""

from dataclasses import replace

from stillroom.maps.semantics import Divider, Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.edits import AddDivider, RemoveDivider, apply_edits
from stillroom.pipeline.edits.suggesting import suggest_dividers
from tests.golden.homes import CORRIDOR


def made() -> SemanticMap:
    return create_map(CORRIDOR.grid, "1", Ids())


def test_at_the_usual_sensitivity_there_is_nothing_to_do() -> None:
    assert suggest_dividers(made(), 0.0) == ()


def test_at_the_lowest_all_automatic_dividers_go_and_at_the_usual_one_they_come_back() -> None:
    of = made()
    operations = suggest_dividers(of, -30.0)
    assert operations == tuple(RemoveDivider(divider.id) for divider in of.dividers)
    joined = apply_edits(of, operations).map
    assert len(joined.rooms) == 1
    back = suggest_dividers(joined, 0.0)
    assert {type(operation) for operation in back} == {AddDivider}
    assert len(apply_edits(joined, back).map.rooms) == len(of.rooms)


def test_what_people_drew_stays() -> None:
    of = made()
    drawn: Divider = replace(of.dividers[0], made_by="user")
    of = replace(of, dividers=(drawn, *of.dividers[1:]))
    assert RemoveDivider(drawn.id) not in suggest_dividers(of, -30.0)
    assert not any(isinstance(operation, AddDivider) for operation in suggest_dividers(of, 0.0))


def test_a_map_without_rooms_has_none_to_part() -> None:
    assert suggest_dividers(replace(made(), rooms=(), dividers=()), 5.0) == ()
