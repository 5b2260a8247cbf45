"""Two ways of doing the same to the same missions: what differs, and whether that can be chance."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Pairs:
    """How many missions succeeded which way."""

    both: int = 0
    only_old: int = 0
    only_new: int = 0
    neither: int = 0

    @property
    def p(self) -> float:
        return mcnemar(self.only_old, self.only_new)


def mcnemar(only_old: int, only_new: int) -> float:
    """McNemar's exact test, two-sided: how likely so uneven a split or a more uneven one is, were either way as likely."""
    changed = only_old + only_new
    ways = tail = 1
    for k in range(min(only_old, only_new)):
        ways = ways * (changed - k) // (k + 1)
        tail += ways
    # whole numbers until here: with thousands of missions their powers of two fit no float
    return min(1.0, (2 * tail * 10**18 // (1 << changed)) / 10**18)
