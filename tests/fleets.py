"""Fleets whose missions are written into the database as if they had been processed, and the slow, plain way to their figures."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta
from itertools import count
from typing import Any

import sqlalchemy as sa

from stillroom.service.fleet.counting import catch_up
from stillroom.store import conflicts, missions, robots, rollouts, seeding
from stillroom.store import maps as map_store
from stillroom.store.changes import apply
from stillroom.store.conflicts import NewConflict, NewSighting
from stillroom.store.database import Database
from stillroom.store.fleet_tables import rolled, rollout, uncounted
from stillroom.store.missions import Finding, NewMission
from stillroom.store.rollouts import Beside
from stillroom.store.rows import RobotRow
from stillroom.store.tables import version

START = datetime(2026, 11, 1, 12, tzinfo=UTC)
TODAY = date(2026, 11, 20)


@dataclass(frozen=True)
class Done:
    """A mission as it was processed."""

    robot: str = "RB-1"
    day: int = 0
    outcome: str = "updated"
    failed: int | None = 0
    """Rows of the results table, the first ones; None: nothing was tried."""
    firmware: str | None = "5.1"
    model: str | None = "S9"
    algorithm: str = "1.0"
    rooms: int | None = 5
    """None: the first of its map."""
    placed: bool = False
    met: tuple[str, str] | None = None
    """Kind and cause of the conflict that it met."""
    traceback: str | None = None

    @property
    def counts(self) -> bool:
        return self.rooms is not None and not self.placed and self.outcome not in ("created", "superseded")

    @property
    def at(self) -> datetime:
        return START + timedelta(days=self.day)


@dataclass
class Fleet:
    """`said_s`: by how much robots' clocks are wrong."""

    database: Database
    done: list[Done] = field(default_factory=list)
    ids: list[int] = field(default_factory=list)
    _keys: Callable[[], int] = field(default_factory=lambda: count(1).__next__)
    _maps: dict[tuple[str, int], int] = field(default_factory=dict)

    def add(self, *some: Done) -> None:
        with self.database.write() as tx:
            for one in some:
                of = self._map(tx, one)
                key = self._keys()
                meta = {"firmware": one.firmware, "model": one.model, "ended_at": "1999-01-01T00:00:00Z"}
                said = {name: value for name, value in meta.items() if value is not None}
                parked = self.ids[0] if one.placed and self.ids else None
                outcome = one if not one.placed or parked is not None else Done(**vars(one) | {"placed": False})
                new = NewMission(
                    of, str(key), 0, key, "0" * 64, said, "1" * 64, parked, None if parked is None else "operator"
                )
                made = missions.add(tx, new, one.at)
                ablation = None if one.failed is None else (one.failed < 1, one.failed < 2, one.failed < 3)
                base = None if one.rooms is None else 1
                found = Finding(one.outcome, "", base, base, one.algorithm, None, ablation, {}, one.traceback)
                apply(tx, *missions.finished(tx, made, found, one.at))
                if one.met is not None:
                    kind, cause = one.met
                    resolved = one.outcome in ("updated", "resolved")
                    opened = conflicts.add(
                        tx, NewConflict(of, f"c{key}", kind, "2" * 64, resolved, one.at, None, False)
                    )
                    assert opened is not None
                    conflicts.add_sighting(tx, NewSighting(opened, made, cause, "", [], [], [], 1, None), [])
                self.done.append(outcome)
                self.ids.append(made)

    def _map(self, tx: sa.Connection, one: Done) -> int:
        """Homes of a robot are told apart by how many rooms they have."""
        rooms = one.rooms or 0
        if (one.robot, rooms) not in self._maps:
            robots.add(tx, RobotRow(one.robot, one.robot, None, START), f"{one.robot}", "")
            of = map_store.get_or_add(tx, one.robot, f"floor{rooms}").id
            row = {"map_id": of, "number": 1, "cause": "created", "made_by": "", "created_at": START, "algorithm": "1"}
            tx.execute(sa.insert(version).values(**row, grid="", rooms=rooms, document={}))
            self._maps[one.robot, rooms] = of
        return self._maps[one.robot, rooms]


def size_of(one: Done) -> str:
    assert one.rooms is not None
    return "1-3" if one.rooms <= 3 else "4-6" if one.rooms <= 6 else "7-9" if one.rooms <= 9 else "10+"


def plainly(done: Iterable[Done], key: Callable[[Done], str]) -> dict[str, dict[str, int]]:
    """What rates are made of, counted one by one."""
    found: dict[str, dict[str, int]] = {}
    groups: dict[str, list[Done]] = {}
    for one in done:
        if one.counts:
            groups.setdefault(key(one), []).append(one)
    for name, some in groups.items():
        judged = [one for one in some if one.outcome != "parked"]
        failed = [3 if one.failed is None else one.failed for one in judged]
        found[name] = {
            "missions": len(judged),
            "robots": len({one.robot for one in some}),
            "transfer": sum(n >= 1 for n in failed),
            "meta_occupancy": sum(n >= 2 for n in failed),
            "meta_dividers": sum(n >= 3 for n in failed),
            **{
                outcome: sum(one.outcome == outcome for one in some)
                for outcome in ("reverted", "needs_review", "parked")
            },
        }
    return found


def counts_of(rows: Sequence[object]) -> dict[str, dict[str, int]]:
    """The same of rows that the API answers with."""
    names = ("missions", "robots", "reverted", "needs_review", "parked")
    found = {}
    for row in rows:
        document = row if isinstance(row, dict) else row.model_dump()  # type: ignore[attr-defined]
        found[document["key"]] = {name: document[name] for name in names} | document["failed"]
    return found


def put_at(database: Database, stage: int) -> None:
    """The rollout that is running, at so many per cent of homes."""
    with database.write() as tx:
        tx.execute(sa.update(rollout).where(rollout.c.state == "running").values(stage=stage))


class Arms:
    """Missions of the rollout that is running as if they had been processed, each in a home of its own."""

    def __init__(self, database: Database) -> None:
        self.database, self._homes = database, 0

    def add(
        self,
        stage: int,
        candidate: bool,
        missions: int,
        failed: int,
        homes: int | None = None,
        beside_failed: int | None = None,
    ) -> None:
        """The first of each home fail. `homes`: so many in turn, and not one each."""
        put_at(self.database, stage)
        names = [f"home-{self._homes + n}" for n in range(homes or missions)]
        self._homes += len(names)
        with self.database.write(durable=False) as tx:
            maps = seeding.add_robots(tx, [(name, name) for name in names], START)
            rows = [self._row(maps[n % len(maps)], n, n % len(maps) < failed) for n in range(missions)]
            made = seeding.add_missions(tx, rows)
            tx.execute(sa.insert(uncounted), [{"mission_id": number} for number in made])
            running = rollouts.running(tx)
            assert running is not None
            same = {"rollout_id": running.id, "stage": stage, "candidate": candidate}
            tx.execute(sa.insert(rolled), [same | {"mission_id": number} for number in made])
            for n, number in enumerate(made if beside_failed is not None else []):
                ok = n >= (beside_failed or 0)
                rollouts.keep(tx, running.id, number, Beside("updated" if ok else "reverted", ok, ok, ok, 1.0))
        while catch_up(self.database):
            pass

    def _row(self, map_id: int, number: int, fails: bool) -> dict[str, Any]:
        rows = {f"ablation_{row}": not fails for row in ("transfer", "meta_occupancy", "meta_dividers")}
        outcome = "needs_review" if fails else "updated"
        same = {"map_id": map_id, "key": str(number), "sequence": number, "meta": {}, "algorithm": "1"}
        return same | {"received_at": START, "finished_at": START, "outcome": outcome} | rows
