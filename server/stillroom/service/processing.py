"""A worker processes missions: gather the map in force, call the pure core, commit result and version at once."""

import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property, partial
from threading import Event, Thread

from stillroom import __version__
from stillroom.documents.grids import read_grid, read_mission_map
from stillroom.documents.missions import MissionMeta, stored_meta
from stillroom.documents.stored import decode_map, decode_motion, encode_motion
from stillroom.errors import Unavailable
from stillroom.maps.mission import Mission, tracked_motion
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.update import RESOLVERS, MapUpdate, ResolverName, create_semantic_map, update_map
from stillroom.service import sightings
from stillroom.service.candidates import Question, ask, under_version
from stillroom.service.frames import Step, motion_between
from stillroom.service.versions import ids_of, new_version
from stillroom.store import clock, events, lanes, maps, missions
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore
from stillroom.store.rows import Json, MapRow, MissionRow, VersionRow

MAX_ATTEMPTS = 3
"""A mission that ended its worker this often is recorded as reverted, so that its lane goes on."""


@dataclass
class Timings:
    """Milliseconds by stage; `Timings()` is a clock for the core's `stage`."""

    ms: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        began = time.perf_counter()
        try:
            yield
        finally:
            self.ms[stage] = round(self.ms.get(stage, 0.0) + (time.perf_counter() - began) * 1000, 3)


@dataclass(frozen=True)
class Gathered:
    """All that the core needs for one mission."""

    mission: MissionRow
    of: MapRow
    meta: MissionMeta
    current: VersionRow | None
    """The version in force; None where the map has none yet."""
    base: VersionRow | None
    """The version that the robot's tracking starts from; None where it said none or one that is not known."""
    to_base: Motion | None
    """From the frame of `current` to that of `base`."""
    parked: MissionRow | None
    """What a person placed here; None where the robot sent the mission here itself."""
    under_current: MissionRow | None
    """The mission that `current` lies on, as the robot sent it."""

    @property
    def is_late(self) -> bool:
        """Whether a newer mission was processed before. Equal sequence numbers: the one that came later is the newer."""
        if self.current is None:
            return False
        if self.parked is not None:
            return self.under_current is not None and _is_older(self.parked, self.under_current)
        newest = self.of.epoch, self.of.sequence
        if newest[0] is None or newest[1] is None:
            return False
        return (self.mission.epoch, self.mission.sequence) < newest

    @property
    def cause(self) -> str:
        """Of the version that it makes."""
        if self.current is None:
            return "created"
        return "mission" if self.parked is None else "decision"

    @property
    def made_by(self) -> str:
        return self.mission.placed_by or f"robot:{self.of.robot_id}"

    @cached_property
    def previous(self) -> SemanticMap | None:
        return None if self.current is None else decode_map(self.current.document, ids_of(self.of))


def _is_older(first: MissionRow, second: MissionRow) -> bool:
    """By the robot's own order where it sent both to one map, else in the order of their arrival."""
    if first.map_id == second.map_id:
        return (first.epoch, first.sequence) < (second.epoch, second.sequence)
    return first.id < second.id


def process_next(database: Database, grids: GridStore, resolvers: Sequence[ResolverName] = RESOLVERS) -> int | None:
    """Processes one mission, of the lane that waits longest. The id of its map; None where there was nothing to do."""
    claim = lanes.claim(database)
    if claim is None:
        return None
    with _renewed(database, claim):
        give_up = claim.attempts > MAX_ATTEMPTS
        process = (
            partial(_give_up, database, claim) if give_up else partial(_process, database, grids, claim, resolvers)
        )
        # A person may have edited the map meanwhile: then the mission is carried over from the edited map.
        while not process():
            pass
    return claim.map_id


def _give_up(database: Database, claim: lanes.Claim) -> bool:
    gathered = gather(database, claim.mission_id)
    reason = f"Processing ended the worker {MAX_ATTEMPTS} times; the mission is kept and was not taken."
    return _commit(database, claim, gathered, None, _failure(gathered, reason, Timings()))


def _process(database: Database, grids: GridStore, claim: lanes.Claim, resolvers: Sequence[ResolverName]) -> bool:
    """False where the version in force changed meanwhile."""
    gathered = gather(database, claim.mission_id)
    timings = Timings()
    try:
        with timings("total"):
            update, warnings = decide(gathered, grids, timings, resolvers)
            question = _question(database, gathered, grids, timings) if update.outcome == "parked" else None
    except Exception:
        reason = "Processing failed; the mission is kept and was not taken."
        return _commit(database, claim, gathered, None, _failure(gathered, reason, timings, traceback.format_exc()))
    found = _finding(gathered, update, warnings, timings)
    if question is not None:
        found = replace(found, result=found.result | question.as_json(), reason=f"{found.reason} {question.advice}")
    return _commit(database, claim, gathered, update, found)


def _question(database: Database, gathered: Gathered, grids: GridStore, timings: Timings) -> Question | None:
    """What a person is asked about a mission that was parked; None where it is too late to ask."""
    if gathered.is_late or gathered.current is None:
        return None
    with timings("candidates"):
        grid = read_grid(grids.get(gathered.mission.grid), gathered.meta.reading())
        return ask(database, gathered.of, gathered.current, gathered.mission, grid)


def gather(database: Database, mission_id: int) -> Gathered:
    with database.read() as tx:
        mission = missions.get(tx, mission_id)
        of = maps.get(tx, mission.map_id)
        meta = stored_meta(mission.meta)
        current = None if of.head is None else maps.version_at(tx, of.id, of.head)
        base = current
        if meta.base_version != of.head:
            base = None if meta.base_version is None else maps.version_at(tx, of.id, meta.base_version)
        to_base = None
        if current is not None and base is not None:
            to_base = motion_between(partial(_frame_step, tx, of.id), current.number, base.number)
        parked = None if mission.placed_from is None else missions.get(tx, mission.placed_from)
        under = under_version(tx, current) if current is not None and parked is not None else None
    return Gathered(mission, of, meta, current, base, to_base, parked, under)


def _frame_step(tx: Transaction, map_id: int, number: int) -> Step | None:
    head = maps.version_head(tx, map_id, number)
    return None if head is None else (head.frame_from, decode_motion(head.motion))


def decide(
    gathered: Gathered, grids: GridStore, timings: Timings, resolvers: Sequence[ResolverName]
) -> tuple[MapUpdate, tuple[str, ...]]:
    """What the mission comes to, and warnings about its tracking."""
    with timings("decode"):
        grid, semantics = read_mission_map(grids.get(gathered.mission.grid), gathered.meta.reading())
    previous = gathered.previous
    if previous is None:
        ids = ids_of(gathered.of)
        return create_semantic_map(grid, gathered.mission.key, ids, semantics=semantics, stage=timings), ()
    # Where a mission was parked its tracking was of no use, and where it was placed it is another floor's.
    motion, warnings = (None, ()) if gathered.parked is not None else _motion(gathered, previous)
    mission, placed = Mission(gathered.mission.key, grid, motion), gathered.parked is not None
    return update_map(previous, mission, stage=timings, trust_registration=placed, resolvers=resolvers), warnings


def _motion(gathered: Gathered, previous: SemanticMap) -> tuple[Motion | None, tuple[str, ...]]:
    """From the frame of the version in force to the mission's, as the robot tracked it."""
    tracking, said = gathered.meta.tracking.as_tracking(), gathered.meta.base_version
    tracked_something = bool(tracking.rooms or tracking.dividers or tracking.submaps or tracking.transform)
    if said is None:
        missing = ("The tracking says no base_version and was ignored.",) if tracked_something else ()
        return None, missing
    if gathered.base is None or gathered.to_base is None:
        return None, (f"base_version {said} is not known; the tracking was ignored.",)
    is_current = gathered.current is not None and gathered.base.number == gathered.current.number
    base = previous if is_current else decode_map(gathered.base.document)
    from_base, warnings = tracked_motion(base, tracking)
    return (None if from_base is None else from_base.after(gathered.to_base)), warnings


def _finding(gathered: Gathered, update: MapUpdate, warnings: tuple[str, ...], timings: Timings) -> missions.Finding:
    late = gathered.is_late
    ablation = update.ablation
    result: Json = {
        "rooms": [vars(score) for score in update.rooms],
        "discovered": [] if late else list(update.discovered),
        "warnings": [*warnings, *update.warnings],
        "timings_ms": timings.ms,
    }
    head = gathered.of.head
    return missions.Finding(
        outcome="superseded" if late else update.outcome,
        reason="A newer mission was processed before this one; it changes nothing." if late else update.reason,
        base_version=head,
        version=head,
        algorithm=__version__,
        succeeded_at=None if late else update.succeeded_at,
        ablation=(
            None if late or ablation is None else (ablation.transfer, ablation.meta_occupancy, ablation.meta_dividers)
        ),
        result=result,
    )


def _failure(gathered: Gathered, reason: str, timings: Timings, stack: str | None = None) -> missions.Finding:
    head = gathered.of.head
    result: Json = {"timings_ms": timings.ms}
    return missions.Finding("reverted", reason, head, head, __version__, None, None, result, stack)


def _commit(
    database: Database,
    claim: lanes.Claim,
    gathered: Gathered,
    update: MapUpdate | None,
    found: missions.Finding,
) -> bool:
    """Finding, version and events in one transaction. False where the version in force is no longer the one gathered."""
    mission, of = gathered.mission, gathered.of
    met = _met(gathered, update)
    with database.write() as tx:
        if lanes.lock(tx, of.id) != claim.token:
            return True  # the lease ran out and another worker has the mission: what we found does not count
        if maps.get(tx, of.id).head != of.head:
            return False
        now = clock.now(tx)
        taken = update is not None and update.taken and not gathered.is_late
        if update is not None and taken:
            found = replace(found, version=_add_version(tx, gathered, update, now))
        missions.finish(tx, mission.id, found, now)
        if gathered.parked is None:
            maps.note_processed(tx, of.id, mission.epoch, mission.sequence)
        lanes.release(tx, of.id)
        data: Json = {"mission": mission.key, "version": found.version}
        version = [("version", data | {"cause": gathered.cause})] if taken else []
        questions = [] if met is None else sightings.keep(tx, met, found.version, now)
        events.add(tx, of, [*version, ("mission", data | {"outcome": found.outcome}), *questions], now)
    return True


def _met(gathered: Gathered, update: MapUpdate | None) -> sightings.Met | None:
    """What is asked about the mission; nothing where it was late, and where there was no map before it."""
    if update is None or gathered.is_late or gathered.previous is None:
        return None
    return sightings.meet(gathered.of, gathered.mission, gathered.made_by, gathered.previous, update)


def _add_version(tx: Transaction, gathered: Gathered, update: MapUpdate, now: datetime) -> int:
    of, mission = gathered.of, gathered.mission
    new = new_version(
        update.map,
        retired=update.retired,
        parent=of.head,
        cause=gathered.cause,
        mission=mission.key,
        made_by=gathered.made_by,
        grid=mission.grid,
        frame_from=of.head,
        motion=encode_motion(update.motion),
    )
    return maps.add_version(tx, of.id, new, now)


@contextmanager
def _renewed(database: Database, claim: lanes.Claim) -> Iterator[None]:
    """Keeps the lease alive as long as the block runs."""
    done = Event()

    def renew() -> None:
        while not done.wait(lanes.LEASE_S / 3):
            with suppress(Unavailable):  # there is time for two more attempts before the lease ends
                lanes.renew(database, claim)

    thread = Thread(target=renew, name="lease", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()  # not waited for: a lease that is renewed once too often belongs to nobody by then
