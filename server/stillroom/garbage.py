"""What a process that runs for long does about Python's search for garbage."""

import gc

OFTEN = 10_000
"""New objects, after which it is looked through them: a mission or a map makes thousands, and next to none of them in circles."""


def keep_what_is_there() -> None:
    """What was loaded by now stays: looking through it for garbage again and again would hold work up for a tenth of a second."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(OFTEN)
