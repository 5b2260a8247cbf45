"""All robots of a benchmark, spread over processes."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import cv2
from pydantic import TypeAdapter, ValidationError

from stillroom.pipeline.update import Row
from stillroom.simulator.benchmark.judging import Record
from stillroom.simulator.benchmark.trial import Household, Trial
from stillroom.simulator.effects import Effects

_RECORD = TypeAdapter(Record)


@dataclass(frozen=True)
class Benchmark:
    effects: Effects
    seeds: Sequence[int] = (1,)
    robots: Sequence[int] = range(25)
    missions: int = 17
    processes: int = 2
    cache: Path | None = None
    pictures: Path | None = None
    row: Row | None = None
    plans: Path | None = None
    repairs: bool = False

    def trials(self) -> list[Trial]:
        settings = self.missions, self.effects, self.cache, self.pictures, self.row, self.plans, self.repairs
        return [Trial(seed, robot, *settings) for seed in self.seeds for robot in self.robots]


def run(benchmark: Benchmark, done: Collection[tuple[int, int]] = ()) -> Iterator[tuple[int, list[Record]]]:
    """How many robots are left, and one's records, as they are done; but for those in `done`, by seed and number."""
    trials = [trial for trial in benchmark.trials() if (trial.seed, trial.robot) not in done]
    for count, records in enumerate(_spread(trials, benchmark.processes), 1):
        yield len(trials) - count, records


def _spread(trials: Sequence[Trial], processes: int) -> Iterator[list[Record]]:
    if processes <= 1:
        _alone()
        yield from map(run_trial, trials)
        return
    with ProcessPoolExecutor(processes, initializer=_alone) as pool:
        for future in as_completed([pool.submit(run_trial, trial) for trial in trials]):
            yield future.result()


def _alone() -> None:
    """OpenCV's own threads would only get in each other's way, and the core's time is that of one."""
    cv2.setNumThreads(1)


def run_trial(trial: Trial) -> list[Record]:
    return list(Household(trial).run())


def write(records: Iterable[Record], file: Path) -> None:
    """At the end of a file, as JSON, a line each."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("ab") as lines:
        lines.writelines(_RECORD.dump_json(record) + b"\n" for record in records)


def read(file: Path) -> list[Record]:
    """What `write` has written. Raises ValueError for anything else."""
    found = []
    for number, line in enumerate(file.read_bytes().splitlines(), 1):
        try:
            found.append(_RECORD.validate_json(line))
        except ValidationError:
            raise ValueError(f"{file}: line {number} is no mission of a benchmark of this program") from None
    return found
