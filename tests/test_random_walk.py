"""Any walk of edits, missions, restored versions and undone edits: ids name one thing for ever, names stay, every rule holds."""

import json
import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule, run_state_machine_as_test

from stillroom.documents.grids import read_grid
from stillroom.documents.missions import stored_meta
from stillroom.documents.operations import EditRequest
from stillroom.documents.stored import decode_map
from stillroom.errors import ChangedSince, InvalidEdit
from stillroom.maps.constraints import violations
from stillroom.pipeline.params import PARAMS
from stillroom.service import maps as map_service
from stillroom.service import uploads
from stillroom.service.access import OPERATOR
from stillroom.service.edits import edit_map, restore_version, undo_version
from stillroom.service.processing import process_next
from stillroom.store import maps, missions, robots
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import RobotRow
from tests.homes import ORIGIN, RESOLUTION, home, png

Json = dict[str, Any]
Open = Callable[[], tuple[Database, GridStore]]
WALKS, STEPS = 8, 12
ROBOT, MAP = "RB-1", "ground"
places = st.tuples(st.floats(0.1, 8.0).map(lambda x: round(x, 2)), st.floats(-0.9, 2.9).map(lambda y: round(y, 2)))


class Walk(RuleBasedStateMachine):
    """One home and everything that can happen to it."""

    def __init__(self, opened: Open) -> None:
        super().__init__()
        self.database, self.grids = opened()
        self.missions = 0
        self.seen: set[str] = set()
        self.before: Json = {}

    @initialize()
    def begin(self) -> None:
        self._upload((0, 0))
        self._look(fresh=True)

    @rule(i=st.integers(0, 9), j=st.integers(0, 9), at=places, to=places, order=st.sampled_from(
        ["split", "divide", "move", "remove", "door", "rename", "merge", "kind", "pin", "zone", "phantom"]
    ))  # fmt: skip
    def edit(self, i: int, j: int, at: tuple[float, float], to: tuple[float, float], order: str) -> None:
        rooms, dividers = self._of("room"), self._of("divider")
        first, second = rooms[i % len(rooms)]["id"], rooms[j % len(rooms)]["id"]
        divider = dividers[i % len(dividers)]["id"] if dividers else "d0"
        (x, y), (u, v) = at, to
        square = [[x, y], [x + 0.5, y], [x + 0.5, y + 0.5], [x, y + 0.5]]
        operation: Json = {
            "split": {"op": "add_divider", "line": [[x, -1.0], [x, 3.0]]},
            "divide": {"op": "add_divider", "line": [[x, y], [u, v]]},
            "move": {"op": "move_divider", "id": divider, "line": [[u, -1.0], [u, 3.0]]},
            "remove": {"op": "remove_divider", "id": divider},
            "door": {"op": "set_divider_kind", "id": divider, "kind": "door"},
            "rename": {"op": "rename_room", "id": first, "name": f"Name {x}"},
            "merge": {"op": "merge_rooms", "ids": [first, second]},
            "kind": {"op": "set_room_kind", "id": first, "kind": "hall"},
            "pin": {"op": "pin_room", "id": first, "pinned": j % 2 == 0},
            "zone": {"op": "add_restriction", "kind": "no_go", "shape": square},
            "phantom": {"op": "mark_phantom", "shape": square},
        }[order]
        operations = [o.as_operation() for o in EditRequest.model_validate({"operations": [operation]}).operations]
        try:
            edit_map(self.database, OPERATOR, ROBOT, MAP, self.before["version"], operations, False)
        except InvalidEdit:
            assert self._map()["version"] == self.before["version"], "a refused edit changes nothing"
            return
        renamed = {first: f"Name {x}"} if order == "rename" else {}
        self._look(fresh=True, renamed=renamed)

    @rule(shift=st.tuples(st.integers(-3, 3), st.integers(-3, 3)))
    def mission(self, shift: tuple[int, int]) -> None:
        self._upload(shift)
        self._look(fresh=True)

    @rule(back=st.integers(1, 6))
    def restore(self, back: int) -> None:
        version = max(1, self.before["version"] - back)
        restore_version(self.database, OPERATOR, ROBOT, MAP, version)
        self._look(fresh=False)
        assert self._features(self.before) == self._features(self._map(version))

    @rule(back=st.integers(0, 4))
    def undo(self, back: int) -> None:
        version = max(1, self.before["version"] - back)
        try:
            undo_version(self.database, OPERATOR, ROBOT, MAP, version)
        except ChangedSince:
            return
        self._look(fresh=False)

    def _upload(self, shift: tuple[int, int]) -> None:
        key = str(self.missions)
        dx, dy = (step * RESOLUTION for step in shift)
        origin = [ORIGIN[0] + dx, ORIGIN[1] + dy, 0.0]
        meta: Json = {"sequence": self.missions, "resolution": RESOLUTION, "origin": origin}
        if self.missions:
            # The whole home was drawn `shift` farther on since the version in force: there the robot left from.
            meta |= {"base_version": self.before["version"], "tracking": {"transform": self._step(origin)}}
        content = png(home())
        uploads.receive(self.database, self.grids, ROBOT, MAP, key, ("image/png", content), json.dumps(meta).encode())
        self.missions += 1
        while process_next(self.database, self.grids) is not None:
            pass

    def _step(self, origin: list[float]) -> list[float]:
        x, y, _ = self.before["frame"]["origin"]
        return [origin[0] - x, origin[1] - y, 0.0]

    def _look(self, fresh: bool, renamed: Json | None = None) -> None:
        """Checks the version in force against the one before. `fresh`: what is new in it was never there."""
        before, after = self.before, self._map()
        self.before = after
        ids = {f["id"] for f in after["features"] if f["properties"]["semantic"] not in ("wall", "clutter")}
        earlier = {f["id"] for f in before.get("features", [])}
        if fresh:
            assert not (ids - earlier) & self.seen, "an id that was given out is never given out again"
        self.seen |= ids
        with self.database.read() as tx:
            of = maps.by_name(tx, ROBOT, MAP)
            assert of is not None
            row = maps.version_at(tx, of.id, after["version"])
            assert row is not None
            assert row.mission is not None
            mission = missions.by_key(tx, of.id, row.mission)
        assert mission is not None
        grid = read_grid(self.grids.get(row.grid), stored_meta(mission.meta).reading())
        stored = decode_map(row.document)
        corners = stored.vertices()
        assert violations(stored, grid.covering(corners), PARAMS.wall_reach_m) == ()
        if fresh:
            self._names(before, after, renamed or {})
        for room in before.get("features", []):
            if room["properties"]["semantic"] == "room":
                map_service.find_room(self.database, ROBOT, MAP, room["id"])

    def _names(self, before: Json, after: Json, renamed: Json) -> None:
        old = {f["id"]: f["properties"]["name"] for f in self._of("room", before)}
        new = {f["id"]: f["properties"]["name"] for f in self._of("room", after)}
        for room in old.keys() & new.keys():
            is_merged = old.keys() - new.keys()
            if old[room].startswith("Name"):
                assert new[room] == renamed.get(room, old[room]), "a name that a person gave stays"
            elif not is_merged:
                assert new[room] == renamed.get(room, old[room])

    def _map(self, version: int | None = None) -> Json:
        return map_service.show_map(self.database, ROBOT, MAP, version)

    def _of(self, semantic: str, document: Json | None = None) -> list[Json]:
        features = (self.before if document is None else document).get("features", [])
        return [f for f in features if f["properties"]["semantic"] == semantic]

    @staticmethod
    def _features(document: Json) -> list[Json]:
        features: list[Json] = document["features"]
        return features

    def teardown(self) -> None:
        self.database.dispose()


@pytest.fixture
def opened(migrated: Path, tmp_path: Path) -> Open:
    counter = iter(range(10_000))

    def open_another() -> tuple[Database, GridStore]:
        folder = tmp_path / str(next(counter))
        folder.mkdir()
        shutil.copy(migrated, folder / "stillroom.sqlite")
        database = Database(f"sqlite:///{folder / 'stillroom.sqlite'}")
        with database.write() as tx:
            robots.add(tx, RobotRow(ROBOT, ROBOT, None, datetime.now(UTC)), "t", "c")
        return database, GridStore(str(folder / "grids"))

    return open_another


def test_whatever_happens_to_a_home(opened: Open) -> None:
    class WalkThroughOne(Walk):
        def __init__(self) -> None:
            super().__init__(opened)

    run_state_machine_as_test(
        WalkThroughOne,
        settings=settings(
            max_examples=WALKS,
            stateful_step_count=STEPS,
            deadline=None,
            phases=[Phase.explicit, Phase.reuse, Phase.generate],
            suppress_health_check=list(HealthCheck),
        ),
    )
