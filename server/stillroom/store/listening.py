"""Listens to PostgreSQL for what other processes of the service did (LISTEN/NOTIFY)."""

import os
import select
import threading
from collections.abc import Callable
from time import monotonic
from typing import Any

import psycopg
import sqlalchemy as sa
import structlog

from stillroom.store.hints import CHANNEL, Hint, decode

RETRY_S = 1.0
_KEEPALIVES: dict[str, Any] = {
    "keepalives_idle": 20,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "connect_timeout": 10,
}
"""Seconds after which a server that has vanished without a word is given up."""

log = structlog.get_logger()


class Listener:
    """A thread that passes hints on until `stop`.

    Whatever ends its connection, it connects again; since hints may have been missed meanwhile, `caught_up` is called after
    every connection that is made.
    """

    def __init__(self, url: sa.URL, hear: Callable[[Hint], None], caught_up: Callable[[], None]) -> None:
        self._url = url
        self._hear = hear
        self._caught_up = caught_up
        self._stopped_out, self._stopped_in = os.pipe()
        self._thread = threading.Thread(target=self._run, name="listener", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        os.close(self._stopped_in)
        self._thread.join()
        os.close(self._stopped_out)

    def _run(self) -> None:
        stopped = False
        while not stopped:
            began = monotonic()
            try:
                with _connect(self._url) as connection:
                    connection.execute(f"LISTEN {CHANNEL}")
                    self._caught_up()
                    self._follow(connection)
                    return
            except psycopg.Error as error:
                log.warning("not listening to the database; trying again", cause=str(error))
            pause = max(RETRY_S - (monotonic() - began), 0.0)
            stopped = bool(select.select([self._stopped_out], [], [], pause)[0])

    def _follow(self, connection: psycopg.Connection[Any]) -> None:
        while True:
            for notification in connection.notifies(timeout=0):
                hint = decode(notification.payload)
                if hint is not None:
                    self._hear(hint)
            readable, _, _ = select.select([connection.fileno(), self._stopped_out], [], [])
            if self._stopped_out in readable:
                return


def _connect(url: sa.URL) -> psycopg.Connection[Any]:
    arguments, options = url.get_dialect()().create_connect_args(url)
    return psycopg.connect(*arguments, autocommit=True, **(_KEEPALIVES | dict(options)))
