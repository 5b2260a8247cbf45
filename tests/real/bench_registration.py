"""`make bench-registration`: real maps registered on each other, and one after the other as missions of one robot that tracks nothing.

`python -m tests.real.bench_registration FOLDER` also draws the missions there.
"""

import sys
from pathlib import Path

from tests.real.carrying import tell_carried
from tests.real.registering import tell
from tests.real.shared import DATA


def told(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> int:
    if not DATA.is_dir():
        told(f"there are no real maps in {DATA}")
        return 1
    tell(told)
    tell_carried(told, Path(sys.argv[1]) if len(sys.argv) > 1 else None)
    return 0


if __name__ == "__main__":
    sys.exit(main())
