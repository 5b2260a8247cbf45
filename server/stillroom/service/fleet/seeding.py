"""A fleet that is made up: missions of a year as if they had been processed, to measure and to try out dashboards with.

Robots differ in how often they fail and how often they run; firmware, models and algorithm versions come and go as in a fleet;
on one day of the last weeks a new firmware makes doors a problem.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from hashlib import sha256
from typing import Any

import numpy as np
import numpy.typing as npt

from stillroom.errors import AlreadyExists
from stillroom.service.fleet.counting import count_missions
from stillroom.store import fleet, seeding
from stillroom.store.database import Database
from stillroom.store.fleet import Met, Processed

FIRMWARE = ("4.9", "5.0", "5.1", "5.2")
ALGORITHMS = ("0.8.0", "0.9.0", "1.0.0")
MODELS = ("S7", "S9", "J7", "J9", "M6")
ROOMS = (2, 3, 4, 5, 6, 7, 8, 9, 12)
CAUSES = (
    ("room_recall", "door_closed"),
    ("room_recall", "moved_object"),
    ("room_precision", "wall_gap"),
    ("room_lost", "opening_closed"),
    ("connectivity", "new_passage"),
    ("divider_lost", "unknown"),
    ("shape", "unknown"),
)
_SHARES = (0.28, 0.24, 0.2, 0.08, 0.08, 0.07, 0.05)
SPIKE_DAYS_AGO = 6
"""When the newest firmware began to report doors as shut."""
STAYS = (0.62, 0.72, 0.8)
"""Of missions that failed with transfer, then with meta-occupancy: the share that fails with more as well, by algorithm."""
FAILS = 0.13
"""Of missions, with transfer alone."""
ESCAPES = 0.004


@dataclass(frozen=True)
class Seed:
    missions: int
    robots: int
    days: int
    seed: int
    until: date


Numbers = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Robots:
    ids: Sequence[str]
    maps: Sequence[int]
    rooms: Numbers
    models: Numbers
    frailty: Floats
    """How often each fails, compared with the others."""
    eagerness: Floats
    """How often each runs; they sum to 1."""
    patience: Floats
    """When each gets new firmware, from 0 (at once) to 1."""


def seed_fleet(database: Database, what: Seed, tell: Callable[[str], None]) -> None:
    """Raises AlreadyExists where the database has missions: what is made up must not mix with what is not."""
    with database.read() as tx:
        if seeding.has_missions(tx):
            raise AlreadyExists("The database has missions; seed an empty one (STILLROOM_DATABASE_URL).")
    draw = np.random.default_rng(what.seed)
    robots = _robots(database, what, draw)
    left = draw.multinomial(what.missions, np.full(what.days, 1 / what.days))
    done = 0
    for ago, count in zip(range(what.days - 1, -1, -1), left.tolist(), strict=True):
        _day(database, what, robots, ago, count, draw, done)
        done += count
        if ago % 30 == 0:
            tell(f"{done:,} of {what.missions:,} missions")


def _robots(database: Database, what: Seed, draw: np.random.Generator) -> _Robots:
    ids = [f"seed-{number:05}" for number in range(what.robots)]
    began = datetime.combine(what.until - timedelta(days=what.days), time(), UTC)
    with database.write(durable=False) as tx:
        maps = seeding.add_robots(tx, [(name, sha256(name.encode()).hexdigest()) for name in ids], began)
    eager = draw.gamma(2.0, size=what.robots)
    return _Robots(
        ids,
        maps,
        rooms=draw.choice(ROOMS, size=what.robots),
        models=draw.integers(len(MODELS), size=what.robots),
        frailty=draw.gamma(2.0, 0.5, size=what.robots),
        eagerness=eager / eager.sum(),
        patience=draw.random(what.robots),
    )


def _day(
    database: Database, what: Seed, robots: _Robots, ago: int, count: int, draw: np.random.Generator, first: int
) -> None:
    day = what.until - timedelta(days=ago)
    midnight = datetime.combine(day, time(), UTC)
    who = draw.choice(what.robots, size=count, p=robots.eagerness)
    at = np.sort(draw.integers(86_400, size=count))
    firmware = _version_at(len(FIRMWARE), ago, what.days, robots.patience[who])
    algorithm = _version_at(len(ALGORITHMS), ago, what.days, np.zeros(count))
    spiked = (ago <= SPIKE_DAYS_AGO) & (firmware == len(FIRMWARE) - 1)
    failed = _failed(draw, FAILS * robots.frailty[who] * np.where(spiked, 3.0, 1.0), algorithm)
    parked = draw.random(count) < 0.002
    broken = (failed == 0) & (draw.random(count) < 0.001)
    outcomes = [
        _outcome(*each)
        for each in zip(failed.tolist(), parked.tolist(), broken.tolist(), draw.random(count), strict=True)
    ]
    cause = np.where(spiked & (draw.random(count) < 0.7), 0, draw.choice(len(CAUSES), p=_SHARES, size=count))
    rows = []
    for i, robot in enumerate(who.tolist()):
        tried = outcomes[i] != "parked"
        rows.append(
            {
                "map_id": robots.maps[robot],
                "key": str(first + i),
                "sequence": first + i,
                "meta": {
                    "sequence": first + i,
                    "firmware": FIRMWARE[firmware[i]],
                    "model": MODELS[robots.models[robot]],
                },
                "received_at": midnight + timedelta(seconds=int(at[i])),
                "finished_at": midnight + timedelta(seconds=int(at[i])),
                "outcome": outcomes[i],
                "algorithm": ALGORITHMS[algorithm[i]],
                **{
                    f"ablation_{row}": bool(failed[i] <= n) if tried else None
                    for n, row in enumerate(fleet.MEASURES[:3])
                },
            }
        )
    escaped = np.flatnonzero((draw.random(count) < ESCAPES) & np.isin(outcomes, ("updated", "resolved")))
    with database.write(durable=False) as tx:
        fleet.hold(tx)
        ids = seeding.add_missions(tx, rows)
        missions = list(_processed(robots, who, rows, ids))
        met = {
            number: Met(number, *CAUSES[cause[i]], resolved=outcomes[i] == "resolved") for i, number in enumerate(ids)
        }
        count_missions(tx, missions, met)
        for i in escaped.tolist():
            fleet.escape(tx, ids[i], midnight + timedelta(days=1))


def _version_at(count: int, ago: int, days: int, patience: Floats) -> Numbers:
    """The newest version that a robot has: each takes a month to reach all."""
    age = days / count
    newest = np.floor((days - 1 - ago - 30 * patience) / age)
    return np.clip(newest, 0, count - 1).astype(np.int64)


def _failed(draw: np.random.Generator, chance: Floats, algorithm: Numbers) -> Numbers:
    """How many rows of the results table fail."""
    fails = draw.random((3, len(chance)))
    stays = np.asarray(STAYS)[::-1][algorithm]
    first = fails[0] < np.minimum(chance, 0.9)
    second = first & (fails[1] < stays)
    return np.asarray(first.astype(np.int64) + second + (second & (fails[2] < stays)))


def _outcome(failed: int, parked: bool, broken: bool, luck: float) -> str:
    if parked:
        return "parked"
    if failed == 3 or broken:
        return "reverted" if luck < 0.15 else "needs_review"
    return "resolved" if failed else "updated"


def _processed(
    robots: _Robots, who: Numbers, rows: Sequence[Mapping[str, Any]], ids: Sequence[int]
) -> Iterator[Processed]:
    for robot, row, number in zip(who.tolist(), rows, ids, strict=True):
        yield Processed(
            id=number,
            robot_id=robots.ids[robot],
            outcome=row["outcome"],
            placed=False,
            base_version=1,
            finished_at=row["finished_at"],
            algorithm=row["algorithm"],
            firmware=row["meta"]["firmware"],
            model=row["meta"]["model"],
            rooms=int(robots.rooms[robot]),
            transfer=row["ablation_transfer"],
            meta_occupancy=row["ablation_meta_occupancy"],
            meta_dividers=row["ablation_meta_dividers"],
            traceback=None,
        )
