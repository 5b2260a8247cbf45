"""A few seconds of `make soak`; memory is not judged, for a process grows when it starts."""

from pathlib import Path

from tests.load import soak
from tests.load.driving import Driver, Load
from tests.load.load import add_robots, check, settle
from tests.load.robots import draw_homes
from tests.load.stack import Stack


def test_robots_that_retry_repeat_and_come_late_leave_nothing_wrong(tmp_path: Path) -> None:
    with Stack(tmp_path / "service", "sqlite", 1, 1) as stack:
        robots = add_robots(stack, draw_homes(2, 4), 4, "soak")
        load = Load(6.0, 3.0, twice=0.3, late=0.3)
        figures = Driver(stack.ports, robots, load).run()
        settle(stack)
        assert figures.bad == []
        assert len({mission.rpartition("/missions/")[0] for mission in figures.acknowledged}) == 4
        assert len(figures.acknowledged) == len(set(figures.acknowledged)) >= 4
        assert check(stack, figures.acknowledged)
        assert stack.memory_mb()


def test_growth_is_noticed_and_noise_is_not() -> None:
    def spans(*memory: float) -> list[soak.Span]:
        return [soak.Span({"server": mb}, 0.1, 0.2, 10) for mb in memory]

    assert soak.faults(spans(90, 150, 160, 161, 162, 160, 163, 161, 165)) == []
    (found,) = soak.faults(spans(90, 150, 160, 170, 180, 190, 200, 210, 220))
    assert "memory of server" in found
    slower = [soak.Span({}, seconds, 0.2, 10) for seconds in (0.1, 0.1, 0.1, 0.1, 0.3, 0.3)]
    assert len(soak.faults(slower)) == 1
