"""Whether people are sent a message about a question: once for each cause. What was dismissed stays so, unless it gets worse."""

from collections.abc import Iterable
from datetime import datetime, timedelta

from stillroom.pipeline.scores import RoomScore
from stillroom.store.rows import ConflictRow

UNANSWERED = timedelta(days=7)
"""So long nobody is told again about a question that ended without an answer."""
WORSE_BY = 0.1
"""Of a room's overlap: what people see at a glance, and more than a robot's maps differ by from day to day."""


def is_quiet(rooms: Iterable[RoomScore], told: ConflictRow | None, now: datetime) -> bool:
    """Whether nobody is told about a conflict of these rooms.

    `told`: the last one about the same that people were told of, which has ended.
    """
    return told is not None and _was_dismissed(told, now) and not _is_worse(rooms, told)


def _was_dismissed(told: ConflictRow, now: datetime) -> bool:
    """Refused or put off; or nobody answered, and it was not long ago."""
    if told.response is not None:
        return told.response in ("reject", "temporary")
    settled_with_another = told.state == "superseded" and told.superseded_by == told.mission
    return not settled_with_another and told.decided_at is not None and told.decided_at > now - UNANSWERED


def _is_worse(rooms: Iterable[RoomScore], told: ConflictRow) -> bool:
    """A room has lost clearly more of its overlap than when people were told, or fails now and did not then."""
    before = {room["id"]: room for room in told.rooms}
    return any(
        room.id not in before
        or (before[room.id]["passed"] and not room.passed)
        or min(room.precision, room.recall) < min(before[room.id]["precision"], before[room.id]["recall"]) - WORSE_BY
        for room in rooms
    )
