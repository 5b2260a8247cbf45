"""Any sequence of edits keeps every constraint, the area and the ids."""

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from stillroom.errors import InvalidEdit
from stillroom.maps.constraints import violations
from stillroom.maps.geometry import Line
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.creation import create_map
from stillroom.pipeline.edits import (
    AddDivider,
    MergeRooms,
    MoveDivider,
    Operation,
    RemoveDivider,
    RenameRoom,
    SetDividerKind,
    apply_edits,
)
from stillroom.pipeline.params import PARAMS
from tests.golden.homes import FOUR_ROOMS

inside = st.tuples(st.floats(0, 8.4), st.floats(0, 4.6))
lines = st.tuples(inside, inside) | st.floats(0.3, 8).map(lambda x: ((x, 0.3), (x, 4.3)))
orders = st.tuples(
    st.sampled_from(["add", "move", "remove", "kind", "rename", "merge"]), lines, st.integers(0, 9), st.integers(0, 9)
)


def operation(order: str, line: Line, i: int, j: int, semantic_map: SemanticMap) -> Operation:
    """An order as an operation on the rooms and dividers that the map has now."""
    rooms, dividers = semantic_map.rooms, semantic_map.dividers
    first, second = rooms[i % len(rooms)].id, rooms[j % len(rooms)].id
    divider = dividers[i % len(dividers)].id if dividers else "none"
    operations: dict[str, Operation] = {
        "add": AddDivider(line),
        "move": MoveDivider(divider, line),
        "remove": RemoveDivider(divider),
        "kind": SetDividerKind(divider, "door"),
        "rename": RenameRoom(first, f"Name {j}"),
        "merge": MergeRooms((first, second)),
    }
    return operations[order]


@settings(max_examples=60)
@given(st.lists(st.lists(orders, min_size=1, max_size=3), min_size=1, max_size=8))
def test_any_edits_keep_every_constraint_the_area_and_never_reuse_an_id(
    batches: list[list[tuple[str, Line, int, int]]],
) -> None:
    edited = create_map(FOUR_ROOMS.grid, "1", Ids())
    floor = shapely.union_all([room.polygon for room in edited.rooms])
    gone: set[str] = set()
    for batch in batches:
        before = edited
        try:
            result = apply_edits(before, [operation(*order, before) for order in batch])
        except InvalidEdit:
            continue
        edited = result.map
        assert violations(edited, FOUR_ROOMS.grid, PARAMS.wall_reach_m) == ()
        assert sum(room.polygon.area for room in edited.rooms) == pytest.approx(floor.area, abs=0.02)
        old, new = ids_of(before), ids_of(edited)
        assert not new & gone
        gone |= old - new
        assert set(result.retired) == {room.id for room in before.rooms} - {room.id for room in edited.rooms}
        assert set(result.retired.values()) <= {room.id for room in edited.rooms}
        touched = {order_.id for order_ in (operation(*o, before) for o in batch) if isinstance(order_, MoveDivider)}
        if not any(o[0] == "merge" for o in batch):
            for divider in before.dividers:
                after = edited.divider(divider.id)
                assert after is None or divider.id in touched or after.line == divider.line


def ids_of(semantic_map: SemanticMap) -> set[str]:
    return {room.id for room in semantic_map.rooms} | {divider.id for divider in semantic_map.dividers}
