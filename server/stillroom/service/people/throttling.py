"""How often something may be tried: a few times at once, then with pauses that double. Counted in the database, for all machines."""

from dataclasses import dataclass
from datetime import timedelta
from hashlib import sha256
from ipaddress import IPv6Address, ip_address

from stillroom.errors import TooMany
from stillroom.store import clock, throttle
from stillroom.store.database import Database


@dataclass(frozen=True)
class Limit:
    name: str
    free: int
    """Tries before the first pause."""
    pause: timedelta
    longest: timedelta
    forget: timedelta
    """After so long without a try, all is as at first."""


@dataclass(frozen=True)
class Tries:
    limit: Limit
    by: tuple[str, ...]

    @property
    def key(self) -> str:
        return sha256("\n".join((self.limit.name, *self.by)).encode()).hexdigest()


def take(database: Database, *tries: Tries) -> None:
    """Counts one try of each, before it is known what comes of it: those who try at once are counted, too.

    Raises TooMany where one of them has to wait; then none is counted.
    """
    with database.write(durable=False) as tx:
        now = clock.now(tx)
        throttle.clean(tx, now)
        # in one order, so that two that want the same never wait for each other
        known = {one.key: throttle.lock(tx, one.key, now) for one in sorted(tries, key=lambda one: one.key)}
        wait = max((row.open_at - now).total_seconds() for row in known.values())
        if wait > 0:
            raise TooMany("That was tried too often. Wait a little.", int(wait) + 1)
        for one in tries:
            count = known[one.key].count + 1
            open_at = now + _pause(one.limit, count)
            throttle.put(tx, one.key, count, open_at, max(open_at, now) + one.limit.forget)


def forgive(database: Database, *tries: Tries) -> None:
    """It was no vain try: as if it had not been."""
    with database.write(durable=False) as tx:
        for one in sorted(tries, key=lambda one: one.key):
            throttle.take_back(tx, one.key, clock.now(tx))


def clear(database: Database, *tries: Tries) -> None:
    with database.write(durable=False) as tx:
        for one in sorted(tries, key=lambda one: one.key):
            throttle.drop(tx, one.key)


def _pause(limit: Limit, count: int) -> timedelta:
    if count < limit.free:
        return timedelta()
    return min(limit.longest, limit.pause * (1 << min(count - limit.free, 20)))


def network(address: str) -> str:
    """What one customer of a network has for himself: an IPv4 address, or a /64 of IPv6."""
    try:
        ip = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(ip, IPv6Address):
        return str(ip.ipv4_mapped or IPv6Address(int(ip) >> 64 << 64))
    return str(ip)
