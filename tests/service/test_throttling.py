"""How often something may be tried, also by many at once."""

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest

from stillroom.errors import TooMany
from stillroom.service.people.throttling import Limit, Tries, clear, forgive, network, take
from stillroom.store.database import Database

LIMIT = Limit("test", 3, timedelta(minutes=1), timedelta(hours=1), timedelta(hours=1))
OTHER = Limit("another", 100, timedelta(minutes=1), timedelta(hours=1), timedelta(hours=1))


def may(database: Database, *tries: Tries) -> bool:
    try:
        take(database, *tries)
    except TooMany:
        return False
    return True


def test_those_who_try_at_once_are_counted_one_by_one(database: Database) -> None:
    with ThreadPoolExecutor(8) as pool:
        let_through = list(pool.map(lambda _: may(database, Tries(LIMIT, ("me",))), range(16)))
    assert let_through.count(True) == 3


def test_what_is_refused_counts_nowhere_and_what_was_right_is_forgotten(database: Database) -> None:
    mine, all_ = Tries(LIMIT, ("me",)), Tries(OTHER, ("all",))
    assert [may(database, mine, all_) for _ in range(5)] == [True, True, True, False, False]
    assert may(database, Tries(LIMIT, ("you",)), all_)
    clear(database, mine)
    assert may(database, mine)
    forgive(database, mine)
    assert [may(database, mine) for _ in range(4)] == [True, True, True, False]


@pytest.mark.parametrize(
    ("address", "counted"),
    [
        ("192.0.2.9", "192.0.2.9"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        ("::ffff:192.0.2.9", "192.0.2.9"),
        ("fe80::1%eth0", "fe80::"),
        ("", ""),
    ],
)
def test_a_source_is_what_one_customer_has(address: str, counted: str) -> None:
    assert network(address) == counted
