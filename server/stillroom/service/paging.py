"""Pages of a list: one row more than asked for tells whether there is another page."""

from collections.abc import Callable, Sequence
from typing import TypeVar

RowT = TypeVar("RowT")


def page_of(rows: Sequence[RowT], limit: int, cursor: Callable[[RowT], str]) -> tuple[Sequence[RowT], str | None]:
    """The page, and the cursor of the next one (None: this is the last) from up to `limit` + 1 rows."""
    items = rows[:limit]
    return items, cursor(items[-1]) if len(rows) > limit else None
