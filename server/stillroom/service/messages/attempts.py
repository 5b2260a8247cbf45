"""What came of trying to send something."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Attempt:
    """`delivered`; `failed`: worth another try later; `refused`: this message will never be taken; `gone`: the receiver is no more;
    `pointless`: there was nothing left to tell."""

    result: Literal["delivered", "failed", "refused", "gone", "pointless"]
    reason: str | None = None
    status_code: int | None = None
    retry_after_s: float | None = None
    """As the receiver asked."""
