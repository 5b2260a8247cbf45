"""`make soak`: an even load for a long time; memory and latency must stay as they are after the first minutes."""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.load.driving import Driver, Load
from tests.load.load import HOMES, SORTIES, add_robots, check, settle
from tests.load.robots import Home, LoadRobot, draw_homes
from tests.load.stack import Stack

SPANS = 12
"""The time is looked at in so many parts; the first third is for warming up."""
MOST_GROWTH = 0.15
"""Of a process's memory, from the second third to the last."""
MOST_SLOWER = 2.0
"""Of the median latency, likewise: a shared machine is not even."""


@dataclass(frozen=True)
class Span:
    memory_mb: dict[str, float]
    median_s: float
    p99_s: float
    missions: int


def soak(
    stack: Stack, robots: Sequence[LoadRobot], rate: float, seconds: float
) -> tuple[list[Span], list[str], list[str]]:
    """Spans, missions that were acknowledged, answers that should not be."""
    spans, acknowledged, bad = [], [], []
    for _ in range(SPANS):
        figures = Driver(stack.ports, robots, Load(rate, seconds / SPANS)).run()
        acknowledged += figures.acknowledged
        bad += figures.bad
        median, p99 = np.percentile(figures.ack_seconds, (50, 99)).tolist()
        spans.append(Span(stack.memory_mb(), median, p99, len(figures.acknowledged)))
        memory = " ".join(f"{name} {mb:.0f}" for name, mb in spans[-1].memory_mb.items())
        print(
            f"  {len(figures.acknowledged)} missions, p50 {1000 * median:.0f} ms, p99 {1000 * p99:.0f} ms; MB: {memory}",
            flush=True,
        )
    return spans, acknowledged, bad


def faults(spans: Sequence[Span]) -> list[str]:
    """What grew."""
    third = len(spans) // 3
    middle, last = spans[third : 2 * third], spans[-third:]
    found = []
    for name in middle[0].memory_mb.keys() & last[-1].memory_mb.keys():
        before, after = (float(np.median([span.memory_mb[name] for span in part])) for part in (middle, last))
        if after > before * (1 + MOST_GROWTH):
            found.append(f"memory of {name} grew from {before:.0f} to {after:.0f} MB")
    before, after = (float(np.median([span.median_s for span in part])) for part in (middle, last))
    if after > before * MOST_SLOWER:
        found.append(f"the median latency grew from {1000 * before:.0f} to {1000 * after:.0f} ms")
    return found


def run(folder: Path, homes: Sequence[Home], engine: str, rate: float, seconds: float, workers: int = 2) -> list[str]:
    """What went wrong."""
    with Stack(folder / "service", engine, 1, workers) as stack:
        robots = add_robots(stack, homes, max(int(10 * rate), 8), "soak")
        spans, acknowledged, bad = soak(stack, robots, rate, seconds)
        settle(stack)
        verified = [] if check(stack, acknowledged) else ["verify found something"]
        return [*faults(spans), *bad, *verified]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--engine", choices=("postgresql", "sqlite"), default="postgresql")
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--rate", type=float, default=8.0, help="missions a second (default: %(default)s)")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        wrong = run(Path(folder), draw_homes(HOMES, SORTIES), options.engine, options.rate, options.seconds)
    print("\n".join(wrong) if wrong else "flat")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
