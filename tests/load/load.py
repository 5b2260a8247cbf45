"""`make load`: missions a second end to end, and what one costs, on PostgreSQL and an S3 store or on SQLite and files.

The robots run on the same machine; their own CPU is told apart. So is how much CPU others used meanwhile.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import httpx2
import numpy as np

from tests.load.driving import Driver, Figures, Load
from tests.load.robots import Home, LoadRobot, draw_homes
from tests.load.stack import TOKEN, Stack, busy_others

HOMES, SORTIES = 16, 8
QUEUE = 200
"""Missions that may wait while there is too much."""


def add_robots(stack: Stack, homes: Sequence[Home], count: int, prefix: str) -> list[LoadRobot]:
    robots = []
    with httpx2.Client(base_url=f"http://127.0.0.1:{stack.ports[0]}", timeout=60) as http:
        for number in range(count):
            name = f"{prefix}-{number}"
            made = http.post(
                "/api/v1/robots", headers={"Authorization": f"Bearer {TOKEN}"}, json={"id": name, "name": name}
            )
            made.raise_for_status()
            robots.append(LoadRobot(name, made.json()["token"], homes[number % len(homes)]))
    return robots


def measure(stack: Stack, robots: Sequence[LoadRobot], load: Load, title: str) -> Figures:
    """Tells what a load comes to."""
    before, own, began = stack.cpu_seconds(), time.process_time(), time.monotonic()
    with busy_others() as used:
        figures = Driver(stack.ports, robots, load).run()
    wall, own = time.monotonic() - began, time.process_time() - own
    after = stack.cpu_seconds()
    spent = {part: after[part] - before[part] for part in after}
    done = len(figures.acknowledged)
    others = used["machine"] - own - sum(spent.values())
    print(f"\n{title}: {load.rate:g} missions/s offered for {load.seconds:g} s, {len(robots)} robots")
    print(f"  acknowledged {done} in {wall:.1f} s: {done / wall:.1f}/s; no robot free {figures.behind} times")
    print(f"  acknowledged after ms  {_percentiles(figures.ack_seconds)}")
    if figures.seconds:
        print(f"  processed after ms     {_percentiles(figures.seconds)}")
    if figures.refused_seconds:
        print(f"  refused after ms       {_percentiles(figures.refused_seconds)}")
    each = ", ".join(f"{part} {1000 * seconds / max(done, 1):.1f}" for part, seconds in spent.items())
    print(
        f"  CPU ms a mission: {each}; sum {1000 * sum(spent.values()) / max(done, 1):.1f}; robots' own {1000 * own / max(done, 1):.1f}"
    )
    print(
        f"  CPU seconds: service {sum(spent.values()):.1f}, robots {own:.1f}, others on this machine {others:.1f}, of {2 * wall:.1f}"
    )
    print(f"  answers {dict(sorted(figures.statuses.items()))}; outcomes {dict(figures.outcomes)}", flush=True)
    for bad in figures.bad[:5]:
        print(f"  SHOULD NOT BE: {bad}")
    return figures


def overload(stack: Stack, homes: Sequence[Home], rate: float, seconds: float) -> Figures:
    """Far too much for a while, from robots that each send one mission and don't wait; then how soon all is as before."""
    robots = add_robots(stack, homes, int(rate * seconds), "more")
    before = stack.memory_mb()
    figures = measure(stack, robots, Load(rate, seconds, wait_s=0), "too much")
    after = stack.memory_mb()
    print("  memory MB", ", ".join(f"{name}: {mb:.0f} -> {after.get(name, 0):.0f}" for name, mb in before.items()))
    print(f"  nothing waits after another {settle(stack, 600.0):.1f} s")
    again = measure(stack, robots, Load(2.0, 10.0), "afterwards")
    figures.acknowledged += again.acknowledged
    return figures


def check(stack: Stack, acknowledged: Sequence[str], grace_s: int = 0) -> bool:
    """`stillroom verify`."""
    file = stack.folder / "acknowledged"
    file.write_text("\n".join(acknowledged))
    verified = stack.run("verify", "--acknowledged", str(file), "--grace", str(grace_s))
    print(
        "  verify:",
        "holds" if verified.returncode == 0 else verified.stdout[-3000:] + verified.stderr[-2000:],
        flush=True,
    )
    return verified.returncode == 0


def settle(stack: Stack, patience_s: float = 120.0) -> float:
    """Waits until nothing waits; how long that took."""
    began = time.monotonic()
    while time.monotonic() - began < patience_s:
        metrics = httpx2.get(f"http://127.0.0.1:{stack.ports[0]}/metrics", timeout=30).text
        if "stillroom_missions_waiting 0.0" in metrics:
            return time.monotonic() - began
        time.sleep(0.1)
    raise RuntimeError("missions still wait")


def _percentiles(seconds: Sequence[float]) -> str:
    return " ".join(f"p{q} {1000 * np.percentile(seconds, q):.0f}" for q in (50, 95, 99)) if seconds else "-"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--engine", choices=("postgresql", "sqlite"), default="postgresql")
    parser.add_argument("--processes", type=int, default=1, help="that serve (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=2, help="of each (default: %(default)s)")
    parser.add_argument(
        "--rates", type=float, nargs="+", default=[30.0, 15.0], help="missions a second, one after the other"
    )
    parser.add_argument("--seconds", type=float, default=30.0, help="of each rate (default: %(default)s)")
    parser.add_argument("--overload", type=float, default=0.0, help="missions a second that are far too many, at last")
    parser.add_argument("--robots", type=int, default=160)
    options = parser.parse_args(arguments)
    homes = draw_homes(HOMES, SORTIES)
    holds = True
    more = {"STILLROOM_QUEUE_LIMIT": str(QUEUE)} if options.overload else {}
    with (
        tempfile.TemporaryDirectory() as folder,
        Stack(Path(folder) / "service", options.engine, options.processes, options.workers, more) as stack,
    ):
        robots = add_robots(stack, homes, options.robots, "load")
        figures = measure(stack, robots, Load(options.robots / 10, 10), "first missions")
        acknowledged = list(figures.acknowledged)
        settle(stack)
        for rate in options.rates:
            figures = measure(
                stack, robots, Load(rate, options.seconds), f"{options.engine}, {options.processes} serving"
            )
            holds = holds and not figures.bad
            acknowledged += figures.acknowledged
            print(f"  nothing waits after another {settle(stack):.1f} s")
        if options.overload:
            figures = overload(stack, homes, options.overload, options.seconds)
            holds = holds and not figures.bad
            acknowledged += figures.acknowledged
        holds = check(stack, acknowledged) and holds
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
