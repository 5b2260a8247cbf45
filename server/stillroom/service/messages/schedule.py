"""When a message that failed is tried again, and when it, or its receiver, is given up."""

from collections.abc import Callable
from datetime import datetime, timedelta
from random import random

from stillroom.service.messages.attempts import Attempt
from stillroom.store.rows import DeliveryRow, ReceiverRow

MOST_ATTEMPTS = 11
"""Over three days: 5 s, 20 s, 80 s, 5 min, 21 min, 1.4 h, 6 h, 23 h, 24 h, 24 h."""
_FIRST, _FACTOR, _LONGEST = timedelta(seconds=5), 4, timedelta(hours=24)
_JITTER = 0.2
PAUSE_LONGEST = timedelta(minutes=5)
"""A receiver that fails is left alone so long at most, whatever else waits for it."""
END_AFTER = timedelta(days=5)
"""A receiver that took nothing for so long, and failed at least so often, is sent nothing any more."""
END_FAILURES = 10
SPACING = {"email": timedelta(minutes=15), "push": timedelta(minutes=1), "webhook": timedelta()}
"""So long a person is left in peace after a message; what comes meanwhile goes in the next."""


def next_try(
    row: DeliveryRow, attempt: Attempt, now: datetime, chance: Callable[[], float] = random
) -> datetime | None:
    """`row`: with this attempt counted. None: never."""
    if attempt.result != "failed" or row.attempts >= MOST_ATTEMPTS:
        return None
    wait: timedelta = min(_FIRST * _FACTOR ** (row.attempts - 1), _LONGEST)
    asked = timedelta(seconds=attempt.retry_after_s or 0.0)
    return now + max(wait * (1 - _JITTER + 2 * _JITTER * chance()), asked)


def pause(failures: int) -> timedelta:
    """How long a receiver is left alone after it failed so often on end."""
    return min(timedelta(seconds=2 ** min(failures, 20)), PAUSE_LONGEST)


def is_over(receiver: ReceiverRow, failures: int, now: datetime) -> bool:
    """Whether a receiver that has failed once more is given up. `failures`: with this one."""
    failing_since = receiver.failing_since or now
    return failures >= END_FAILURES and now - failing_since >= END_AFTER
