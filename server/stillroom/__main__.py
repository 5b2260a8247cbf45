"""The command line."""

import argparse
import json
import os
import secrets
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from stillroom import (
    __version__,
    file_commands,
    fleet_commands,
    logs,
    privacy_commands,
    simulation_commands,
    upkeep_commands,
)
from stillroom.arguments import Command, add_command, count, positive
from stillroom.settings import InvalidSetting, Settings


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    logs.configure()
    command: Command = options.command
    try:
        return command(options)
    except InvalidSetting as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(
        prog="stillroom",
        description="Keeps a home's rooms still while the robot's map under them moves.",
        epilog="Settings come from the environment: STILLROOM_DATA_DIR, STILLROOM_DATABASE_URL, STILLROOM_GRID_STORE_URL, "
        "STILLROOM_ADMIN_TOKEN, STILLROOM_RESOLVERS; those of e-mail and webhooks are in docs/messages.md.",
    )
    top.add_argument("--version", action="version", version=f"stillroom {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    _add_service(commands)
    _add_people(commands)
    file_commands.add_commands(commands)
    privacy_commands.add_commands(commands)
    _add_simulation(commands)
    simulation_commands.add_commands(commands)
    fleet_commands.add_commands(commands)
    upkeep_commands.add_commands(commands)
    return top


def _add_service(commands: Any) -> None:
    serve = add_command(commands, "serve", _serve, "Run the service: API, web app and workers.")
    serve.add_argument("--host", default="127.0.0.1", help="address to listen on (default: %(default)s)")
    serve.add_argument("--port", type=int, default=8000, help="(default: %(default)s)")
    serve.add_argument("--workers", type=count, help="processes that process missions (default: one a core)")
    add_command(commands, "migrate", _migrate, "Bring the database to the newest schema.")
    add_command(commands, "openapi", _openapi, "Print the API's schema; needs no database.")


def _add_people(commands: Any) -> None:
    group = commands.add_parser("robots", help="Register robots.", description="Register robots.")
    robots = group.add_subparsers(required=True, metavar="COMMAND")
    add = add_command(robots, "add", _add_robot, "Register a robot and print its token, this once.")
    add.add_argument("id")
    add.add_argument("--name", help="what people call it (default: its id)")
    add.add_argument("--owner", metavar="EMAIL", help="whose it is (default: nobody's yet; operators look after it)")
    link = add_command(
        commands, "login-link", _login_link, "Print a link that signs a browser in, once, within 24 hours."
    )
    link.add_argument("--owner", metavar="EMAIL", help="sign in as this owner (default: as an operator)")
    link.add_argument("--url", default="http://127.0.0.1:8000", help="where the service is (default: %(default)s)")


def _add_simulation(commands: Any) -> None:
    demo = add_command(
        commands, "demo", _demo, "Run the service with simulated homes whose robots upload missions to it."
    )
    demo.add_argument("--host", default="127.0.0.1", help="address to listen on (default: %(default)s)")
    demo.add_argument("--port", type=int, default=8000, help="(default: %(default)s)")
    demo.add_argument("--workers", type=count, help="processes that process missions (default: one a core)")
    simulate = add_command(
        commands,
        "simulate",
        _simulate,
        "Simulate robots that map homes and upload missions to a service, and owners who name their rooms.",
    )
    simulate.add_argument(
        "--url",
        default=os.environ.get("STILLROOM_URL", "http://127.0.0.1:8000"),
        help="where the service is (default: STILLROOM_URL, else %(default)s)",
    )
    simulate.add_argument(
        "--token",
        default=os.environ.get("STILLROOM_ADMIN_TOKEN"),
        help="an operator's (default: STILLROOM_ADMIN_TOKEN, which keeps it out of the list of processes)",
    )
    add_command(commands, "bench", _bench, "Measure the pipeline's stages, an upload over HTTP, and uploads a second.")
    for command in (demo, simulate):
        command.add_argument("--homes", type=count, default=3, metavar="N", help="(default: %(default)s)")
        command.add_argument(
            "--every",
            type=positive,
            default=5.0,
            metavar="SECONDS",
            help="from one mission of a robot to its next (default: %(default)s)",
        )
    simulate.add_argument("--missions", type=count, metavar="N", help="of each robot (default: until it is stopped)")
    simulate.add_argument("--seed", type=count, default=1, help="of homes and robots (default: %(default)s)")
    simulate.add_argument(
        "--resolution", type=positive, default=0.05, metavar="M", help="metres a cell (default: %(default)s)"
    )
    simulate.add_argument("--score", action="store_true", help="tell how well each map fits its home")
    simulate.add_argument("--quiet", action="store_true", help="tell only what goes wrong")


def _serve(options: argparse.Namespace) -> int:
    from stillroom.serving import default_workers, serve

    workers = default_workers() if options.workers is None else options.workers
    serve(Settings.from_environment(), options.host, options.port, workers)
    return 0


def _demo(options: argparse.Namespace) -> int:
    from stillroom.demo import demo
    from stillroom.serving import default_workers

    workers = default_workers() if options.workers is None else options.workers
    settings = Settings.from_environment()
    if settings.admin_token is None:
        settings = replace(settings, admin_token=secrets.token_urlsafe(24))
        print(f"Operator token of this run: {settings.admin_token} (STILLROOM_ADMIN_TOKEN, where set, is used instead)")
    demo(settings, options.host, options.port, workers, options.homes, options.every)
    return 0


def _simulate(options: argparse.Namespace) -> int:
    from stillroom.simulator.client import Refused
    from stillroom.simulator.running import Simulation, simulate
    from stillroom.uploading import UploadFailed

    if not options.token:
        print("stillroom: give --token or STILLROOM_ADMIN_TOKEN", file=sys.stderr)
        return 1
    simulation = Simulation(
        url=options.url,
        operator_token=options.token,
        state=Settings.from_environment().data_dir / "simulator.json",
        homes=options.homes,
        every_s=options.every,
        missions=options.missions,
        seed=options.seed,
        resolution=options.resolution,
        score=options.score,
    )
    told = _nothing if options.quiet else partial(print, flush=True)
    try:
        simulate(simulation, told, partial(_progress, ""))
    except (Refused, UploadFailed) as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    return 0


def _bench(_options: argparse.Namespace) -> int:
    from stillroom.simulator.bench import Bench, bench

    bench(Bench(), partial(print, flush=True))
    return 0


def _nothing(_text: str) -> None:
    pass


def _migrate(_options: argparse.Namespace) -> int:
    from stillroom.store.database import Database
    from stillroom.store.migrate import migrate

    migrate(Database(Settings.from_environment().database_url))
    return 0


def _openapi(_options: argparse.Namespace) -> int:
    from stillroom.app import create_app

    print(json.dumps(create_app(Settings.from_environment()).openapi(), indent=2, sort_keys=True))
    return 0


def _add_robot(options: argparse.Namespace) -> int:
    from pydantic import ValidationError

    from stillroom.documents.api import NewRobot
    from stillroom.errors import StillroomError
    from stillroom.service.robots import add_robot
    from stillroom.store.database import Database
    from stillroom.store.migrate import migrate

    try:
        new = NewRobot(id=options.id, name=options.name, owner=options.owner)
        database = Database(Settings.from_environment().database_url)
        migrate(database)
        made = add_robot(database, new)
    except (StillroomError, ValidationError) as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    print(made.token)
    return 0


def _login_link(options: argparse.Namespace) -> int:
    from stillroom.service.accounts import new_login_link
    from stillroom.store.database import Database
    from stillroom.store.migrate import migrate

    database = Database(Settings.from_environment().database_url)
    migrate(database)
    print(f"{options.url.rstrip('/')}/login?token={new_login_link(database, options.owner)}")
    return 0


def _progress(place: str, text: str) -> None:
    print(place + text, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
