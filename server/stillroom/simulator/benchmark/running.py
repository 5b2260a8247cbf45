"""All robots of a benchmark, spread over processes."""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2

from stillroom.pipeline.update import Row
from stillroom.simulator.benchmark.judging import Record
from stillroom.simulator.benchmark.trial import Household, Trial
from stillroom.simulator.effects import Effects


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

    def trials(self) -> list[Trial]:
        return [
            Trial(seed, robot, self.missions, self.effects, self.cache, self.pictures, self.row)
            for seed in self.seeds
            for robot in self.robots
        ]


def run(benchmark: Benchmark, told: Callable[[int, int], None]) -> list[Record]:
    """Every mission's record, by seed, robot and mission; `told` hears how many robots are done, of how many."""
    trials = benchmark.trials()
    records: list[Record] = []
    for done, of_one in enumerate(_spread(trials, benchmark.processes), 1):
        records += of_one
        told(done, len(trials))
    return sorted(records, key=lambda record: (record.seed, record.robot, record.mission))


def _spread(trials: Sequence[Trial], processes: int) -> Iterator[list[Record]]:
    if processes <= 1:
        yield from map(run_trial, trials)
        return
    with ProcessPoolExecutor(processes, initializer=_alone) as pool:
        for future in as_completed([pool.submit(run_trial, trial) for trial in trials]):
            yield future.result()


def _alone() -> None:
    """A process of many: OpenCV's own threads would only get in each other's way."""
    cv2.setNumThreads(1)


def run_trial(trial: Trial) -> list[Record]:
    return list(Household(trial).run())


def write(records: Iterable[Record], file: Path) -> None:
    """As JSON, a line each."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w") as lines:
        for record in records:
            lines.write(json.dumps(asdict(record)) + "\n")
