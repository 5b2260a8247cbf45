"""Any walk of missions through a home that changes, edits, decisions and deadlines: a valid map is always in force, nobody is left waiting,
no grid is altered, ids name one thing for ever, and history explains every change."""

import json
import shutil
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule, run_state_machine_as_test

from stillroom.documents.api import MapSettings
from stillroom.documents.conflicts import ConflictDocument, DecisionRequest
from stillroom.documents.grids import read_grid
from stillroom.documents.missions import stored_meta
from stillroom.documents.operations import EditRequest
from stillroom.documents.stored import decode_map
from stillroom.errors import AlreadyDecided, InvalidEdit, InvalidInput, ProposalOutdated
from stillroom.maps.constraints import violations
from stillroom.pipeline.decisions import grid_under
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import RESOLVERS
from stillroom.service import conflicts, decisions, uploads
from stillroom.service import maps as map_service
from stillroom.service.accounts import Operator
from stillroom.service.edits import edit_map
from stillroom.service.history import change_settings, pin_map, unpin_map
from stillroom.service.planning import Means
from stillroom.service.processing import process_next
from stillroom.store import maps, missions, robots
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import RobotRow
from stillroom.store.tables import conflict as conflict_table
from tests.homes import ORIGIN, RESOLUTION, changed, png

Json = dict[str, Any]
Open = Callable[[], tuple[Database, GridStore]]
WALKS, STEPS = 12, 20
ROBOT, MAP = "RB-1", "ground"


CHANGES = (
    "none", "gap", "small gap", "open plan", "shut", "annex", "part", "sofa", "leak", "other floor",
    "gap", "small gap", "open plan", "annex",
)  # fmt: skip


class Walk(RuleBasedStateMachine):
    """One home and everything that can happen to it."""

    def __init__(self, opened: Open) -> None:
        super().__init__()
        self.database, self.grids = opened()
        self.means = Means(self.database, self.grids, RESOLVERS)
        self.sent: dict[str, bytes] = {}
        self.seen: set[str] = set()
        self.rooms: set[str] = set()
        self.version = 0

    @initialize()
    def begin(self) -> None:
        self._upload("none", tracked=False)
        self._look()

    @rule(
        what=st.sampled_from(["mission", "decision", "mission", "decision", "edit", "deadline", "setting"]),
        change=st.sampled_from(CHANGES),
        tracked=st.sampled_from([True, True, True, False]),
        response=st.sampled_from(["accept", "accept", "reject", "annotate", "temporary"]),
        order=st.sampled_from(["split", "rename", "merge"]),
        setting=st.sampled_from(["automatic", "ask_first", "pin", "unpin"]),
        i=st.integers(0, 9),
        j=st.integers(0, 2),
        x=st.sampled_from([0.9, 2.1, 4.0, 5.6, 7.3]),
    )  # one rule: of several, a walk takes only some
    def step(
        self, what: str, change: str, tracked: bool, response: str, order: str, setting: str, i: int, j: int, x: float
    ) -> None:
        match what:
            case "mission":
                self._upload(change, tracked)
                self._look()
            case "decision":
                self._answer(i, j, response, x)
            case "edit":
                self._edit(i, x, order)
            case "deadline":
                self._let_time_pass(i)
            case "setting":
                self._set(setting)

    def _answer(self, i: int, j: int, response: str, x: float) -> None:
        standing = [c for c in self._conflicts() if c.decided_by is None]
        if not standing:
            return
        asked = standing[i % len(standing)]
        body: Json = {"response": response}
        if response == "accept" and asked.proposals:
            body["proposal"] = asked.proposals[j % len(asked.proposals)].id
        if response == "annotate":
            body["dividers"] = [[[round(x, 2), -1.0], [round(x, 2), 3.0]]]
        self._decide(asked, DecisionRequest.model_validate(body))
        self._look()

    def _decide(self, asked: ConflictDocument, request: DecisionRequest) -> None:
        who = Operator()
        try:
            would_be = decisions.preview(self.means, who, ROBOT, MAP, asked.id, request)
            ended = decisions.decide(self.means, who, ROBOT, MAP, asked.id, request)
        except (InvalidInput, ProposalOutdated):
            assert self._head() == self.version, "what can't be decided changes nothing"
            return
        assert decisions.decide(self.means, who, ROBOT, MAP, asked.id, request) == ended
        other = DecisionRequest(response="temporary" if request.response == "reject" else "reject")
        with pytest.raises(AlreadyDecided):
            decisions.decide(self.means, who, ROBOT, MAP, asked.id, other)
        in_force = map_service.map_document(self.database, ROBOT, MAP)
        assert in_force.version == ended.version == would_be.version
        assert in_force.features == would_be.features

    def _let_time_pass(self, of: int) -> None:
        waiting = [c for c in self._conflicts() if c.state == "open"]
        if waiting:
            overdue = waiting[of % len(waiting)].id
            with self.database.write() as tx:
                past = datetime.now(UTC) - timedelta(seconds=1)
                tx.execute(sa.update(conflict_table).where(conflict_table.c.key == overdue).values(due_at=past))
            assert decisions.expire(self.database) == 1
            self._look(same=True)

    def _set(self, setting: str) -> None:
        if setting == "pin":
            pin_map(self.database, Operator(), ROBOT, MAP, None)
        elif setting == "unpin":
            unpin_map(self.database, ROBOT, MAP)
        else:
            change_settings(self.database, ROBOT, MAP, MapSettings.model_validate({"review": setting}))
        self._look(same=True)

    def _edit(self, i: int, x: float, order: str) -> None:
        rooms = [f.id for f in map_service.map_document(self.database, ROBOT, MAP).features if f.id.startswith("r")]
        first, second = rooms[i % len(rooms)], rooms[(i + 1) % len(rooms)]
        orders: dict[str, Json] = {
            "split": {"op": "add_divider", "line": [[round(x, 2), -1.0], [round(x, 2), 3.0]]},
            "rename": {"op": "rename_room", "id": first, "name": f"Name {i}"},
            "merge": {"op": "merge_rooms", "ids": [first, second]},
        }
        operations = [o.as_operation() for o in EditRequest.model_validate({"operations": [orders[order]]}).operations]
        with suppress(InvalidEdit):
            edit_map(self.database, Operator(), ROBOT, MAP, self.version, operations, False)
        self._look()

    def teardown(self) -> None:
        """Whatever is still open ends, and the map stays as it is."""
        with self.database.write() as tx:
            tx.execute(sa.update(conflict_table).values(due_at=datetime.now(UTC) - timedelta(seconds=1)))
        while decisions.expire(self.database):
            pass
        if self.version:
            assert not [c for c in self._conflicts() if c.state == "open"]
            self._look(same=True)
        self.database.dispose()

    def _upload(self, change: str, tracked: bool) -> None:
        key = str(len(self.sent))
        meta: Json = {"sequence": len(self.sent), "resolution": RESOLUTION, "origin": ORIGIN}
        if tracked:
            meta |= {"base_version": self.version, "tracking": {"transform": [0.0, 0.0, 0.0]}}
        self.sent[key] = png(changed(change))
        content = "image/png", self.sent[key]
        uploads.receive(self.database, self.grids, ROBOT, MAP, key, content, json.dumps(meta).encode())
        while process_next(self.database, self.grids) is not None:
            pass
        with self.database.read() as tx:
            row = missions.by_key(tx, 1, key)
            assert row is not None
            assert missions.traceback(tx, row.id) is None

    def _look(self, same: bool = False) -> None:
        """Checks what is in force now. `same`: nothing may have changed."""
        head = self._head()
        assert head == self.version or (not same and head == self.version + 1)
        fresh, self.version = head != self.version, head
        document = map_service.map_document(self.database, ROBOT, MAP)
        ids = {f.id for f in document.features if f.properties.semantic not in ("wall", "clutter")}
        if fresh and document.parent is not None:
            before = map_service.map_document(self.database, ROBOT, MAP, document.parent)
            assert not (ids - {f.id for f in before.features}) & self.seen, "an id is never given out twice"
        self.seen |= ids
        self.rooms |= {i for i in ids if i.startswith("r")}
        for room in self.rooms:
            map_service.find_room(self.database, ROBOT, MAP, room)
        self._check_valid()
        self._check_history(document.cause, head)
        for key, content in self.sent.items():
            assert sha256(self.grids.get(sha256(content).hexdigest())).digest() == sha256(content).digest(), key

    def _check_valid(self) -> None:
        with self.database.read() as tx:
            row = maps.version_at(tx, 1, self.version)
            assert row is not None
            assert row.mission is not None
            mission = missions.by_key(tx, 1, row.mission)
        assert mission is not None
        m = decode_map(row.document)
        grid = read_grid(self.grids.get(row.grid), stored_meta(mission.meta).reading()).covering(m.vertices())
        assert violations(m, grid_under(m, grid), PARAMS.wall_reach_m) == ()

    def _check_history(self, cause: str, version: int) -> None:
        ended = [c for c in self._conflicts() if c.decided_by is not None]
        assert all(c.decided_at is not None and c.state not in ("open", "resolved_automatically") for c in ended)
        if cause == "decision":
            assert any(
                c.version == version and c.response in ("accept", "reject", "annotate", "temporary") for c in ended
            )

    def _head(self) -> int:
        return map_service.version_in_force(self.database, ROBOT, MAP)[1]

    def _conflicts(self) -> list[ConflictDocument]:
        return conflicts.list_conflicts(self.database, ROBOT, MAP, None, None, 1000).items


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


def test_whatever_is_decided_about_a_home(opened: Open) -> None:
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
