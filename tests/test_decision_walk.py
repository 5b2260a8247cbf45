"""Any walk of missions through a home that changes, edits, decisions and deadlines: a valid map is always in force, nobody is left waiting,
no grid is altered, ids name one thing for ever, history explains every change, and everything is told once."""

import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule, run_state_machine_as_test

from stillroom.documents.api import MapSettings
from stillroom.documents.conflicts import ConflictDocument, DecisionRequest
from stillroom.documents.operations import EditRequest
from stillroom.errors import AlreadyDecided, ChangedSince, InvalidEdit, InvalidInput, ProposalOutdated, StaleVersion
from stillroom.service import decisions
from stillroom.service.access import OPERATOR, Person, Principal
from stillroom.service.edits import edit_map, restore_version, undo_version
from stillroom.service.history import change_settings, pin_map, unpin_map
from stillroom.service.placements import place
from stillroom.store import missions, robots
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import RobotRow
from tests.homes import changed
from tests.household import MAP, ROBOT, UPSTAIRS, Household

Json = dict[str, Any]
Open = Callable[[], tuple[Database, GridStore]]
WALKS, STEPS = 10, 16
ME, ANOTHER = OPERATOR, Person("ann@example.org")
REFUSALS = (InvalidInput, ProposalOutdated)
CHANGES = (
    "none", "gap", "small gap", "open plan", "shut", "annex", "part", "sofa", "leak", "other floor",
    "gap", "small gap", "open plan", "annex",
)  # fmt: skip
HAPPENS = (
    "mission", "decision", "mission", "decision", "mission", "decision", "edit", "deadline", "setting", "all at once",
    "late mission", "failing mission", "edit meanwhile", "decision meanwhile", "two people", "deadline meanwhile",
    "restore", "undo", "placement",
)  # fmt: skip


class Walk(RuleBasedStateMachine):
    """One home and everything that can happen to it."""

    def __init__(self, opened: Open) -> None:
        super().__init__()
        self.home = Household(*opened())

    @initialize(setting=st.sampled_from(["automatic", "ask_first"]))
    def begin(self, setting: str) -> None:
        self._mission("none", tracked=False)
        self._set(setting)

    @rule(
        what=st.sampled_from(HAPPENS),
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
                self._mission(change, tracked)
            case "late mission" if len(self.home.sent) > 1:
                key = self._mission(change, tracked, late=True, most=0)
                assert self.home.mission(key).outcome == "superseded"
            case "failing mission":
                self._failing_mission(change, tracked)
            case "edit":
                self._edit(i, x, order)
                self.home.look()
            case "edit meanwhile":
                self._mission(change, tracked, lambda: self._edit(i, x, order), most=2)
            case "restore":
                restore_version(self.home.database, ME, ROBOT, MAP, 1 + i % self.home.version)
                self.home.look(brought_back=True)
            case "undo":
                with suppress(ChangedSince):
                    undo_version(self.home.database, ME, ROBOT, MAP, self.home.version - min(j, self.home.version - 1))
                self.home.look(brought_back=True)
            case "setting":
                self._set(setting)
            case "placement":
                self._place(i, UPSTAIRS if j else MAP)
            case _:
                self._question(what, change, tracked, response, i, j, x)

    def _question(self, what: str, change: str, tracked: bool, response: str, i: int, j: int, x: float) -> None:
        for provoking in (change, "open plan", "annex"):
            if not self._standing():  # most missions ask nothing
                self._mission(provoking, tracked)
        standing = self._standing()
        if not standing:
            return
        asked = standing[i % len(standing)]
        request = self._request(asked, response, j, x)
        match what:
            case "decision":
                self._decide(asked, request)
            case "decision meanwhile":
                self._mission(change, tracked, lambda: self._answer(ME, asked, request), most=2)
            case "two people":
                self._two_people(
                    asked, request, self._request(asked, "reject" if response == "accept" else "accept", j, x)
                )
            case "deadline" if asked.state == "open":
                self.home.let_time_pass(asked.id)
                assert decisions.expire(self.home.database) == 1
                self.home.look(most=0)
            case "deadline meanwhile" if asked.state == "open":
                self._at_the_deadline(asked, request)
            case "all at once" if response != "annotate":
                everything = DecisionRequest.model_validate({"response": response})
                decisions.decide_all(self.home.means, ME, ROBOT, MAP, everything)
                self.home.look(most=len(standing))

    def _standing(self) -> list[ConflictDocument]:
        return [asked for asked in self.home.conflicts() if asked.decided_by is None]

    # -- missions ---------------------------------------------------------------------------------------------------

    def _mission(
        self,
        change: str,
        tracked: bool,
        meanwhile: Callable[[], object] = lambda: None,
        late: bool = False,
        most: int = 1,
    ) -> str:
        key = self.home.upload(changed(change), tracked, late)
        self.home.process(meanwhile)
        with self.home.database.read() as tx:
            assert missions.traceback(tx, self.home.mission(key).id) is None
        self.home.look(most)
        return key

    def _failing_mission(self, change: str, tracked: bool) -> None:
        key = self.home.upload(changed(change), tracked)
        self.home.process(fails=True)
        found = self.home.mission(key)
        assert (found.status, found.outcome, found.version) == ("done", "reverted", self.home.version)
        self.home.look(most=0)

    def _place(self, i: int, floor: str) -> None:
        """Which is answered again in the same way, and not in another."""
        self._mission("other floor", tracked=False)
        with self.home.database.read() as tx:
            parked = [
                row for row in missions.page(tx, 1, "parked", None, 1000) if not missions.placements(tx, [row.id])
            ]
        if not parked:  # such a mission was taken for this floor, as a person had said
            return
        key = parked[i % len(parked)].key
        first = place(self.home.database, ME, ROBOT, MAP, key, floor)
        assert place(self.home.database, ANOTHER, ROBOT, MAP, key, floor) == first
        self.home.process()
        self.home.look(most=1 if floor == MAP else 0)

    # -- answers ----------------------------------------------------------------------------------------------------

    def _request(self, asked: ConflictDocument, response: str, j: int, x: float) -> DecisionRequest:
        body: Json = {"response": response}
        if response == "accept" and asked.proposals:
            body["proposal"] = asked.proposals[j % len(asked.proposals)].id
        if response == "annotate":
            body["dividers"] = [[[round(x, 2), -1.0], [round(x, 2), 3.0]]]
        return DecisionRequest.model_validate(body)

    def _answer(
        self, who: Principal, asked: ConflictDocument, request: DecisionRequest
    ) -> ConflictDocument | Exception:
        try:
            return decisions.decide(self.home.means, who, ROBOT, MAP, asked.id, request)
        except (*REFUSALS, AlreadyDecided) as refused:
            return refused

    def _decide(self, asked: ConflictDocument, request: DecisionRequest) -> None:
        means = self.home.means
        try:
            would_be = decisions.preview(means, ME, ROBOT, MAP, asked.id, request)
            ended = decisions.decide(means, ME, ROBOT, MAP, asked.id, request)
        except REFUSALS:
            self.home.look(most=0)  # what can't be decided changes nothing
            return
        assert decisions.decide(means, ME, ROBOT, MAP, asked.id, request) == ended
        other = DecisionRequest(response="temporary" if request.response == "reject" else "reject")
        with pytest.raises(AlreadyDecided):
            decisions.decide(means, ME, ROBOT, MAP, asked.id, other)
        in_force = self.home.map()
        assert in_force.version == ended.version == would_be.version
        assert in_force.features == would_be.features
        self.home.look()

    def _two_people(self, asked: ConflictDocument, first: DecisionRequest, second: DecisionRequest) -> None:
        with ThreadPoolExecutor(2) as pool:
            mine, theirs = (
                pool.submit(self._answer, ME, asked, first),
                pool.submit(self._answer, ANOTHER, asked, second),
            )
            answers = [mine.result(), theirs.result()]
        won = [answer for answer in answers if isinstance(answer, ConflictDocument)]
        assert len(won) <= 1
        if won:
            lost = next(answer for answer in answers if not isinstance(answer, ConflictDocument))
            assert isinstance(lost, (*REFUSALS, AlreadyDecided))
            assert won[0].decided_by in ("operator", "user:ann@example.org")
        self.home.look()

    def _at_the_deadline(self, asked: ConflictDocument, request: DecisionRequest) -> None:
        self.home.let_time_pass(asked.id)
        with ThreadPoolExecutor(2) as pool:
            expired = pool.submit(decisions.expire, self.home.database)
            answer = pool.submit(self._answer, ANOTHER, asked, request).result()
            expired.result()
        ended = next(one for one in self.home.conflicts() if one.id == asked.id)
        answered = isinstance(answer, ConflictDocument)
        assert (ended.response is not None) == answered
        assert answered or ended.state in ("expired", "superseded")
        self.home.look()

    # -- what people do otherwise -----------------------------------------------------------------------------------

    def _set(self, setting: str) -> None:
        database = self.home.database
        if setting == "pin":
            pin_map(database, ME, ROBOT, MAP, None)
        elif setting == "unpin":
            unpin_map(database, ROBOT, MAP)
        else:
            change_settings(database, ROBOT, MAP, MapSettings.model_validate({"review": setting}))
        self.home.look(most=0)

    def _edit(self, i: int, x: float, order: str) -> None:
        rooms = [f.id for f in self.home.map().features if f.id.startswith("r")]
        first, second = rooms[i % len(rooms)], rooms[(i + 1) % len(rooms)]
        orders: dict[str, Json] = {
            "split": {"op": "add_divider", "line": [[round(x, 2), -1.0], [round(x, 2), 3.0]]},
            "rename": {"op": "rename_room", "id": first, "name": f"Name {i}"},
            "merge": {"op": "merge_rooms", "ids": [first, second]},
        }
        operations = [o.as_operation() for o in EditRequest.model_validate({"operations": [orders[order]]}).operations]
        with suppress(InvalidEdit, StaleVersion):
            edit_map(self.home.database, ME, ROBOT, MAP, self.home.head(), operations, False)

    def teardown(self) -> None:
        self.home.end()


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
