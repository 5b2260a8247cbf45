"""`stillroom verify`: whether all that was promised about missions, versions, figures and grids holds, by database and grid
store alone. May run beside the service: the database is looked at in one moment.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any

from stillroom.store import audit, clock, tallies
from stillroom.store.audit import AuditedMission, MapFacts
from stillroom.store.database import Database, Transaction
from stillroom.store.fleet import Counted
from stillroom.store.grids import GridStore, path_of

GRACE = timedelta(hours=1)
"""A grid is stored before the mission that refers to it; one that nothing refers to by then is an orphan."""
MOST_TOLD = 100
"""Faults of one kind that a report lists; it counts all."""


@dataclass(frozen=True)
class Fault:
    check: str
    where: str
    detail: str


@dataclass
class Report:
    """`counts`: how much was looked at; `faults`: how often each check failed; `examples`: the first of them."""

    counts: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    examples: list[Fault] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        return not self.faults

    def add(self, fault: Fault) -> None:
        self.faults[fault.check] += 1
        if self.faults[fault.check] <= MOST_TOLD:
            self.examples.append(fault)

    def as_json(self) -> dict[str, Any]:
        examples = [asdict(fault) for fault in self.examples]
        return {"holds": self.holds, "counts": self.counts, "faults": self.faults, "examples": examples}


def verify(
    database: Database,
    grids: GridStore,
    acknowledged: Sequence[str] = (),
    read_grids: bool = True,
    grace: timedelta = GRACE,
) -> Report:
    """`acknowledged`: paths of missions that robots were told had arrived. `read_grids`: every grid is read and hashed, else only
    looked for. Raises Unavailable.
    """
    report = Report()
    known: set[str] = set()
    with database.read() as tx:
        for found in audit.map_facts(tx):
            known.update(f"{found.path}/missions/{one.key}" for one in found.missions)
            report.counts.update(maps=1, missions=len(found.missions), versions=len(found.versions))
            for check in CHECKS:
                for detail in check(found):
                    report.add(Fault(check.__name__, found.path, detail))
        for fault in _figures(tx):
            report.add(fault)
        report.counts["counted"] = audit.count(tx, "counted")
        referred, discarded, now = set(audit.grids(tx)) - {""}, audit.discarded_grids(tx), clock.now(tx)
    for path in acknowledged:
        if path not in known:
            report.add(Fault("acknowledged", path, "was acknowledged and is not there"))
    report.counts.update(grids=len(referred), acknowledged=len(acknowledged))
    for fault in _grids(grids, referred, discarded, read_grids, now.astimezone(UTC) - grace):
        report.add(fault)
    return report


def one_chain(of: MapFacts) -> Iterator[str]:
    """Versions follow each other without a gap, and the newest is in force."""
    numbers = [version.number for version in of.versions]
    if numbers != list(range(1, len(numbers) + 1)):
        yield f"its versions are {numbers}"
    if of.head != (numbers[-1] if numbers else None):
        yield f"version {of.head} is in force, of {len(numbers)}"
    for version in of.versions:
        before = version.number - 1 or None
        if version.parent != before:
            yield f"version {version.number} comes after {version.parent}"
    if of.versions and of.living_rooms != of.versions[-1].rooms:
        yield f"{of.living_rooms} rooms live, version {of.head} has {of.versions[-1].rooms}"


def processed_once(of: MapFacts) -> Iterator[str]:
    """A mission that was taken made one version, the one it names; another made none; each was told of once."""
    made = Counter(version.mission for version in of.versions if version.cause in ("created", "mission"))
    by_number = {version.number: version for version in of.versions}
    for mission in of.missions:
        if mission.placed_from is not None:
            continue
        versions = made.pop(mission.key, 0)
        if versions != int(_is_taken(mission)):
            yield f"mission {mission.key} ({mission.outcome}) made {versions} versions"
        elif _is_taken(mission):
            version = by_number.get(mission.version or 0)
            if version is None or (version.mission, version.grid) != (mission.key, mission.grid):
                yield f"mission {mission.key} says it made version {mission.version}, which is not so"
    placed = {mission.key for mission in of.missions if mission.placed_from is not None}
    for key in made.keys() - placed:
        yield f"a version was made by mission {key}, which is not there"
    for told in of.told:
        if told.times > 1 and told.outcome != "reverted":  # what could not be processed may be run again
            yield f"mission {told.mission} was told of {told.times} times"


def in_order(of: MapFacts) -> Iterator[str]:
    """In the robot's own order; what came late changed nothing."""
    done = [one for one in of.missions if one.finished_at is not None and one.placed_from is None]
    done.sort(key=lambda one: (one.finished_at, one.id))
    newest: tuple[int, int] | None = None
    for mission in done:
        place = mission.epoch, mission.sequence
        if newest is not None and place < newest:
            if mission.outcome not in ("superseded", "reverted", "created"):
                yield f"mission {mission.key} ({place}) is {mission.outcome}, after {newest}"
        elif mission.outcome == "superseded":
            yield f"mission {mission.key} ({place}) is superseded, by nothing"
        newest = place if newest is None else max(newest, place)
    known = None if of.epoch is None or of.sequence is None else (of.epoch, of.sequence)
    if newest != known:
        yield f"the newest mission that was processed is {newest}; the map says {known}"


def nothing_forgotten(of: MapFacts) -> Iterator[str]:
    """What waits has a lane that will come to it; what is done says what it came to."""
    waiting = [mission for mission in of.missions if mission.status != "done"]
    if waiting and of.ready_at is None:
        yield f"{len(waiting)} missions wait, and nobody will look for them"
    for mission in of.missions:
        if (mission.status == "done") != (mission.outcome is not None and mission.finished_at is not None):
            yield f"mission {mission.key} is {mission.status}, outcome {mission.outcome}"


CHECKS: tuple[Callable[[MapFacts], Iterator[str]], ...] = (one_chain, processed_once, in_order, nothing_forgotten)


def _is_taken(mission: AuditedMission) -> bool:
    return mission.outcome in ("created", "updated", "resolved")


def _figures(tx: Transaction) -> Iterator[Fault]:
    """Each mission is counted once, and the tallies are those of a recount."""
    for mission_id, detail in audit.miscounted(tx):
        yield Fault("figures", f"mission number {mission_id}", detail)
    recount: dict[tuple[tuple[object, ...], str], Counter[int]] = {}

    def count(key: tuple[object, ...], name: str, fact: Counted) -> None:
        recount.setdefault((key, name), Counter())[fact.robot] += 1

    for fact in audit.facts(tx):
        for name in fact.measures if fact.outcome == "parked" else ["missions", *fact.measures]:
            count(audit.day_key(fact), name, fact)
        if fact.cause_id is not None:
            count(audit.failure_key(fact), "robots", fact)
    known = audit.robot_numbers(tx)
    for key, name, tally in audit.tally_rows(tx):
        # robots whose data were deleted stay counted, by numbers that are nobody's any more
        there = Counter(number for number in tallies.decode(tally).tolist() if number in known)
        should = recount.pop((key, name), Counter[int]())
        if there != should:
            detail = f"{name}: {there.total()} counted, {should.total()} by a recount"
            yield Fault("figures", " ".join(map(str, key)), detail)
    for (key, name), missing in recount.items():
        yield Fault("figures", " ".join(map(str, key)), f"{name}: none counted, {missing.total()} by a recount")


def _grids(grids: GridStore, referred: set[str], discarded: set[str], read: bool, before: datetime) -> Iterator[Fault]:
    """Every grid that is referred to is there, whole; nothing else is, but for what has just come."""
    paths = {path_of(key) for key in referred | discarded}
    there = set()
    for stored in grids.list():
        there.add(stored.path)
        if stored.path not in paths and stored.at < before:
            yield Fault("orphans", stored.path, f"{stored.size} bytes that nothing refers to, since {stored.at}")
    for key in referred:
        if path_of(key) not in there:
            yield Fault("grids", key, "is referred to and not there")
        elif read:
            try:
                grids.get(key)
            except (FileNotFoundError, ValueError) as error:
                yield Fault("grids", key, str(error))
