"""A worker processes missions: gather the map in force, call the pure core, commit result and version at once."""

import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from threading import Event, Thread

import structlog

from stillroom import __version__
from stillroom.documents.grids import read_grid
from stillroom.documents.stored import encode_motion
from stillroom.errors import Unavailable
from stillroom.pipeline import questions
from stillroom.pipeline.review import hold_back
from stillroom.pipeline.update import RESOLVERS, MapUpdate, ResolverName
from stillroom.service import sightings
from stillroom.service.candidates import Question, ask
from stillroom.service.fleet.variants import Part, Variant, variant_for
from stillroom.service.gathering import Gathered, Timings, carry_over, gather
from stillroom.service.versions import new_version, rooms_of
from stillroom.store import events, lanes, maps, missions, rollouts
from stillroom.store.changes import apply
from stillroom.store.database import Database, Transaction
from stillroom.store.grids import GridStore
from stillroom.store.rows import Json
from stillroom.tracing import span

log = structlog.get_logger()

MAX_ATTEMPTS = 3
"""A mission that ended its worker this often is recorded as reverted, so that its lane goes on."""


def process_next(database: Database, grids: GridStore, resolvers: Sequence[ResolverName] = RESOLVERS) -> int | None:
    """Processes one mission, of the lane that waits longest. The id of its map; None where there was nothing to do.

    Raises Unavailable where database or grid store does not answer; the mission waits then, and no attempt is counted.
    """
    claim = lanes.claim(database)
    if claim is None:
        return None
    process_claimed(database, grids, claim, resolvers)
    return claim.map_id


def process_claimed(
    database: Database, grids: GridStore, claim: lanes.Claim, resolvers: Sequence[ResolverName] = RESOLVERS
) -> None:
    """Raises Unavailable, as `process_next`."""
    with _renewed(database, claim):
        give_up = claim.attempts > MAX_ATTEMPTS
        process = (
            partial(_give_up, database, claim, resolvers)
            if give_up
            else partial(_process, database, grids, claim, resolvers)
        )
        # A person may have edited the map meanwhile: then the mission is carried over from the edited map.
        try:
            while not process():
                pass
        except Unavailable:
            with suppress(Unavailable):  # where the database is away, the lease ends by itself
                lanes.hand_back(database, claim)
            raise


def _give_up(database: Database, claim: lanes.Claim, resolvers: Sequence[ResolverName]) -> bool:
    gathered = gather(database, claim.mission_id)
    variant = _variant(database, gathered, resolvers)
    reason = f"Processing ended the worker {MAX_ATTEMPTS} times; the mission is kept and was not taken."
    stack = f"WorkerDied: processing ended the worker {MAX_ATTEMPTS} times"
    return _commit(database, claim, gathered, variant, None, _failure(gathered, variant, reason, Timings(), stack))


def _process(database: Database, grids: GridStore, claim: lanes.Claim, resolvers: Sequence[ResolverName]) -> bool:
    """False where the version in force changed meanwhile."""
    gathered = gather(database, claim.mission_id)
    with _named(gathered):
        return _carry(database, grids, claim, gathered, _variant(database, gathered, resolvers))


@contextmanager
def _named(gathered: Gathered) -> Iterator[None]:
    """Log lines and spans within the block say which mission they are of."""
    names = {"robot": gathered.of.robot_id, "map": gathered.of.name, "mission": gathered.mission.key}
    with structlog.contextvars.bound_contextvars(**names), span("mission", **names):
        yield


def _carry(database: Database, grids: GridStore, claim: lanes.Claim, gathered: Gathered, variant: Variant) -> bool:
    timings = Timings()
    try:
        with timings("total"):
            update, warnings = carry_over(
                gathered, gathered.previous, grids, timings, variant.resolvers, variant.params
            )
            update = _put_to_people(gathered, update)
            question = _question(database, gathered, grids, timings) if update.outcome == "parked" else None
    except Unavailable:
        raise
    except Exception:
        log.exception("a mission could not be processed")
        reason = "Processing failed; the mission is kept and was not taken."
        failure = _failure(gathered, variant, reason, timings, traceback.format_exc())
        return _commit(database, claim, gathered, variant, None, failure)
    found = _finding(gathered, variant, update, warnings, timings)
    if question is not None:
        found = replace(found, result=found.result | question.as_json(), reason=f"{found.reason} {question.advice}")
    return _commit(database, claim, gathered, variant, update, found)


def _variant(database: Database, gathered: Gathered, resolvers: Sequence[ResolverName]) -> Variant:
    if not gathered.is_any_in_play:
        return Variant(__version__, resolvers)
    with database.look() as tx:
        return variant_for(tx, gathered.of.robot_id, resolvers)


def _put_to_people(gathered: Gathered, update: MapUpdate) -> MapUpdate:
    """With what is asked about it. It waits where the owner wants to agree first, and has not done so by saying where it belongs."""
    if gathered.previous is None:
        return update
    if gathered.parked is None:
        ask_first, pinned = gathered.of.review == "ask_first", gathered.of.pinned is not None
        update = hold_back(gathered.previous, gathered.mission.key, update, ask_first, pinned)
    return questions.ask(gathered.previous, gathered.mission.key, update)


def _question(database: Database, gathered: Gathered, grids: GridStore, timings: Timings) -> Question | None:
    """What a person is asked about a mission that was parked; None where it is too late to ask."""
    if gathered.is_late or gathered.current is None:
        return None
    with timings("candidates"):
        grid = read_grid(grids.get(gathered.mission.grid), gathered.meta.reading())
        return ask(database, gathered.of, gathered.current, gathered.mission, grid)


def _finding(
    gathered: Gathered, variant: Variant, update: MapUpdate, warnings: tuple[str, ...], timings: Timings
) -> missions.Finding:
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
        algorithm=variant.algorithm,
        succeeded_at=None if late else update.succeeded_at,
        ablation=(
            None if late or ablation is None else (ablation.transfer, ablation.meta_occupancy, ablation.meta_dividers)
        ),
        result=result,
    )


def _failure(gathered: Gathered, variant: Variant, reason: str, timings: Timings, stack: str) -> missions.Finding:
    head = gathered.of.head
    result: Json = {"timings_ms": timings.ms}
    return missions.Finding("reverted", reason, head, head, variant.algorithm, None, None, result, stack)


def _commit(
    database: Database,
    claim: lanes.Claim,
    gathered: Gathered,
    variant: Variant,
    update: MapUpdate | None,
    found: missions.Finding,
) -> bool:
    """Finding, version and events in one transaction. False where the version in force is no longer the one gathered."""
    mission = gathered.mission
    newest = None if gathered.parked is not None else (mission.epoch, mission.sequence)
    met, new = _met(gathered, update), _new_version(gathered, variant, update)
    with database.write() as tx:
        of, token, now = maps.lock(tx, claim.map_id)
        if token != claim.token:
            return True  # the lease ran out and another worker has the mission: what we found does not count
        if of.head != gathered.of.head:
            return False
        if new is not None:
            found = replace(found, version=maps.next_number(of))
        of_map = maps.noted(of, newest) if new is None else maps.added(of, new, now, newest)
        changes = (*of_map, *missions.finished(tx, mission.id, found, now), lanes.released(claim))
        if new is not None and _has_other_rooms(gathered, new):
            maps.follow_rooms(tx, of.id, new)
        if variant.part is not None:
            _note_part(tx, variant.part, gathered, found)
        questions: list[events.Happened] = []
        if met is not None:
            apply(tx, *changes)
            changes, questions = (), sightings.keep(tx, met, found.version, now)
        data: Json = {"mission": mission.key, "version": found.version}
        version = [] if new is None else [("version", data | {"cause": gathered.cause})]
        events.add(tx, of, [*version, ("mission", data | {"outcome": found.outcome}), *questions], now, changes)
    ms = found.result["timings_ms"].get("total")
    log.info("mission", outcome=found.outcome, algorithm=found.algorithm, version=found.version, ms=ms)
    return True


def _met(gathered: Gathered, update: MapUpdate | None) -> sightings.Met | None:
    """What is asked about the mission, or was about the map; nothing where it was late, and where there was no map before it."""
    if update is None or gathered.is_late or gathered.previous is None:
        return None
    if not update.conflicts and not gathered.is_any_standing:
        return None
    return sightings.meet(gathered.of, gathered.mission, gathered.made_by, gathered.previous, update)


def _note_part(tx: Transaction, part: Part, gathered: Gathered, found: missions.Finding) -> None:
    """That the mission is one of a rollout. What carries nothing over, or came late, can't be compared."""
    comparable = gathered.previous is not None and gathered.parked is None and found.outcome != "superseded"
    is_to_run = part.is_beside and comparable
    if is_to_run or not part.is_beside:
        rollouts.add_mission(tx, part.rollout_id, gathered.mission.id, part.stage, part.candidate, is_to_run)


def _new_version(gathered: Gathered, variant: Variant, update: MapUpdate | None) -> maps.NewVersion | None:
    """None where the mission is not taken."""
    if update is None or not update.taken or gathered.is_late:
        return None
    mission, head = gathered.mission, gathered.of.head
    return new_version(
        update.map,
        retired=update.retired,
        parent=head,
        cause=gathered.cause,
        mission=mission.key,
        made_by=gathered.made_by,
        grid=mission.grid,
        frame_from=head,
        motion=encode_motion(update.motion),
        algorithm=variant.algorithm,
    )


def _has_other_rooms(gathered: Gathered, new: maps.NewVersion) -> bool:
    """Than the version before: most have the same."""
    return gathered.previous is None or bool(new.retired) or new.rooms != rooms_of(gathered.previous)


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
