"""The results table."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stillroom.simulator.benchmark.judging import Record
from stillroom.simulator.benchmark.report import mean, median, report, summary

GOOD = Record(
    1, 0, 1, (), None, "updated", True, "transfer", True, True, True, False, False, 0.95, 0.0, (), (), 9.0, ""
)
FAILED = {"transfer": False, "meta_occupancy": False, "meta_dividers": False, "taken": False, "error": True}


def fleet(robots: int = 10, missions: int = 10, **other: Any) -> list[Record]:
    """Good missions; `r3m2={...}` is what is different about mission 2 of robot 3."""
    return [
        replace(GOOD, robot=robot, mission=mission, **other.get(f"r{robot}m{mission}", {}))
        for robot in range(robots)
        for mission in range(1, missions + 1)
    ]


def shares(records: list[Record]) -> dict[str, float]:
    return {name: figure.value for name, figure in summary(records)}


def test_each_row_counts_the_missions_that_so_much_of_the_system_does_not_carry() -> None:
    found = shares(
        fleet(
            r0m1={"transfer": False},
            r0m2={"transfer": False, "meta_occupancy": False},
            r1m1=FAILED,
            r2m1={"error": True, "silent": True},
        )
    )
    assert found["transfer alone"] == pytest.approx(0.03)
    assert found["+ meta-occupancy"] == pytest.approx(0.02)
    assert found["+ meta-dividers"] == pytest.approx(0.01)
    assert found["final error"] == pytest.approx(0.02)
    assert found["silent error"] == pytest.approx(0.01)
    assert found["mean IoU of rooms"] == pytest.approx(0.95)


def test_missions_that_must_be_refused_are_errors_where_they_are_taken_and_in_no_row() -> None:
    wreck = {"refuse": "slam_failures", "transfer": False, "meta_occupancy": False, "meta_dividers": False}
    refused, taken = fleet(r0m1=wreck | {"taken": False}), fleet(r0m1=wreck | {"error": True, "silent": True})
    assert shares(refused)["transfer alone"] == shares(refused)["final error"] == 0.0
    assert shares(taken)["transfer alone"] == 0.0
    assert shares(taken)["silent error"] == pytest.approx(0.01)


def test_intervals_are_as_wide_as_robots_differ() -> None:
    spread = fleet(10, 10, **{f"r{robot}m1": FAILED for robot in range(10)})
    heaped = fleet(10, 10, **{f"r0m{mission}": FAILED for mission in range(1, 11)})
    by_robot, of_one = (mean([float(record.error) for record in records], records) for records in (spread, heaped))
    assert by_robot.value == of_one.value == pytest.approx(0.1)
    assert (by_robot.low, by_robot.high) == pytest.approx((0.1, 0.1))
    assert of_one.low == 0.0
    assert of_one.high > 0.2


def test_the_interval_of_a_mean_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(60):
        values = rng.normal(0.0, 1.0, (30, 1)) + rng.normal(0.0, 0.3, (30, 5))
        figure = mean(values.ravel().tolist(), fleet(30, 5))
        held += figure.low <= 0.0 <= figure.high
    assert held >= 50


def test_no_error_at_all_does_not_mean_that_there_is_none() -> None:
    figure = dict(summary(fleet()))["final error"]
    assert (figure.value, figure.low) == (0.0, 0.0)
    assert figure.high == pytest.approx(1 - 0.025 ** (1 / 100), rel=0.01), "of 100 missions (Clopper and Pearson)"


def test_the_median_is_of_missions() -> None:
    records = fleet(5, 3)
    figure = median([0.0] * 8 + [1.0] * 7, records)
    assert figure.value == 0.0
    assert figure.low == 0.0
    assert figure.high == 1.0


def test_the_table_leaves_first_missions_out_and_tells_each_effect() -> None:
    records = fleet(4, 5, r1m2={"effects": ("gaps",)} | FAILED, r2m2={"effects": ("doors", "gaps")})
    first = [replace(GOOD, robot=robot, mission=0, error=True) for robot in range(4)]
    lines: list[str] = []
    report(first + records, lines.append)
    assert lines[0].startswith("20 updates by 4 robots")
    rows = {line.split()[0]: line.split() for line in "\n".join(lines).splitlines() if line}
    assert rows["gaps"][1:] == ["2", "50.00", "50.00", "50.00", "50.00", "0.00"]
    assert rows["doors"][1:] == ["1", "0.00", "0.00", "0.00", "0.00", "0.00"]


def test_a_benchmark_without_updates_says_so() -> None:
    lines: list[str] = []
    report([replace(GOOD, mission=0)], lines.append)
    assert lines == ["No updates."]
