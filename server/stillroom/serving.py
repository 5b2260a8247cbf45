"""`stillroom serve`: the API in this process, the workers in processes of their own."""

import os
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from socket import socket
from types import FrameType

import structlog
import uvicorn

from stillroom import garbage
from stillroom.app import create_app
from stillroom.service.accounts import has_operator, new_login_link
from stillroom.service.signals import Signals
from stillroom.service.workers import Workers
from stillroom.settings import Settings
from stillroom.store import migrate
from stillroom.store.database import Database

GRACE_S = 5
KEEP_ALIVE_S = 75
"""Longer than proxies keep a connection that they don't use: they should be the ones who end it."""

log = structlog.get_logger()


class _Server(uvicorn.Server):
    """Says when it listens; ends event streams when asked to stop, which would otherwise keep it from ending."""

    def __init__(self, config: uvicorn.Config, signals: Signals, listening: Callable[[], None]) -> None:
        super().__init__(config)
        self._signals = signals
        self._listening = listening

    async def startup(self, sockets: list[socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._listening()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        self._signals.close()
        super().handle_exit(sig, frame)


def default_workers() -> int:
    """One a core that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def serve(settings: Settings, host: str, port: int, worker_count: int) -> None:
    """Until SIGINT or SIGTERM. Brings the database to the newest schema first."""
    if not settings.messaging.public_url:
        settings = replace(settings, messaging=replace(settings.messaging, public_url=_url(host, port)))
    database = Database(settings.database_url)
    migrate.migrate(database)
    signals = Signals()
    app = create_app(settings, signals)
    workers = Workers(
        settings.database_url,
        settings.grid_store_url,
        settings.resolvers,
        worker_count,
        signals.hear,
        settings.messaging,
    )
    signals.wake_workers, signals.wake_messenger = workers.wake, workers.wake_messenger
    config = uvicorn.Config(
        app,
        host=host,
        port=port,
        log_level="warning",
        timeout_graceful_shutdown=GRACE_S,
        timeout_keep_alive=KEEP_ALIVE_S,
        server_header=False,
    )
    link = None if has_operator(database) else new_login_link(database)
    garbage.keep_what_is_there()
    server = _Server(config, signals, partial(announce, host, port, link, settings))
    signal.signal(signal.SIGTERM, _end)
    try:
        server.run()
    finally:
        workers.stop()
        database.dispose()


def _end(_signal: int, _frame: FrameType | None) -> None:
    """uvicorn raises the signal that ended it once more; without this the workers would not be waited for."""
    sys.exit(0)


def announce(host: str, port: int, link_secret: str | None, settings: Settings) -> None:
    base = _url(host, port)
    print(f"stillroom serves {base}", flush=True)
    if link_secret is not None:  # afterwards operators sign in like everybody else
        print(f"Sign in, once, with this link: {base}/login?token={link_secret}", flush=True)
    if settings.admin_token is None:
        print("No operator token: set STILLROOM_ADMIN_TOKEN to use the API as an operator.", flush=True)


def _url(host: str, port: int) -> str:
    shown = "127.0.0.1" if host in ("0.0.0.0", "::", "") else host
    return f"http://{f'[{shown}]' if ':' in shown else shown}:{port}"
