"""`stillroom seed-fleet`: a fleet that is made up."""

import argparse
import sys
from datetime import UTC, datetime
from typing import Any

from stillroom.arguments import add_command, count
from stillroom.settings import Settings


def add_commands(commands: Any) -> None:
    seed = add_command(
        commands,
        "seed-fleet",
        _seed,
        "Fill an empty database with a fleet that is made up: its missions as if they had been processed.",
    )
    seed.add_argument("--missions", type=count, default=1_000_000, metavar="N", help="(default: %(default)s)")
    seed.add_argument("--robots", type=count, default=10_000, metavar="N", help="(default: %(default)s)")
    seed.add_argument("--days", type=count, default=365, metavar="N", help="until today (default: %(default)s)")
    seed.add_argument("--seed", type=count, default=1, help="(default: %(default)s)")


def _seed(options: argparse.Namespace) -> int:
    from stillroom.errors import StillroomError
    from stillroom.service.fleet.seeding import Seed, seed_fleet
    from stillroom.store.database import Database
    from stillroom.store.migrate import migrate

    if not (options.missions and options.robots and options.days):
        print("stillroom: a fleet has missions, robots and days", file=sys.stderr)
        return 1
    database = Database(Settings.from_environment().database_url)
    migrate(database)
    what = Seed(options.missions, options.robots, options.days, options.seed, datetime.now(UTC).date())
    try:
        seed_fleet(database, what, lambda text: print(text, file=sys.stderr, flush=True))
    except StillroomError as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    return 0
