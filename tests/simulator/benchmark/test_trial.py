"""A robot's missions with the owner's edits between them."""

from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from stillroom.simulator.benchmark.judging import Record
from stillroom.simulator.benchmark.running import Benchmark, read, run, write
from stillroom.simulator.benchmark.trial import Household, Trial
from stillroom.simulator.effects import Effects
from stillroom.simulator.severities import MIDDLE

CALM = replace(Effects.NONE, range_noise_m=0.01, jitter_m=0.03, jitter_deg=0.2, tracking_noise_m=0.02)


def records(effects: Effects, missions: int = 5, robot: int = 0) -> list[Record]:
    return list(Household(Trial(3, robot, missions, effects, None)).run())


def plain(record: Record) -> Record:
    """Without what depends on the machine."""
    return replace(record, core_ms=0.0)


def test_a_calm_home_keeps_its_rooms() -> None:
    found = records(CALM)
    assert [record.mission for record in found] == list(range(6))
    assert [record.outcome for record in found] == ["created"] + ["updated"] * 5
    assert not any(record.error for record in found)
    assert all(record.mean_iou > 0.9 for record in found[1:])


def test_the_owner_has_named_the_rooms_after_the_first_mission() -> None:
    household = Household(Trial(3, 0, 0, CALM, None))
    list(household.run())
    assert household.named == {room.name for room in household.robot.home.rooms}


def test_the_same_trial_comes_out_the_same() -> None:
    first, again = ([plain(record) for record in records(MIDDLE, 3, 2)] for _ in range(2))
    assert first == again


def test_missions_of_another_floor_must_be_refused() -> None:
    found = records(replace(CALM, other_floors=1.0), 4)[1:]
    assert {record.refuse for record in found} == {"other_floors"}
    for record in found:
        assert record.error == record.taken == record.silent


def test_a_late_mission_comes_after_its_successor_which_set_out_without_it() -> None:
    found = records(replace(CALM, late_uploads=1.0), 4)
    assert [record.mission for record in found] == [0, 2, 1, 4, 3]
    late = [record for record in found if "late_uploads" in record.effects]
    assert [record.mission for record in late] == [1, 3]
    assert all(
        (record.outcome, record.refuse, record.error) == ("superseded", "late_uploads", False) for record in late
    )
    assert all(record.taken for record in found if record not in late)


def test_a_robot_may_have_set_out_with_an_older_map() -> None:
    found = records(replace(CALM, stale_bases=1.0, drift_m=0.05, drift_deg=2.0), 4)
    assert ["stale_bases" in record.effects for record in found] == [False, False, True, True, True]
    assert not any(record.error for record in found)


def test_what_the_owner_and_the_service_do_changes_no_sortie(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = Trial(3, 1, 3, MIDDLE, None)
    usual, other = Household(trial), Household(trial)
    list(usual.run())
    monkeypatch.setattr("stillroom.simulator.benchmark.trial.tidy_up", lambda *_: ())
    list(other.run())
    for a, b in zip(usual.sorties, other.sorties, strict=True):
        assert a.png() == b.png()


def test_owners_look_at_new_rooms_and_with_repairs_at_wrong_ones_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stillroom.simulator.benchmark.trial.lost_and_wrong", lambda *_: (("Hall",), ()))
    looked: list[object] = []
    monkeypatch.setattr("stillroom.simulator.benchmark.trial.tidy_up", lambda *_: looked.append(1))
    for repairs, times in ((False, 1), (True, 4)):
        looked.clear()
        list(Household(Trial(3, 0, 3, CALM, None, repairs=repairs)).run())
        assert len(looked) == times


def test_sorties_are_simulated_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trial = Trial(3, 1, 2, MIDDLE, tmp_path)
    fresh = [plain(record) for record in Household(trial).run()]
    monkeypatch.setattr("stillroom.simulator.fleet.SimulatedRobot.sortie", lambda *_: pytest.fail("simulated again"))
    assert [plain(record) for record in Household(trial).run()] == fresh
    for changed in (replace(trial, robot=2), replace(trial, missions=3), replace(trial, effects=CALM)):
        with pytest.raises(pytest.fail.Exception, match="simulated again"):
            Household(changed)


def test_a_picture_of_each_error_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stillroom.simulator.benchmark.trial.lost_and_wrong", lambda *_: (("Hall",), ("Kitchen",)))
    found = list(Household(Trial(3, 0, 2, CALM, None, tmp_path)).run())
    assert all(record.silent and record.lost == ("Hall",) for record in found)
    saved = sorted(tmp_path.iterdir())
    assert [file.name for file in saved] == [f"seed3-robot00-mission0{mission}-silent.png" for mission in (1, 2)]
    height, width = cv2.imread(str(saved[0])).shape[:2]  # type: ignore[union-attr]
    assert width > 3.5 * height


def test_pictures_show_what_a_row_did_not_carry(tmp_path: Path) -> None:
    trial = Trial(1, 3, 4, MIDDLE, None, tmp_path, "transfer")
    expected = [r for r in Household(trial).run() if r.mission and (r.error or (not r.refuse and not r.transfer))]
    assert len(list(tmp_path.iterdir())) == len(expected)


def test_robots_are_spread_over_processes_and_come_out_the_same() -> None:
    benchmark = Benchmark(CALM, seeds=(3,), robots=range(2), missions=1, processes=1)
    alone = {record.robot: plain(record) for _, of_one in run(benchmark) for record in of_one if record.mission}
    spread = [of_one for _, of_one in run(replace(benchmark, processes=2))]
    assert {record.robot: plain(record) for of_one in spread for record in of_one if record.mission} == alone
    assert set(alone) == {0, 1}


def test_robots_that_are_done_are_not_run_again(tmp_path: Path) -> None:
    benchmark = Benchmark(CALM, seeds=(3,), robots=range(2), missions=1, processes=1)
    file = tmp_path / "results" / "out.jsonl"
    ((_, first), *_) = run(replace(benchmark, robots=range(1)))
    write(first, file)
    assert read(file) == first
    left = list(run(benchmark, {(record.seed, record.robot) for record in read(file)}))
    assert [(count, {record.robot for record in of_one}) for count, of_one in left] == [(0, {1})]


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.jsonl").write_text('{"seed": 1}\n')
    with pytest.raises(ValueError, match="line 1 is no mission"):
        read(tmp_path / "other.jsonl")
