"""`stillroom benchmark`: the results table, of simulated fleets."""

import argparse
import sys
from pathlib import Path
from typing import Any

from stillroom.arguments import add_command, count


def add_commands(commands: Any) -> None:
    benchmark = add_command(
        commands,
        "benchmark",
        _benchmark,
        "Rates of errors over simulated fleets whose homes are known; no service is needed.",
    )
    benchmark.add_argument("--robots", type=count, default=25, metavar="N", help="for each seed (default: %(default)s)")
    benchmark.add_argument(
        "--missions",
        type=count,
        default=17,
        metavar="N",
        help="of each robot, after the first, which makes its map (default: %(default)s)",
    )
    benchmark.add_argument(
        "--seeds", type=_seeds, default=(1,), metavar="N|LIST", help="how many, or which: 3,7 or 5-9 (default: 1)"
    )
    benchmark.add_argument(
        "--severity", choices=("mild", "middle", "hard"), default="middle", help="(default: %(default)s)"
    )
    benchmark.add_argument("--only", type=_names, metavar="EFFECT,...", help="these effects alone")
    benchmark.add_argument("--without", type=_names, metavar="EFFECT,...", help="all effects but these")
    benchmark.add_argument("--robot", type=count, metavar="I", help="this robot of each seed alone")
    benchmark.add_argument("--processes", type=count, default=2, metavar="N", help="(default: %(default)s)")
    benchmark.add_argument("--out", type=Path, metavar="FILE", help="write a line of JSON for each mission")
    benchmark.add_argument("--pictures", type=Path, metavar="DIR", help="save a picture of each error there")
    benchmark.add_argument(
        "--row",
        choices=("transfer", "meta_occupancy", "meta_dividers"),
        help="also pictures of what this much of the system does not carry",
    )
    benchmark.add_argument(
        "--cache", type=Path, metavar="DIR", help="of simulated missions (default: the user's cache)"
    )


def _seeds(text: str) -> tuple[int, ...]:
    """`3`: seeds 1 to 3; `3,` or `3,7` or `5-9`: these."""
    try:
        if text.isdecimal():
            return tuple(range(1, int(text) + 1))
        spans = [part.partition("-") for part in text.split(",") if part]
        return tuple(n for low, _, high in spans for n in range(int(low), int(high or low) + 1))
    except ValueError:
        raise argparse.ArgumentTypeError(f"neither a count nor a list of seeds: {text}") from None


def _names(text: str) -> tuple[str, ...]:
    from stillroom.simulator.effects import EFFECTS

    names = tuple(name for name in text.split(",") if name)
    unknown = [name for name in names if name not in EFFECTS]
    if unknown:
        raise argparse.ArgumentTypeError(f"no effect {', '.join(unknown)}; there are {', '.join(sorted(EFFECTS))}")
    return names


def _benchmark(options: argparse.Namespace) -> int:
    from stillroom.simulator.benchmark.report import report
    from stillroom.simulator.benchmark.running import Benchmark, run, write
    from stillroom.simulator.benchmark.sorties import default_folder
    from stillroom.simulator.effects import EFFECTS
    from stillroom.simulator.severities import SEVERITIES

    effects = SEVERITIES[options.severity]
    if options.only is not None:
        effects = effects.only(options.only)
    if options.without is not None:
        effects = effects.only(EFFECTS.keys() - set(options.without))
    benchmark = Benchmark(
        effects,
        seeds=options.seeds,
        robots=range(options.robots) if options.robot is None else (options.robot,),
        missions=options.missions,
        processes=options.processes,
        cache=options.cache or default_folder(),
        pictures=options.pictures,
        row=options.row,
    )
    records = run(benchmark, _progress)
    if options.out is not None:
        write(records, options.out)
    report(records, print)
    return 0


def _progress(done: int, of: int) -> None:
    if sys.stderr.isatty():
        print(f"\r{done} of {of} robots", end="\n" if done == of else "", file=sys.stderr, flush=True)
