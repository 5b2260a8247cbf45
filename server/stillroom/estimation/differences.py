"""Whether one way of doing something fails oftener than another, by more than a margin: asked again and again while missions come in.

Each share has Wilson's interval at its effective number of missions (`intervals`); the difference of two has one by the square-and-
add rule (Newcombe 1998, method 10). Who looks at every new mission will see a difference some day where there is none. So it is
looked at when the missions have doubled, and look k has the share 1 / k (k + 1) of the error: these sum to 1, however often it
is looked. With several gates each has an equal part of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import ceil, exp, lgamma, log10, sqrt
from statistics import NormalDist
from typing import Literal

import numpy as np

from stillroom.estimation.intervals import Z95, Clustered, intervals

ERROR = 0.05
"""Two-sided: of 100 rollouts that change nothing at most 2.5 are halted, and of 100 that exceed the margin at most 2.5 pass."""
Verdict = Literal["passed", "failed", "inconclusive"]


@dataclass(frozen=True)
class Share:
    events: int
    of: int
    clusters: int
    low: float
    high: float
    effect: float

    @property
    def value(self) -> float:
        return self.events / self.of if self.of else 0.0


@dataclass(frozen=True)
class Difference:
    """The new share less the old one."""

    new: Share
    old: Share
    low: float
    high: float

    @property
    def value(self) -> float:
        return self.new.value - self.old.value

    def verdict(self, margin: float) -> Verdict:
        """Failed: the new one is surely worse by more than the margin. Passed: it surely is not."""
        if self.low > margin:
            return "failed"
        return "passed" if self.high < margin else "inconclusive"

    def more(self, margin: float) -> int | None:
        """About how many more missions of the new way it takes to be sure, if the shares stay; None: no number would do."""
        here, n = self.value, self.new.of
        if n == 0 or here == margin:
            return None
        room, half = abs(margin - here), self.high - here if here < margin else here - self.low
        needed = n * (half / room) ** 2
        return _rounded(max(needed - n, 0.0))


def critical(look: int, gates: int) -> float:
    """How many standard errors an interval reaches at a look, the first being 1."""
    return NormalDist().inv_cdf(1 - ERROR / (2 * gates * look * (look + 1)))


def difference(new: Clustered, old: Clustered, z: float = Z95) -> Difference:
    """Of groups of one entry each. Two measures of the same missions can be told apart the same way."""
    both = Clustered(
        **{f.name: np.concatenate([getattr(one, f.name) for one in (new, old)]) for f in fields(Clustered)}
    )
    whole = Clustered(**{f.name: getattr(both, f.name).sum(keepdims=True) for f in fields(Clustered)})
    found = intervals(both, whole, z)
    shares = [
        Share(
            int(both.events[i]),
            int(both.observations[i]),
            int(both.clusters[i]),
            float(found.low[i]),
            float(found.high[i]),
            float(found.effect[i]),
        )
        for i in range(2)
    ]
    a, b = shares
    apart = a.value - b.value
    low = apart - sqrt((a.value - a.low) ** 2 + (b.high - b.value) ** 2)
    high = apart + sqrt((a.high - a.value) ** 2 + (b.value - b.low) ** 2)
    return Difference(a, b, max(low, -1.0), min(high, 1.0))


def fisher(first: Sequence[int], second: Sequence[int]) -> float:
    """Fisher's exact test, two-sided, of (events, observations) each: takes all observations as independent ones."""
    (a, n), (b, m) = first, second
    events = a + b
    least, most = max(0, events - m), min(n, events)

    def weight(k: int) -> float:
        return _choose(n, k) + _choose(m, events - k)

    here, whole = weight(a), _choose(n + m, events)
    total = sum(exp(weight(k) - whole) for k in range(least, most + 1) if weight(k) <= here + 1e-9)
    return min(1.0, total)


def _choose(n: int, k: int) -> float:
    """Logarithm of the number of ways."""
    return lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1)


def _rounded(number: float) -> int:
    """Up, to two digits: it is an estimate, and looks like one."""
    if number < 1:
        return 0
    step = int(10 ** max(int(log10(number)) - 1, 0))
    return ceil(number / step) * step
