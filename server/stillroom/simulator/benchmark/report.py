"""The results table: the paper's three rows, final and silent errors, fit and meta share, with intervals by robot."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from stillroom.simulator.benchmark.judging import Record

Floats = npt.NDArray[np.float64]
Told = Callable[[str], None]
_RESAMPLES = 2000
_INTERVAL = (2.5, 97.5)


@dataclass(frozen=True)
class Figure:
    """An estimate with its 95 % interval."""

    value: float
    low: float
    high: float


def report(records: Sequence[Record], told: Told) -> None:
    """Tells the whole table, then each effect's missions. A robot's first mission makes its map: it is no update."""
    records = [record for record in records if record.mission > 0]
    if not records:
        told("No updates.")
        return
    robots = len({(record.seed, record.robot) for record in records})
    told(f"{len(records)} updates by {robots} robots; 95 % intervals by robot (cluster bootstrap)\n")
    rows = [(name, figure) for name, figure in summary(records)]
    for name, figure in rows:
        told(f"{name:<34}{100 * figure.value:7.2f} %   [{100 * figure.low:.2f}, {100 * figure.high:.2f}]")
    core = np.array([record.core_ms for record in records])
    if len(core):
        told(f"{'core, ms of CPU':<34}{np.percentile(core, 50):7.1f} p50{np.percentile(core, 99):9.1f} p99")
    told(
        f"\n{'updates in which':<26}{'count':>7}{'transfer':>10}{'+ occup.':>10}{'+ divid.':>10}{'final':>9}{'silent':>9}"
    )
    for effect in sorted({effect for record in records for effect in record.effects}):
        of_it = [record for record in records if effect in record.effects]
        told(f"{effect:<26}{len(of_it):>7}" + "".join(_share(of_it, pick) for pick in _ROWS.values()))


def summary(records: Sequence[Record]) -> Iterator[tuple[str, Figure]]:
    """Every line of the table but times; values are shares."""
    for name, pick in _ROWS.items():
        picked = [(record, bad) for record in records if (bad := pick(record)) is not None]
        if picked:
            yield name, rate([bad for _, bad in picked], [record for record, _ in picked])
    yield "mean IoU of rooms", mean([record.mean_iou for record in records], records)
    shares = [record.meta_share for record in records]
    yield "meta share of boundary, median", median(shares, records)
    yield "meta share of boundary, mean", mean(shares, records)


def _row(record: Record, carried: bool) -> bool | None:
    """Whether the mission failed with that much of the system; None where it must be refused anyway."""
    return None if record.refuse else not carried


_ROWS: dict[str, Callable[[Record], bool | None]] = {
    "transfer alone": lambda r: _row(r, r.transfer),
    "+ meta-occupancy": lambda r: _row(r, r.meta_occupancy),
    "+ meta-dividers": lambda r: _row(r, r.meta_dividers),
    "final error": lambda r: r.error,
    "silent error": lambda r: r.silent,
}


def _share(records: Sequence[Record], pick: Callable[[Record], bool | None]) -> str:
    bad = [b for record in records if (b := pick(record)) is not None]
    width = 9 if pick in (_ROWS["final error"], _ROWS["silent error"]) else 10
    return f"{100 * np.mean(bad):{width}.2f}" if bad else " " * (width - 1) + "-"


def rate(bad: Sequence[bool], records: Sequence[Record]) -> Figure:
    """Share of the missions, resampled by robot; where none is bad, up to what that many missions rule out (Clopper, Pearson 1934)."""
    found = mean([float(b) for b in bad], records)
    return found if any(bad) else replace(found, high=1 - (1 - _INTERVAL[1] / 100) ** (1 / len(bad)))


def mean(values: Sequence[float], records: Sequence[Record]) -> Figure:
    """Of all missions, resampled by robot."""
    robots = _robots(records)
    sums = np.bincount(robots, values)
    counts = np.bincount(robots)
    drawn = _draws(len(counts))
    means = (drawn @ sums) / (drawn @ counts)
    return Figure(float(np.mean(values)), *np.percentile(means, _INTERVAL).tolist())


def median(values: Sequence[float], records: Sequence[Record]) -> Figure:
    """Of all missions, resampled by robot."""
    robots, order = _robots(records), np.argsort(values)
    ordered = np.asarray(values)[order]
    medians = []
    for drawn in _draws(int(robots.max()) + 1):
        weight = np.cumsum(drawn[robots[order]])
        medians.append(ordered[np.searchsorted(weight, weight[-1] / 2)])
    return Figure(float(np.median(values)), *np.percentile(medians, _INTERVAL).tolist())


def _robots(records: Sequence[Record]) -> npt.NDArray[np.int64]:
    """A number (n,) for the robot of each record."""
    keys = np.array([(record.seed, record.robot) for record in records])
    return np.asarray(np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1))


def _draws(robots: int) -> Floats:
    """How often each robot was drawn (resamples, robots), the same every time."""
    return np.random.default_rng(0).multinomial(robots, np.full(robots, 1 / robots), _RESAMPLES).astype(np.float64)
