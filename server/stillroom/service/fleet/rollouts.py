"""Another setting of the pipeline on its way to all homes: begun, looked at, led on, and ended."""

from collections.abc import Sequence
from typing import Literal, get_args

from stillroom import __version__
from stillroom.documents.api import Page
from stillroom.documents.replays import PairedTable
from stillroom.documents.rollouts import (
    ArmShare,
    BesideProgress,
    ChangedMap,
    EndRollout,
    Gate,
    GateReport,
    LookDocument,
    NewRollout,
    RevertedMaps,
    RolloutDocument,
    RolloutReport,
)
from stillroom.errors import AlreadyExists, Fault, GateNotPassed, InvalidInput, NotFound, NotRunning
from stillroom.estimation.differences import Share
from stillroom.estimation.pairs import Pairs
from stillroom.pipeline.update import ResolverName
from stillroom.service.access import Principal, signature
from stillroom.service.fleet import reverting
from stillroom.service.fleet.counting import catch_up
from stillroom.service.fleet.judging import Evidence, advance, end, evidence, gates_of, judge, next_look
from stillroom.service.fleet.variants import label, parameters
from stillroom.service.paging import page_of
from stillroom.store import clock, rollouts
from stillroom.store.database import Database, Transaction
from stillroom.store.rollouts import Compared, Look, RolloutRow

Row = Literal["transfer", "meta_occupancy", "meta_dividers"]


def start(database: Database, caller: Principal, new: NewRollout) -> RolloutReport:
    """Beside the setting in force, at first. Raises InvalidInput, AlreadyExists."""
    parameters(new.params)
    measures = [gate.measure for gate in new.gates]
    if len(set(measures)) < len(measures):
        raise InvalidInput("A measure has one gate.", (Fault("/gates", "the same measure twice"),))
    with database.write() as tx:
        now = clock.now(tx)
        made = rollouts.add(
            tx,
            rollouts.NewRollout(
                name=new.name,
                code=__version__,
                algorithm=label(new.name),
                resolvers=[name for name in get_args(ResolverName) if name in new.resolvers],
                params=dict(new.params),
                gates=[gate.model_dump() for gate in new.gates],
                automatic=new.automatic,
                stage=0,
                staged_at=now,
                created_at=now,
                created_by=signature(caller),
            ),
        )
        if not made:
            other = rollouts.running(tx)
            taken = rollouts.by_name(tx, new.name) is not None
            detail = (
                f"There is a rollout {new.name} already." if taken or other is None else f"{other.name} is running."
            )
            raise AlreadyExists(f"{detail} Homes take part in one at a time.")
    return report(database, new.name)


def list_rollouts(database: Database, cursor: int | None, limit: int) -> Page[RolloutDocument]:
    """The newest first."""
    with database.read() as tx:
        rows, following = page_of(rollouts.page(tx, cursor, limit + 1), limit, lambda row: str(row.id))
        in_force = _in_force(tx)
    return Page(items=[_document(row, in_force) for row in rows], next=following)


def report(database: Database, name: str) -> RolloutReport:
    """With what it came to so far; judged anew, where it is time to. Raises NotFound."""
    catch_up(database)
    judge(database)
    with database.read() as tx:
        row = _find(tx, name)
        looks, found = rollouts.looks(tx, row.id), evidence(tx, row)
        beside = found.compared if row.stage == 0 else rollouts.compared(tx, row.id)
        done, waiting, errors = rollouts.progress(tx, row.id)
        changed, in_force = len(rollouts.changed_maps(tx, row.id)), _in_force(tx)
    here = [look for look in looks if look.stage == row.stage]
    last = here[-1] if here else None
    return RolloutReport.model_validate(
        _document(row, in_force).model_dump()
        | {
            "verdict": "waiting" if last is None else last.verdict,
            "missions": found.missions,
            "next_look": next_look(row, looks),
            "report": [_gate(gate, found, last) for gate in gates_of(row) if found.knows(gate.measure)],
            "looks": [
                LookDocument.model_validate({n: getattr(one, n) for n in LookDocument.model_fields}) for one in looks
            ],
            "beside": BesideProgress(done=done, waiting=waiting, errors=errors),
            "tables": [_table(beside, measure) for measure in get_args(Row)],
            "changed_maps": changed,
        }
    )


def lead_on(database: Database, name: str) -> RolloutReport:
    """To the next stage, where the last look at this one let it pass. Raises NotFound, NotRunning, GateNotPassed."""
    catch_up(database)
    judge(database)
    with database.write() as tx:
        row = rollouts.lock(tx, _find(tx, name).id)
        if row.state != "running":
            raise NotRunning(f"The rollout is {row.state}.")
        here = [look for look in rollouts.looks(tx, row.id) if look.stage == row.stage]
        if not here or here[-1].verdict != "passed":
            verdict = here[-1].verdict if here else "waiting"
            needed = next_look(row, rollouts.looks(tx, row.id))
            raise GateNotPassed(
                f"Its gates are not passed ({verdict}): it is looked at next when there are {needed:,} missions.",
                verdict=verdict,
            )
        advance(tx, row)
    return report(database, name)


def stop(database: Database, caller: Principal, name: str, why: EndRollout) -> RolloutReport:
    """Ends one that is running, or withdraws what is in force: homes go back to what they had. Raises NotFound, NotRunning."""
    with database.write() as tx:
        row = rollouts.lock(tx, _find(tx, name).id)
        if row.state == "running":
            end(tx, row, "inconclusive", signature(caller), why.reason.strip())
        elif row.state == "successful" and row.withdrawn_at is None:
            reason = f"{row.reason} Withdrawn by {signature(caller)}: {why.reason.strip()}"
            rollouts.change(tx, row.id, {"withdrawn_at": clock.now(tx), "reason": reason})
        else:
            raise NotRunning(f"The rollout is {row.state}.")
    return report(database, name)


def list_changed_maps(database: Database, name: str, cursor: int | None, limit: int) -> Page[ChangedMap]:
    """Maps that the candidate changed. Raises NotFound."""
    with database.read() as tx:
        return reverting.changed_maps(tx, _find(tx, name), cursor, limit)


def revert(
    database: Database, caller: Principal, name: str, robot_id: str | None, map_name: str | None, cursor: int | None
) -> RevertedMaps:
    """Raises NotFound, and NotRunning where the candidate would only change them again."""
    with database.read() as tx:
        row = _find(tx, name)
        if row.state == "running" or row.id == _in_force(tx):
            raise NotRunning("End it first: what is taken back now, the next mission would change again.")
    return reverting.revert(database, caller, row, robot_id, map_name, cursor)


def _in_force(tx: Transaction) -> int | None:
    return next((row.id for row in rollouts.in_play(tx) if row.state == "successful"), None)


def _find(tx: Transaction, name: str) -> RolloutRow:
    row = rollouts.by_name(tx, name)
    if row is None:
        raise NotFound(f"There is no rollout {name}.")
    return row


def _document(row: RolloutRow, in_force: int | None) -> RolloutDocument:
    return RolloutDocument.model_validate(vars(row) | {"in_force": row.id == in_force})


def _gate(gate: Gate, found: Evidence, last: Look | None) -> GateReport:
    apart, shares = found.difference(gate.measure), found.shares(gate.measure)
    looked = [] if last is None else [one["verdict"] for one in last.gates if one["measure"] == gate.measure]
    some = shares.new.of > 0 and shares.old.of > 0
    return GateReport(
        **gate.model_dump(),
        verdict=looked[0] if looked else "waiting",
        old=_share(shares.old),
        new=_share(shares.new),
        difference=round(apart.value, 6) if some else None,
        ci95=(round(apart.low, 6), round(apart.high, 6)),
        p=round(found.p(gate.measure), 6),
        more=apart.more(gate.margin),
    )


def _share(share: Share) -> ArmShare:
    return ArmShare(
        count=share.events,
        missions=share.of,
        robots=share.clusters,
        share=round(share.value, 6) if share.of else None,
        ci95=(round(share.low, 6), round(share.high, 6)),
    )


def _table(compared: Sequence[Compared], measure: Row) -> PairedTable:
    both, only_old, only_new, neither = (sum(robot.cells[measure][cell] for robot in compared) for cell in range(4))
    pairs = Pairs(both, only_old, only_new, neither)
    return PairedTable(measure=measure, **vars(pairs), p=pairs.p)
