"""Whether a rollout goes on: looked at when its missions have doubled, by gates that allow for every look (`estimation.differences`).

A stage is judged by its own missions, so that both settings had the same days. Where all homes have the candidate, there is nothing to
compare with at the same time: the missions of the stage before stand for the old setting.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stillroom import __version__
from stillroom.documents.rollouts import Gate
from stillroom.estimation.differences import Difference, Verdict, critical, difference, fisher
from stillroom.estimation.intervals import Z95, Clustered, clustered
from stillroom.estimation.pairs import mcnemar
from stillroom.service.messages.operators import tell_operators
from stillroom.store import clock, rollouts
from stillroom.store.database import Database, Transaction
from stillroom.store.rollouts import Compared, Look, Robot, RolloutRow
from stillroom.store.rows import Json

STAGES = (0, 1, 5, 25, 100)
COMPARABLE_BESIDE = ("transfer", "meta_occupancy", "meta_dividers", "reverted", "needs_review", "parked")
"""Whether an owner corrects a map is not known of one that nobody has."""


@dataclass(frozen=True)
class Evidence:
    """What a stage has come to so far."""

    stage: int
    old: Sequence[Robot]
    new: Sequence[Robot]
    compared: Sequence[Compared]

    @property
    def missions(self) -> int:
        if self.stage == 0:
            return sum(robot.missions for robot in self.compared)
        return min(sum(robot.missions for robot in arm) for arm in (self.old, self.new))

    def knows(self, measure: str) -> bool:
        return self.stage > 0 or measure in COMPARABLE_BESIDE

    def difference(self, measure: str, z: float = Z95) -> Difference:
        if self.stage > 0:
            return difference(_arm(self.new, measure), _arm(self.old, measure), z)
        # of the same missions: those that only the one failed, and those that only the other did
        return difference(_only(self.compared, measure, 1), _only(self.compared, measure, 2), z)

    def shares(self, measure: str) -> Difference:
        """Each setting by itself."""
        if self.stage > 0:
            return self.difference(measure)
        return difference(_either(self.compared, measure, (1, 3)), _either(self.compared, measure, (2, 3)))

    def p(self, measure: str) -> float:
        found = self.difference(measure)
        if self.stage == 0:
            return mcnemar(found.new.events, found.old.events)
        return fisher((found.new.events, found.new.of), (found.old.events, found.old.of))


def evidence(tx: Transaction, row: RolloutRow) -> Evidence:
    if row.stage == 0:
        return Evidence(0, (), (), rollouts.compared(tx, row.id))
    before = _with_both_arms(row.stage)
    return Evidence(
        row.stage, rollouts.robots(tx, row.id, before, False), rollouts.robots(tx, row.id, row.stage, True), ()
    )


def gates_of(row: RolloutRow) -> list[Gate]:
    return [Gate.model_validate(gate) for gate in row.gates]


def next_look(row: RolloutRow, looks: Sequence[Look]) -> int:
    """At how many missions."""
    here = [look for look in looks if look.stage == row.stage]
    return 2 * here[-1].missions if here else max(gate.minimum_n for gate in gates_of(row))


def judge(database: Database) -> None:
    """Looks at the rollout that is running, where it is time to; ends it where it harms, or where it has come through."""
    with database.read() as tx:
        row = rollouts.running(tx)
        if row is None or (row.code == __version__ and not _is_due(tx, row)):
            return
        found = evidence(tx, row)
    with database.write() as tx:
        now_row = rollouts.lock(tx, row.id)
        if now_row != row:
            return  # somebody else has decided meanwhile
        if row.code != __version__:
            end(tx, row, "inconclusive", None, f"The code changed from {row.code} to {__version__}.")
        elif _is_due(tx, row):
            _decide(tx, row, found)


def _is_due(tx: Transaction, row: RolloutRow) -> bool:
    sizes = rollouts.sizes(tx, row.id)
    arms = [(0, False)] if row.stage == 0 else [(row.stage, True), (_with_both_arms(row.stage), False)]
    missions = min(sizes.get(arm, 0) for arm in arms)
    return missions >= next_look(row, rollouts.looks(tx, row.id))


def _with_both_arms(stage: int) -> int:
    """The stage whose missions stand for the old setting."""
    return STAGES[-2] if stage == STAGES[-1] else stage


def _decide(tx: Transaction, row: RolloutRow, found: Evidence) -> None:
    gates = [gate for gate in gates_of(row) if found.knows(gate.measure)]
    number = len(rollouts.looks(tx, row.id)) + 1
    z = critical(number, max(len(gates), 1))
    looked = [_looked(gate, found, z) for gate in gates]
    verdict = _together([str(one["verdict"]) for one in looked])
    now = clock.now(tx)
    rollouts.add_look(tx, Look(row.id, number, row.stage, found.missions, now, verdict, looked))
    if verdict == "failed":
        worst = next(one for one in looked if one["verdict"] == "failed")
        end(tx, row, "failed", None, _why(worst))
    elif verdict == "passed" and row.stage == STAGES[-1]:
        end(tx, row, "successful", None, "All homes have it, and its gates are passed.")
    elif verdict == "passed" and row.automatic:
        advance(tx, row)


def _looked(gate: Gate, found: Evidence, z: float) -> Json:
    apart, shares = found.difference(gate.measure, z), found.shares(gate.measure)
    numbers = {"old": shares.old.value, "new": shares.new.value, "low": apart.low, "high": apart.high}
    verdict = apart.verdict(gate.margin)
    rounded = {name: round(value, 6) for name, value in numbers.items()}
    return {"measure": gate.measure, "margin": gate.margin, "verdict": verdict} | rounded


def _together(verdicts: Sequence[str]) -> Verdict:
    if "failed" in verdicts:
        return "failed"
    return "passed" if all(verdict == "passed" for verdict in verdicts) else "inconclusive"


def _why(gate: Json) -> str:
    low, high = 100 * gate["low"], 100 * gate["high"]
    return (
        f"{gate['measure']}: {100 * gate['new']:.1f} % instead of {100 * gate['old']:.1f} %, "
        f"that is {low:.1f} to {high:.1f} points more, and {100 * gate['margin']:.1f} are allowed."
    )


def advance(tx: Transaction, row: RolloutRow) -> None:
    """To the next stage. It must be locked."""
    stage = STAGES[STAGES.index(row.stage) + 1]
    rollouts.change(tx, row.id, {"stage": stage, "staged_at": clock.now(tx)})
    rollouts.forget_to_run(tx, row.id)
    _tell(tx, row, "rollout.advanced", {"stage": stage})


def end(tx: Transaction, row: RolloutRow, state: str, by: str | None, reason: str) -> None:
    """It must be locked. Homes go back to what they had, unless it was successful."""
    rollouts.change(tx, row.id, {"state": state, "ended_at": clock.now(tx), "ended_by": by, "reason": reason})
    rollouts.forget_to_run(tx, row.id)
    kind = {"failed": "rollout.halted", "successful": "rollout.successful"}.get(state, "rollout.ended")
    _tell(tx, row, kind, {"stage": row.stage, "reason": reason})


def _tell(tx: Transaction, row: RolloutRow, kind: Any, data: Json) -> None:
    about = {"rollout": row.name, "algorithm": row.algorithm}
    tell_operators(tx, kind, about | data, f"/fleet/rollouts/{row.name}")


def _arm(robots: Sequence[Robot], measure: str) -> Clustered:
    if measure == "parked":
        return clustered([r.missions + r.counts["parked"] for r in robots], [r.counts["parked"] for r in robots])
    return clustered([r.missions for r in robots], [r.counts[measure] for r in robots])


def _only(robots: Sequence[Compared], measure: str, cell: int) -> Clustered:
    return _either(robots, measure, (cell,))


def _either(robots: Sequence[Compared], measure: str, cells: Sequence[int]) -> Clustered:
    ways = [robot.cells[measure] for robot in robots]
    return clustered([sum(way) for way in ways], [sum(way[cell] for cell in cells) for way in ways])
