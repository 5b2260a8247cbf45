"""What the commands of the command line are made of."""

import argparse
import os
from collections.abc import Callable
from typing import Any

Command = Callable[[argparse.Namespace], int]


def add_command(commands: Any, name: str, command: Command, help_: str) -> argparse.ArgumentParser:
    added: argparse.ArgumentParser = commands.add_parser(name, help=help_, description=help_)
    added.set_defaults(command=command)
    return added


def add_service(parser: argparse.ArgumentParser) -> None:
    """Which service to call, as which robot, and which of its maps."""
    parser.add_argument("--robot", required=True, metavar="ID")
    parser.add_argument("--map", required=True, metavar="NAME", help="the robot's name of the floor")
    parser.add_argument(
        "--url",
        default=os.environ.get("STILLROOM_URL", "http://127.0.0.1:8000"),
        help="where the service is (default: STILLROOM_URL, else %(default)s)",
    )
    parser.add_argument(
        "--token",
        default=os.environ.get("STILLROOM_TOKEN"),
        help="the robot's token (default: STILLROOM_TOKEN, which keeps it out of the list of processes)",
    )


def count(text: str) -> int:
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError("must not be negative")
    return number


def positive(text: str) -> float:
    number = float(text)
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError("must be more than 0")
    return number
