"""People are sent one message a cause: repeats fold, and what was dismissed stays so unless it gets worse."""

from dataclasses import replace
from datetime import timedelta
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom.service.quiet import UNANSWERED, WORSE_BY
from stillroom.service.signals import Signals
from stillroom.store.hints import Hint
from stillroom.store.tables import ending, mission, outbox
from tests.conflicts import Answer, Core, expect, rejected, score, send, shown, told
from tests.conftest import RobotCaller, Service


def seen_as(key: str, *recalls: float) -> Answer:
    """A mission that is not taken: rooms r1, r2, … kept so much."""
    scores = [score(f"r{n}", recall) for n, recall in enumerate(recalls, 1)]
    plan = rejected(key, scores=tuple(scores), rooms=tuple(s.id for s in scores))

    def answer(*asked: Any) -> Any:
        update = plan(*asked)
        return replace(update, conflicts=tuple(replace(c, rooms=tuple(scores)) for c in update.conflicts))

    return answer


def decide(service: Service, robot: RobotCaller, key: str, response: str) -> None:
    expect(service.operator.request("POST", f"{robot.path()}/conflicts/{key}/decision", json={"response": response}))


def opened(service: Service) -> dict[str, bool]:
    """Conflicts that were opened, and whether nobody is told."""
    return {e["conflict"]: e["quiet"] for e in told(service) if e["kind"] == "conflict" and e["state"] == "open"}


def test_a_repeat_folds_without_another_message(service: Service, mapped: RobotCaller, core: Core) -> None:
    for number in range(1, 5):
        core.planned[str(number)] = seen_as(f"c{number}", 0.41 - number / 20)  # even where it gets worse
        send(mapped, str(number))
    assert opened(service) == {"c1": False}
    assert shown(mapped, "c1")["fold_count"] == 3


def test_what_was_refused_stays_dismissed_unless_it_gets_worse(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    core.planned |= {
        "1": seen_as("c1", 0.41),
        "2": seen_as("c2", 0.41 - WORSE_BY + 0.01),  # a little, and then a little more, is in the end much
        "3": seen_as("c3", 0.41 - WORSE_BY - 0.01),
        "4": seen_as("c4", 0.41 - WORSE_BY - 0.02),
    }
    for number in range(1, 5):
        send(mapped, str(number))
        decide(service, mapped, f"c{number}", "reject")
    assert opened(service) == {"c1": False, "c2": True, "c3": False, "c4": True}
    assert [shown(mapped, f"c{number}")["quiet"] for number in range(1, 5)] == [False, True, False, True]


def test_another_room_that_fails_is_worse(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned |= {"1": seen_as("c1", 0.41, 0.55), "2": seen_as("c2", 0.41, 0.53), "3": seen_as("c3", 0.41, 0.49)}
    for number in range(1, 4):
        send(mapped, str(number))
        decide(service, mapped, f"c{number}", "reject")
    assert opened(service) == {"c1": False, "c2": True, "c3": False}


def test_what_was_accepted_is_told_where_it_comes_again(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned |= {"1": seen_as("c1", 0.41), "2": seen_as("c2", 0.41)}
    send(mapped, "1")
    decide(service, mapped, "c1", "accept")
    send(mapped, "2")
    assert opened(service) == {"c1": False, "c2": False}


def test_what_was_put_off_is_not_asked_again_for_a_week(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned |= {
        "1": seen_as("c1", 0.41),
        "2": seen_as("c2", 0.11),
        "3": seen_as("c3", 0.41),
        "4": seen_as("c4", 0.2),
    }
    send(mapped, "1")
    decide(service, mapped, "c1", "temporary")
    send(mapped, "2")
    assert opened(service) == {"c1": False}
    pass_time(service, timedelta(days=8))
    send(mapped, "3")  # asked, and no worse than when it was put off
    assert opened(service) == {"c1": False, "c3": True}
    decide(service, mapped, "c3", "reject")
    send(mapped, "4")
    assert opened(service) == {"c1": False, "c3": True, "c4": False}


def test_a_question_that_comes_and_goes_is_told_once_a_week(service: Service, mapped: RobotCaller, core: Core) -> None:
    core.planned |= {str(number): seen_as(f"c{number}", 0.41) for number in (1, 3, 5)}
    for number in range(1, 5):
        send(mapped, str(number))  # every other mission sees the room as it was
    assert opened(service) == {"c1": False, "c3": True}
    assert shown(mapped, "c1")["state"] == "superseded"
    pass_time(service, UNANSWERED + timedelta(hours=1))
    send(mapped, "5")
    assert opened(service) == {"c1": False, "c3": True, "c5": False}


def pass_time(service: Service, time: timedelta) -> None:
    """As if all that happened were so much longer ago."""
    with service.database.write() as tx:
        for table, moment in ((ending, ending.c.decided_at), (mission, mission.c.finished_at)):
            (key,) = table.primary_key
            for row in tx.execute(sa.select(key.label("key"), moment.label("moment"))).all():
                tx.execute(sa.update(table).where(key == row.key).values({moment.name: row.moment - time}))


def test_nobody_is_asked_twice_where_another_answer_of_the_same_mission_settled_it(
    service: Service, mapped: RobotCaller, core: Core
) -> None:
    both = rejected("c1")

    def answer(*asked: Any) -> Any:
        update = both(*asked)
        return replace(update, conflicts=(*update.conflicts, replace(update.conflicts[0], id="c2", kind="drift")))

    core.planned |= {"1": answer, "2": rejected("c3", kind="drift")}
    send(mapped, "1")
    decide(service, mapped, "c1", "accept")
    assert shown(mapped, "c2")["state"] == "superseded"
    send(mapped, "2")  # about the map that was accepted: that is news
    assert opened(service) == {"c1": False, "c2": False, "c3": False}


def test_an_event_is_in_the_outbox_exactly_where_its_change_was_committed(
    service: Service, mapped: RobotCaller, core: Core, monkeypatch: pytest.MonkeyPatch
) -> None:
    def waiting() -> int:
        with service.database.read() as tx:
            return tx.execute(sa.select(sa.func.count()).select_from(outbox)).scalar_one()

    before, seen = waiting(), len(told(service))
    assert before == seen
    core.planned["1"] = seen_as("c1", 0.41)
    send(mapped, "1")
    assert waiting() - before == len(told(service)) - seen == 2
    monkeypatch.setattr("stillroom.store.events.tell", broken)
    refused = service.operator.edit(mapped.path(), 1, {"op": "rename_room", "id": "r1", "name": "Kitchen"})
    assert refused.status_code == 500
    assert waiting() - before == len(told(service)) - seen == 2


def broken(*_: object) -> None:
    raise RuntimeError("the last step of a transaction fails")


def test_the_messenger_hears_that_there_is_something_to_tell() -> None:
    rung: list[str] = []
    signals = Signals(lambda: rung.append("work"), lambda: rung.append("message"))
    signals.hear(Hint("message", 1))
    assert rung == ["message"]
    signals.catch_up()
    assert rung == ["message", "work", "message"]
