"""`stillroom demo`: the service on its own, with simulated homes whose robots upload to it from another process."""

import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import structlog

from stillroom.serving import serve
from stillroom.settings import Settings

_STOP_S = 5


def demo(settings: Settings, host: str, port: int, worker_count: int, homes: int, every_s: float) -> None:
    """Until SIGINT or SIGTERM; stops the simulation with it. The settings have an operator token."""
    here = "127.0.0.1" if host in ("0.0.0.0", "::", "") else host
    url = f"http://{f'[{here}]' if ':' in here else here}:{port}"
    # a line for each request of the robots would soon carry the address off the screen
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
    with simulation(settings, url, homes, every_s):
        serve(settings, host, port, worker_count)


@contextmanager
def simulation(settings: Settings, url: str, homes: int, every_s: float) -> Iterator[None]:
    """`stillroom simulate` as a child that Ctrl-C does not reach: it ends with the block."""
    command = [sys.executable, "-m", "stillroom", "simulate", "--quiet"]
    options = ["--url", url, "--homes", str(homes), "--every", str(every_s)]
    environment = os.environ | {
        "STILLROOM_ADMIN_TOKEN": settings.admin_token or "",
        "STILLROOM_DATA_DIR": str(settings.data_dir),
    }
    child = subprocess.Popen([*command, *options], env=environment, start_new_session=True)
    try:
        yield
    finally:
        child.terminate()
        try:
            child.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
