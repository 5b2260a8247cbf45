"""The fleet's figures follow what is processed: each mission is counted once, after it is done, by whoever finds it first."""

from collections.abc import Mapping, Sequence
from datetime import UTC
from hashlib import sha256

from stillroom.service.fleet.escapes import blamed
from stillroom.store import fleet
from stillroom.store.database import Database, Transaction
from stillroom.store.fleet import Counted, Fingerprint, Met, Processed

BATCH = 500
"""Missions of one transaction."""
BATCHES_AT_ONCE = 10
"""Of who can't wait for all of a long backlog."""
JUDGED_AT_ONCE = 20
"""Each needs some documents of maps."""
JUDGED = ("updated", "resolved", "needs_review", "reverted")
TAKEN = ("updated", "resolved")
ROWS = ("transfer", "meta_occupancy", "meta_dividers")
SIZES = ((3, "1-3"), (6, "4-6"), (9, "7-9"))
LARGEST = "10+"
UNKNOWN = ""
"""Firmware or model that the robot did not say."""


def catch_up(database: Database, batches: int = 1) -> int:
    """Counts what has been processed and judges what people changed since, at most so many batches. How much still waits."""
    for _ in range(batches):
        with database.read() as tx:
            waiting = fleet.backlog(tx)
            versions = fleet.to_judge(tx, JUDGED_AT_ONCE) if waiting[1] else []
        if not any(waiting):
            return 0
        # Missions are counted in a later transaction than these versions were read in: what a version corrects is counted before.
        with database.write(durable=False) as tx:
            fleet.hold(tx)
            _count(tx)
        if versions:
            _judge(database, versions)
    with database.read() as tx:
        return sum(fleet.backlog(tx))


def size_of(rooms: int | None) -> str:
    """Homes are told apart by how many rooms their maps have."""
    if rooms is None:
        return UNKNOWN
    return next((name for most, name in SIZES if rooms <= most), LARGEST)


def failed_rows(mission: Processed) -> int:
    """How many rows of the results table the mission fails, the first ones; all where nothing could be tried."""
    if mission.outcome == "parked":
        return 0
    if mission.transfer is None:
        return len(ROWS) if mission.outcome == "reverted" else 0
    return sum(not getattr(mission, row) for row in ROWS)


def is_counted(mission: Processed) -> bool:
    """Not the first of a map, which carries nothing over, nor what came late, nor what a person has placed."""
    first = mission.base_version is None
    return not first and not mission.placed and mission.outcome in (*JUDGED, "parked")


def fingerprint(mission: Processed, met: Met | None) -> Fingerprint | None:
    """What the mission failed by; None where it did not, with transfer alone."""
    failed = failed_rows(mission)
    if failed == 0 and mission.outcome in TAKEN:
        return None
    if mission.traceback is not None:
        kind, cause, stage = "error", _exception(mission.traceback), "processing"
    else:
        kind, cause = ("unknown", "unknown") if met is None else (met.kind, met.cause)
        stage = _stage(mission, failed)
    about = (kind, cause, stage, mission.algorithm)
    return Fingerprint(sha256("/".join(about).encode()).hexdigest()[:16], *about)


def _stage(mission: Processed, failed: int) -> str:
    """The last row of the results table that failed, or what else kept the mission from being taken."""
    if mission.outcome == "parked":
        return "registration"
    if mission.transfer is None:
        return "processing"
    return ROWS[failed - 1] if failed else "verification"


def _exception(traceback: str) -> str:
    """The class of the exception: its message may say something of a home."""
    last = traceback.strip().splitlines()[-1] if traceback.strip() else "unknown"
    return last.split(":", 1)[0].strip()[-64:]


def count_waiting(tx: Transaction) -> None:
    """All that was processed and is not counted yet. Counting must be held."""
    while fleet.backlog(tx)[0]:
        _count(tx)


def _count(tx: Transaction) -> None:
    missions = fleet.to_count(tx, BATCH)
    if not missions:
        return
    met = fleet.met(tx, [mission.id for mission in missions if is_counted(mission)])
    count_missions(tx, missions, met)


def count_missions(tx: Transaction, missions: Sequence[Processed], met: Mapping[int, Met]) -> None:
    """`met`: the conflict that says most, of those that met one. Counting must be held."""
    counted = [mission for mission in missions if is_counted(mission)]
    numbers = fleet.robot_numbers(tx, (mission.robot_id for mission in counted))
    causes: dict[str, int] = {}
    facts = []
    for mission in sorted(counted, key=lambda mission: mission.finished_at):
        found = fingerprint(mission, met.get(mission.id))
        if found is not None:
            causes[found.key] = fleet.see_cause(tx, found, mission.finished_at)
        facts.append(
            Counted(
                mission_id=mission.id,
                robot=numbers[mission.robot_id],
                day=mission.finished_at.astimezone(UTC).date(),
                firmware=mission.firmware or UNKNOWN,
                model=mission.model or UNKNOWN,
                algorithm=mission.algorithm,
                size=size_of(mission.rooms),
                outcome=mission.outcome,
                failed=failed_rows(mission),
                cause_id=None if found is None else causes[found.key],
            )
        )
    fleet.count(tx, [mission.id for mission in missions], facts)


def _judge(database: Database, versions: Sequence[tuple[int, int]]) -> None:
    with database.read() as tx:
        found = [blamed(tx, map_id, number) for map_id, number in versions]
    with database.write(durable=False) as tx:
        fleet.hold(tx)
        for correction in found:
            if correction is not None:
                fleet.escape(tx, *correction)
        fleet.judged(tx, versions)
