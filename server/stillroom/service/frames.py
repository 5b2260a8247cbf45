"""Frames of versions form a tree: each version's frame was carried over from another's by a motion, or is the same."""

from collections.abc import Callable

from stillroom.maps.motion import IDENTITY, Motion

Step = tuple[int | None, Motion | None]
"""(The version whose frame was carried over, None: none; the motion from that frame, None: the same frame)."""


def motion_between(step: Callable[[int], Step | None], start: int, end: int) -> Motion | None:
    """The motion from the frame of version `start` to that of version `end`, by way of their nearest common frame.

    `step` looks a version up (None: there is none). None where the two have no frame in common.
    """
    up, down = IDENTITY, IDENTITY
    while start != end:
        # A version's frame comes from an older version, so the newer of the two is the one to climb from.
        newer = max(start, end)
        found = step(newer)
        if found is None or found[0] is None:
            return None
        older, motion = found[0], found[1] or IDENTITY
        if newer == start:
            up = motion.inverse().after(up)
            start = older
        else:
            down = down.after(motion)
            end = older
    return down.after(up)
