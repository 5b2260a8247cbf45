"""Which missions a question is about."""

from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

from stillroom.errors import Fault, InvalidInput
from stillroom.store.fleet_figures import Selection

DAYS = 30
"""Without a first day, so many."""
MOST_DAYS = 3700


@dataclass(frozen=True)
class Asked:
    """As it was asked: days, or moments, whose day in UTC counts."""

    first: str | None = None
    last: str | None = None
    firmware: tuple[str, ...] = ()
    model: tuple[str, ...] = ()
    algorithm: tuple[str, ...] = ()
    size: tuple[str, ...] = ()


def selection(asked: Asked) -> Selection:
    """Both days count. Raises InvalidInput."""
    last = datetime.now(UTC).date() if asked.last is None else _day(asked.last, "/to")
    first = last - timedelta(days=DAYS - 1) if asked.first is None else _day(asked.first, "/from")
    if first > last:
        raise InvalidInput("The first day is after the last one.", (Fault("/from", f"after {last}"),))
    if (last - first).days > MOST_DAYS:
        raise InvalidInput(f"At most {MOST_DAYS} days at once.", (Fault("/from", "too long ago"),))
    return Selection(first, last, asked.firmware, asked.model, asked.algorithm, asked.size)


def _day(text: str, pointer: str) -> date:
    try:
        if len(text) == len("2026-11-22"):
            return date.fromisoformat(text)
        moment = datetime.fromisoformat(text.replace(" ", "+"))  # a + that was not encoded
        return (moment if moment.tzinfo is None else moment.astimezone(UTC)).date()
    except (ValueError, OverflowError):
        raise InvalidInput(f"{text!r} is no day.", (Fault(pointer, "neither YYYY-MM-DD nor RFC 3339"),)) from None
