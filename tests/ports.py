"""Ports for servers of tests. Below those that systems give to outgoing connections, which could take one before its server does."""

import random
import socket
from collections.abc import Iterator
from itertools import islice

_LOWEST, _HIGHEST = 10_000, 32_000


def _free() -> Iterator[int]:
    """One after the other, from a beginning that differs between processes: none is given twice."""
    port = random.SystemRandom().randrange(_LOWEST, _HIGHEST)
    while True:
        port = port + 1 if port < _HIGHEST else _LOWEST
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        yield port


_ports = _free()


def free_port() -> int:
    return next(_ports)


def free_ports(count: int) -> list[int]:
    return list(islice(_ports, count))
