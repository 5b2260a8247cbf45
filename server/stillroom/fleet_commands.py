"""`stillroom seed-fleet`: a fleet that is made up; `stillroom replay`: stored missions run again."""

import argparse
import json
import sys
from datetime import UTC, datetime
from typing import Any

from stillroom.arguments import add_command, count
from stillroom.settings import RESOLVER_CHOICES, Settings


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
    replay = add_command(
        commands,
        "replay",
        _replay,
        "Run stored missions again with the code of today or other parameters, without touching any map, and keep what differs.",
    )
    replay.add_argument("name", help="what it is called from now on")
    replay.add_argument("--resume", action="store_true", help="go on with the one of that name")
    replay.add_argument(
        "--resolvers",
        choices=tuple(RESOLVER_CHOICES),
        default="meta_occupancy,meta_dividers",
        help="(default: %(default)s)",
    )
    replay.add_argument(
        "--set", action="append", default=[], metavar="PARAM=VALUE", help="a threshold of pipeline/params.py, as JSON"
    )
    replay.add_argument("--since", type=_day, metavar="DAY", help="missions processed from this day on (UTC)")
    replay.add_argument("--until", type=_day, metavar="DAY", help="missions processed before this day")
    replay.add_argument("--robot", action="append", default=[], metavar="ID", help="these robots alone")
    replay.add_argument("--processes", type=count, metavar="N", help="(default: one a core)")
    replay.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster that runs it instead of processes here"
    )


def _day(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


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


def _replay(options: argparse.Namespace) -> int:
    from stillroom.errors import StillroomError
    from stillroom.service.fleet import replaying, replays
    from stillroom.serving import default_workers
    from stillroom.store.database import Database
    from stillroom.store.migrate import migrate

    settings = Settings.from_environment()
    database = Database(settings.database_url)
    migrate(database)
    processes, scheduler = options.processes or default_workers(), options.scheduler
    try:
        what = replaying.Replay(
            options.name,
            RESOLVER_CHOICES[options.resolvers],
            _parameters(options.set),
            options.since,
            options.until,
            tuple(options.robot),
        )
        row, maps = replaying.start(database, what, options.resume)
        engine = replaying.pool(processes) if scheduler is None else replaying.cluster(scheduler)
        with engine as (executor, at_once):
            replaying.run(database, settings.grid_store_url, row, maps, executor, at_once, _tell_progress)
    except (StillroomError, ValueError) as error:
        print(f"stillroom: {error}", file=sys.stderr)
        for fault in getattr(error, "faults", ()):
            print(f"  {fault.pointer}: {fault.detail}", file=sys.stderr)
        return 1
    print(f"{'':16}{'both':>8}{'only old':>10}{'only new':>10}{'neither':>9}{'p':>10}")
    for table in replays.results(database, options.name).tables:
        counts = f"{table.both:8}{table.only_old:10}{table.only_new:10}{table.neither:9}"
        print(f"{table.measure:16}{counts}{table.p:10.2g}")
    return 0


def _parameters(given: list[str]) -> dict[str, Any]:
    """Raises ValueError."""
    found = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            raise ValueError(f"{text!r} is not PARAM=VALUE")
        try:
            found[name] = json.loads(value)
        except json.JSONDecodeError:
            raise ValueError(f"the value of {name} is no JSON: {value}") from None
    return found


def _tell_progress(done: int, total: int) -> None:
    if sys.stderr.isatty():
        print(f"\r{done:,} of {total:,} missions ", end="" if done < total else "\n", file=sys.stderr, flush=True)
