"""Commands for those who run the service: verify."""

import argparse
import json
import sys
from datetime import timedelta
from pathlib import Path
from typing import Any

from stillroom.arguments import add_command, count
from stillroom.settings import Settings


def add_commands(commands: Any) -> None:
    verify = add_command(
        commands,
        "verify",
        _verify,
        "Check by database and grid store alone that every mission was processed once and in order, that versions form one "
        "chain, that the fleet's figures equal a recount, that every grid is there and whole. Prints a report as JSON; ends with "
        "1 where something does not hold. The service may run meanwhile.",
    )
    verify.add_argument(
        "--acknowledged",
        type=Path,
        metavar="FILE",
        help="missions that must be there: a path (the Location of an upload's answer) a line",
    )
    verify.add_argument("--quick", action="store_true", help="look for grids without reading them")
    verify.add_argument(
        "--grace",
        type=count,
        default=3600,
        metavar="SECONDS",
        help="so old may a grid be that nothing refers to (default: %(default)s)",
    )


def _verify(options: argparse.Namespace) -> int:
    from stillroom.errors import Unavailable
    from stillroom.service.verifying import verify
    from stillroom.store.database import Database
    from stillroom.store.grids import GridStore

    settings = Settings.from_environment()
    acknowledged = options.acknowledged.read_text().split() if options.acknowledged is not None else []
    database = Database(settings.database_url)
    try:
        grids = GridStore(settings.grid_store_url)
        report = verify(database, grids, acknowledged, not options.quick, timedelta(seconds=options.grace))
    except Unavailable as error:
        print(f"stillroom: {error.detail} {error.__cause__ or ''}", file=sys.stderr)
        return 2
    finally:
        database.dispose()
    print(json.dumps(report.as_json(), indent=1))
    return 0 if report.holds else 1
