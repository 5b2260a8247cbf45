"""One home with its robot, its owners and the service between them; and what must hold of it whatever happens."""

import json
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from typing import Any
from unittest import mock

import sqlalchemy as sa

from stillroom.documents.api import MapDocument
from stillroom.documents.conflicts import ConflictDocument
from stillroom.documents.grids import read_grid
from stillroom.documents.missions import stored_meta
from stillroom.documents.stored import decode_map
from stillroom.maps.constraints import violations
from stillroom.pipeline.decisions import grid_under
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.update import RESOLVERS, update_map
from stillroom.service import conflicts, decisions, uploads
from stillroom.service import maps as map_service
from stillroom.service.messages.announcing import announce
from stillroom.service.planning import Means
from stillroom.service.processing import process_next
from stillroom.store import maps, missions, receivers
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.receivers import NewReceiver
from stillroom.store.rows import MissionRow
from stillroom.store.tables import conflict as conflict_table
from stillroom.store.tables import delivery, outbox
from tests.homes import ORIGIN, RESOLUTION, Image, png

Json = dict[str, Any]
ROBOT, MAP, UPSTAIRS = "RB-1", "ground", "upstairs"


class Household:
    def __init__(self, database: Database, grids: GridStore) -> None:
        self.database, self.grids = database, grids
        self.means = Means(database, grids, RESOLVERS)
        self.sent: dict[str, bytes] = {}
        self.seen: set[str] = set()
        self.version = 0
        with database.write() as tx:
            now = datetime.now(UTC)
            receivers.add(tx, NewReceiver("webhook", "operator", "https://hooks.example.org/", now, keys={}), now)
            receivers.add(tx, NewReceiver("email", "operator", "operator@example.org", now), now)

    # -- what the robot does ----------------------------------------------------------------------------------------

    def upload(self, image: Image, tracked: bool, late: bool = False) -> str:
        """The key of the mission, which waits to be processed."""
        key = str(len(self.sent))
        meta: Json = {"sequence": 0 if late else len(self.sent), "resolution": RESOLUTION, "origin": ORIGIN}
        if tracked:
            meta |= {"base_version": self.version, "tracking": {"transform": [0.0, 0.0, 0.0]}}
        self.sent[key] = png(image)
        for _ in range(2):  # its first answer was lost
            content = "image/png", self.sent[key]
            uploads.receive(self.database, self.grids, ROBOT, MAP, key, content, json.dumps(meta).encode())
        return key

    def process(self, meanwhile: Callable[[], object] = lambda: None, fails: bool = False) -> None:
        """All that waits; `meanwhile` happens while the first of it is in the core."""
        once = [meanwhile]

        def core(*asked: Any, **rest: Any) -> Any:
            if fails:
                raise RuntimeError("the core fails")
            made = update_map(*asked, **rest)
            if once:
                once.pop()()
            return made

        with mock.patch("stillroom.service.gathering.update_map", core):
            while process_next(self.database, self.grids) is not None:
                pass

    def mission(self, key: str) -> MissionRow:
        with self.database.read() as tx:
            row = missions.by_key(tx, 1, key)
        assert row is not None
        return row

    # -- what can be seen -------------------------------------------------------------------------------------------

    def head(self) -> int:
        return map_service.version_in_force(self.database, ROBOT, MAP)[1]

    def map(self, number: int | None = None) -> MapDocument:
        return MapDocument.model_validate(map_service.show_map(self.database, ROBOT, MAP, number))

    def conflicts(self, map_name: str = MAP) -> list[ConflictDocument]:
        return conflicts.list_conflicts(self.database, ROBOT, map_name, None, None, 1000).items

    def let_time_pass(self, key: str | None = None) -> None:
        """One question, or all, are overdue."""
        which = sa.true() if key is None else conflict_table.c.key == key
        past = datetime.now(UTC) - timedelta(seconds=1)
        with self.database.write() as tx:
            tx.execute(sa.update(conflict_table).where(which, conflict_table.c.waits).values(due_at=past))

    # -- what must hold ---------------------------------------------------------------------------------------------

    def look(self, most: int = 1, brought_back: bool = False) -> None:
        """At all that is new; at most so many versions may have been made since the last look.

        `brought_back`: what had gone may live again, under the name that it had.
        """
        head = self.head()
        assert self.version <= head <= self.version + most
        for number in range(self.version + 1, head + 1):
            self._check_ids(number, brought_back)
            self._check_valid(number)
        self.version = head
        rooms = (known for known in self.seen if known.startswith("r") and not known.endswith("-2"))
        for room in rooms:
            map_service.find_room(self.database, ROBOT, MAP, room)
        for key, content in self.sent.items():
            digest = sha256(content).hexdigest()
            assert self.mission(key).grid == digest
            assert self.grids.get(digest) == content, "no grid is altered"
        for asked in self.conflicts():
            assert (asked.decided_by is None) == (asked.decided_at is None)
            assert (asked.decided_by is None) == (asked.state in ("open", "resolved_automatically"))
            assert asked.state != "open" or asked.default is not None, (
                "whoever asks says what happens without an answer"
            )

    def _check_ids(self, number: int, brought_back: bool) -> None:
        document = self.map(number)
        ids = {f.id for f in document.features if f.properties.semantic not in ("wall", "clutter")}
        before = {f.id for f in self.map(document.parent).features} if document.parent else set()
        if brought_back:
            assert document.cause in ("restore", "edit")
            assert ids <= self.seen, "nothing is new"
        else:
            assert not (ids - before) & self.seen, "an id is never given out twice"
        self.seen |= ids

    def _check_valid(self, number: int) -> None:
        with self.database.read() as tx:
            row = maps.version_at(tx, 1, number)
            assert row is not None
            assert row.mission is not None
            mission = missions.by_key(tx, 1, row.mission)
        assert mission is not None
        m = decode_map(row.document)
        grid = read_grid(self.grids.get(row.grid), stored_meta(mission.meta).reading()).covering(m.vertices())
        assert violations(m, grid_under(m, grid), PARAMS.wall_reach_m) == ()

    def check_history(self) -> None:
        """Every version says what made it, and that says so too."""
        decided = {asked.version for asked in self.conflicts() if asked.response is not None}
        with self.database.read() as tx:
            rows = maps.versions_after(tx, 1, 0, 1000)
            placed = {row.version for row in missions.page(tx, 1, None, None, 1000) if row.placed_from is not None}
        assert [row.number for row in rows] == list(range(1, self.version + 1))
        for row in rows:
            assert row.parent == (row.number - 1 or None)
            assert row.mission is not None
            match row.cause:
                case "created" | "mission":
                    made = self.mission(row.mission)
                    assert (made.version, row.made_by) == (row.number, f"robot:{ROBOT}")
                    assert made.outcome in ("created", "updated", "resolved", "needs_review")
                case "decision":
                    assert row.number in decided | placed
                    assert row.made_by in ("operator", "user:ann@example.org")
                case _:
                    assert (row.cause, row.made_by) in {("edit", "operator"), ("restore", "operator")}

    def check_told(self) -> None:
        """Programs hear of every change once, people of every question that is not quiet; and nothing is left to tell."""
        while announce(self.database, "https://maps.example.org"):
            pass
        with self.database.read() as tx:
            assert tx.execute(sa.select(sa.func.count()).select_from(outbox)).scalar_one() == 0
            sent = tx.execute(sa.select(delivery.c.kind, delivery.c.content)).all()
        programs = [(row.kind, row.content["data"]) for row in sent if "data" in row.content]
        people = [row.content["conflict"] for row in sent if "data" not in row.content]
        updated = sorted(data["version"] for kind, data in programs if kind == "map.updated" and data["map"] == MAP)
        assert updated == list(range(1, self.version + 1))
        everything = [asked for name in self._maps() for asked in self.conflicts(name)]
        closed = sorted(data["conflict"] for kind, data in programs if kind == "conflict.closed")
        assert closed == sorted(asked.id for asked in everything if asked.decided_by is not None)
        opened = sorted(data["conflict"] for kind, data in programs if kind in OPENED)
        assert opened == sorted(asked.id for asked in everything)
        asked_by_message = {data["conflict"] for kind, data in programs if kind in OPENED[:2] and not data["quiet"]}
        assert sorted(people) == sorted(asked_by_message), "one message a question"

    def _maps(self) -> list[str]:
        with self.database.read() as tx:
            return [of.name for of in maps.of_robots(tx, [ROBOT])]

    def end(self) -> None:
        """Whatever is still open ends, and the map stays as it is."""
        self.let_time_pass()
        while decisions.expire(self.database):
            pass
        if self.version:
            assert not [asked for name in self._maps() for asked in self.conflicts(name) if asked.state == "open"]
            self.look(most=0)
            self.check_history()
            self.check_told()
        self.database.dispose()


OPENED = ("conflict.opened", "room.discovered", "conflict.resolved")
