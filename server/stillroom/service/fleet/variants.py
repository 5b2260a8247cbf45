"""With which setting of the pipeline a mission is processed: that of the code, one that a rollout has put in force, or the one that
a rollout is trying out in some homes.

Which homes these are follows from a hash of the rollout's name and the robot: a home stays where it is while the share grows, and
another rollout tries other homes first.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from hashlib import sha256
from typing import Any, get_args

import structlog

from stillroom import __version__
from stillroom.errors import Fault, InvalidInput
from stillroom.pipeline.params import PARAMS, Params
from stillroom.pipeline.update import ResolverName
from stillroom.store import rollouts
from stillroom.store.database import Transaction
from stillroom.store.rollouts import RolloutRow

log = structlog.get_logger()


@dataclass(frozen=True)
class Part:
    """What a mission is of a rollout."""

    rollout_id: int
    stage: int
    candidate: bool

    @property
    def is_beside(self) -> bool:
        """Whether the candidate runs beside the setting in force, to be compared with it."""
        return self.stage == 0


@dataclass(frozen=True)
class Variant:
    algorithm: str
    """What missions and versions are labelled with."""
    resolvers: Sequence[ResolverName]
    params: Params = PARAMS
    part: Part | None = None


def variant_for(tx: Transaction, robot_id: str, resolvers: Sequence[ResolverName]) -> Variant:
    """`resolvers`: of the service, where no rollout says otherwise."""
    found = Variant(__version__, resolvers)
    in_play = rollouts.in_play(tx)
    for row in in_play:
        usable = variant_of(row) if row.state == "successful" else None
        if usable is not None:
            found = usable
            break
    # code of another version than the one that it compares with would be a third way of doing it
    running = next((row for row in in_play if row.state == "running" and row.code == __version__), None)
    if running is None:
        return found
    part = Part(running.id, running.stage, is_candidate(running.name, running.stage, robot_id))
    candidate = variant_of(running) if part.candidate else None
    return replace(candidate or found, part=part)


def variant_of(row: RolloutRow) -> Variant | None:
    """None where this code does not have its parameters any more."""
    try:
        params = parameters(row.params)
    except InvalidInput:
        log.exception("a setting is in force that this code can not be run with", rollout=row.name)
        return None
    return Variant(label(row.name), resolvers_named(row.resolvers), params)


def label(name: str) -> str:
    """As SemVer has it: what follows the plus says how it was built."""
    return f"{__version__}+{name}"


def resolvers_named(names: Sequence[str]) -> tuple[ResolverName, ...]:
    return tuple(name for name in get_args(ResolverName) if name in names)


def is_candidate(name: str, per_cent: int, robot_id: str) -> bool:
    """Whether the rollout of that name has reached the home."""
    place = int.from_bytes(sha256(f"{name}/{robot_id}".encode()).digest()[:8], "big")
    return place * 100 < per_cent << 64


def parameters(changed: Mapping[str, Any]) -> Params:
    """Raises InvalidInput for a parameter that there is not, or whose value is of another type."""
    known = {one.name: getattr(PARAMS, one.name) for one in fields(Params)}
    faults = []
    values: dict[str, Any] = {}
    for name, value in changed.items():
        if name not in known:
            faults.append(Fault(f"/params/{name}", "no such parameter"))
        elif not _fits(value, known[name]):
            faults.append(Fault(f"/params/{name}", f"must be like {known[name]!r}"))
        else:
            values[name] = tuple(value) if isinstance(known[name], tuple) else type(known[name])(value)
    if faults:
        raise InvalidInput("These parameters can't be used.", tuple(faults))
    return replace(PARAMS, **values)


def _fits(value: Any, like: Any) -> bool:
    if isinstance(like, tuple):
        return isinstance(value, list | tuple) and len(value) == len(like) and all(map(_fits, value, like))
    if isinstance(like, bool) or isinstance(value, bool):
        return isinstance(like, bool) and isinstance(value, bool)
    if isinstance(like, int):
        return isinstance(value, int)
    return isinstance(value, int | float) and abs(value) < float("inf") if isinstance(like, float) else False
