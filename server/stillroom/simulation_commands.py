"""`stillroom benchmark`: the results table, of simulated fleets."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillroom.arguments import add_command, count

if TYPE_CHECKING:
    from stillroom.simulator.effects import Effects


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
    benchmark.add_argument(
        "--plans", type=Path, metavar="DIR", help="homes from the floor plans in a folder (Sweet Home 3D's Home.xml)"
    )
    benchmark.add_argument(
        "--repairs", action="store_true", help="owners put right what is wrong (else errors may last for many missions)"
    )
    benchmark.add_argument("--processes", type=count, default=2, metavar="N", help="(default: %(default)s)")
    benchmark.add_argument("--out", type=Path, metavar="FILE", help="write a line of JSON for each mission")
    benchmark.add_argument("--resume", action="store_true", help="robots that FILE has already are not run again")
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
    from stillroom.simulator.benchmark.running import Benchmark, read, run, write
    from stillroom.simulator.benchmark.sorties import default_folder
    from stillroom.simulator.floor_plans import UnusablePlan

    benchmark = Benchmark(
        _effects(options),
        seeds=options.seeds,
        robots=range(options.robots) if options.robot is None else (options.robot,),
        missions=options.missions,
        processes=options.processes,
        cache=options.cache or default_folder(),
        pictures=options.pictures,
        row=options.row,
        plans=options.plans,
        repairs=options.repairs,
    )
    out: Path | None = options.out
    records = []
    try:
        if out is not None and out.exists():
            if options.resume:
                records = read(out)
            else:
                out.unlink()
        done = {(record.seed, record.robot) for record in records}
        for left, of_one in run(benchmark, done):
            records += of_one
            if out is not None:
                write(of_one, out)
            _tell_progress(left)
    except (UnusablePlan, ValueError, OSError) as error:
        print(f"stillroom: {error}", file=sys.stderr)
        return 1
    report(records, print)
    return 0


def _effects(options: argparse.Namespace) -> "Effects":
    from stillroom.simulator.effects import EFFECTS
    from stillroom.simulator.severities import SEVERITIES

    effects = SEVERITIES[options.severity]
    names = EFFECTS.keys() if options.only is None else set(options.only)
    return effects.only(names - set(options.without or ()))


def _tell_progress(left: int) -> None:
    if sys.stderr.isatty():
        print(f"\r{left} robots left ", end="" if left else "\n", file=sys.stderr, flush=True)
