"""What the core needs for one mission is gathered, and the core asked."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property, partial

from stillroom.documents.grids import read_mission_map
from stillroom.documents.missions import MissionMeta, stored_meta
from stillroom.documents.stored import decode_map
from stillroom.maps.mission import Mission, tracked_motion
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.decisions import confirm
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.update import RESOLVERS, MapUpdate, ResolverName, create_semantic_map, update_map
from stillroom.service.candidates import under_version
from stillroom.service.frames import motion_between
from stillroom.service.steps import frame_step
from stillroom.service.versions import ids_of
from stillroom.store import clock, maps, missions
from stillroom.store.database import Database
from stillroom.store.grids import GridStore
from stillroom.store.rows import MapRow, MissionRow, VersionRow
from stillroom.tracing import span


@dataclass
class Timings:
    """Milliseconds by stage; `Timings()` is a clock for the core's `stage`."""

    ms: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        began = time.perf_counter()
        try:
            with span(stage):
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
    is_any_standing: bool
    """Whether anything about the map is not settled. Until the mission is done, no more is opened: but for missions of the same
    map, only an answer to what stands opens anything.
    """
    is_any_in_play: bool
    """Whether a rollout may say how it is processed."""
    now: datetime

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
        return None if self.current is None else current_map(self.of, self.current, self.now)


def _is_older(first: MissionRow, second: MissionRow) -> bool:
    """By the robot's own order where it sent both to one map, else in the order of their arrival."""
    if first.map_id == second.map_id:
        return (first.epoch, first.sequence) < (second.epoch, second.sequence)
    return first.id < second.id


def gather(database: Database, mission_id: int) -> Gathered:
    """What else is committed meanwhile does not matter: versions stay as they are, and a head that is another by then is noticed."""
    with database.look() as tx:
        found = missions.to_process(tx, mission_id)
        mission, of, current = found.mission, found.of, found.current
        meta = stored_meta(mission.meta)
        base = current
        if meta.base_version != of.head:
            base = None if meta.base_version is None else maps.version_at(tx, of.id, meta.base_version)
        to_base = None
        if current is not None and base is not None:
            to_base = motion_between(partial(frame_step, tx, of.id), current.number, base.number)
        parked = None if mission.placed_from is None else missions.get(tx, mission.placed_from)
        under = under_version(tx, current) if current is not None and parked is not None else None
    return Gathered(
        mission, of, meta, current, base, to_base, parked, under, found.is_any_standing, found.is_any_in_play, found.now
    )


def gather_as_then(database: Database, mission_id: int) -> Gathered:
    """As it was when a mission was processed: with the version that was carried over then. Edits that came later don't count."""
    with database.read() as tx:
        mission = missions.get(tx, mission_id)
        of = replace(maps.get(tx, mission.map_id), head=mission.base_version, pinned=None)
        meta = stored_meta(mission.meta)
        number = mission.base_version
        current = None if number is None else maps.version_at(tx, of.id, number)
        base = current
        if meta.base_version != number:
            base = None if meta.base_version is None else maps.version_at(tx, of.id, meta.base_version)
        to_base = None
        if current is not None and base is not None:
            to_base = motion_between(partial(frame_step, tx, of.id), current.number, base.number)
        parked = None if mission.placed_from is None else missions.get(tx, mission.placed_from)
        now = mission.finished_at or clock.now(tx)
    return Gathered(mission, of, meta, current, base, to_base, parked, None, False, False, now)


def current_map(of: MapRow, version: VersionRow, now: datetime) -> SemanticMap:
    """The map in force, ready to be changed: with its counters of ids, and without what was declined for a time that is over.

    Who pinned this version has confirmed its shapes.
    """
    m = decode_map(version.document, ids_of(of))
    if of.pinned == version.number:
        m = confirm(m)
    still = tuple(d for d in m.meta.declined if d.until is None or datetime.fromisoformat(d.until) > now)
    return replace(m, meta=replace(m.meta, declined=still))


def carry_over(
    gathered: Gathered,
    previous: SemanticMap | None,
    grids: GridStore,
    timings: Timings,
    resolvers: Sequence[ResolverName] = RESOLVERS,
    params: Params = PARAMS,
) -> tuple[MapUpdate, tuple[str, ...]]:
    """What the mission comes to, and warnings about its tracking. `previous`: the map in force, None where there is none yet."""
    with timings("decode"):
        grid, semantics = read_mission_map(grids.get(gathered.mission.grid), gathered.meta.reading())
    if previous is None:
        ids = ids_of(gathered.of)
        return create_semantic_map(grid, gathered.mission.key, ids, params, timings, semantics), ()
    # Where a mission was parked its tracking was of no use, and where it was placed it is another floor's.
    motion, warnings = (None, ()) if gathered.parked is not None else _motion(gathered, previous)
    mission, placed = Mission(gathered.mission.key, grid, motion), gathered.parked is not None
    update = update_map(previous, mission, params=params, stage=timings, trust_registration=placed, resolvers=resolvers)
    return update, warnings


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
