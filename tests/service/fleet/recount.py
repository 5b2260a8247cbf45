"""The fleet's figures the slow way: from the rows of the missions, one by one, in plain Python."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Database
from stillroom.store.tables import conflict, map_, mission, sighting, version

ROWS = ("transfer", "meta_occupancy", "meta_dividers")


@dataclass(frozen=True)
class Plain:
    """A mission that counts, as its row has it."""

    id: int
    robot: str
    day: date
    firmware: str
    model: str
    algorithm: str
    size: str
    outcome: str
    failed: tuple[str, ...]
    """Rows of the results table."""
    cause: tuple[str, str, str, str] | None
    """Kind, cause, stage and algorithm."""
    at: datetime
    escaped: bool


def recount(database: Database, escaped: Collection[int] = ()) -> list[Plain]:
    with database.read() as tx:
        missions = [dict(row._mapping) for row in tx.execute(sa.select(mission))]
        robots = {row.id: row.robot_id for row in tx.execute(sa.select(map_))}
        rooms = {(row.map_id, row.number): row.rooms for row in tx.execute(sa.select(version))}
        kinds = {row.id: (row.kind, row.resolved) for row in tx.execute(sa.select(conflict))}
        met: dict[int, list[Any]] = {}
        for row in tx.execute(sa.select(sighting).order_by(sighting.c.id)):
            met.setdefault(row.mission_id, []).append((*kinds[row.conflict_id], row.cause))
    return [
        _plain(row, robots[row["map_id"]], rooms, met.get(row["id"], []), row["id"] in escaped)
        for row in missions
        if row["status"] == "done"
        and row["base_version"] is not None
        and row["placed_from"] is None
        and row["outcome"] in ("updated", "resolved", "needs_review", "reverted", "parked")
    ]


def _plain(
    row: Mapping[str, Any], robot: str, rooms: Mapping[tuple[int, int], int], met: list[Any], escaped: bool
) -> Plain:
    passed = [row[f"ablation_{name}"] for name in ROWS]
    failed = tuple(name for name, ok in zip(ROWS, passed, strict=True) if ok is False)
    if passed[0] is None and row["outcome"] == "reverted":
        failed = ROWS
    count = rooms.get((row["map_id"], row["base_version"]))
    size = "" if count is None else "1-3" if count < 4 else "4-6" if count < 7 else "7-9" if count < 10 else "10+"
    return Plain(
        id=row["id"],
        robot=robot,
        day=row["finished_at"].astimezone(UTC).date(),
        firmware=row["meta"].get("firmware") or "",
        model=row["meta"].get("model") or "",
        algorithm=row["algorithm"],
        size=size,
        outcome=row["outcome"],
        failed=() if row["outcome"] == "parked" else failed,
        cause=_cause(row, failed, met),
        at=row["finished_at"],
        escaped=escaped,
    )


def _cause(row: Mapping[str, Any], failed: tuple[str, ...], met: list[Any]) -> tuple[str, str, str, str] | None:
    if not failed and row["outcome"] in ("updated", "resolved"):
        return None
    if row["traceback"] is not None:
        last = row["traceback"].strip().split("\n")[-1]
        return "error", last.split(":")[0], "processing", row["algorithm"]
    open_ones = [one for one in met if not one[1]]
    kind, _, cause = (open_ones or met or [("unknown", False, "unknown")])[0]
    if row["outcome"] == "parked":
        stage = "registration"
    elif row["ablation_transfer"] is None:
        stage = "processing"
    else:
        stage = failed[-1] if failed else "verification"
    return kind, cause, stage, row["algorithm"]


def chosen(missions: Iterable[Plain], first: date, last: date, **values: Collection[str]) -> list[Plain]:
    def fits(one: Plain) -> bool:
        return all(getattr(one, name) in wanted for name, wanted in values.items() if wanted)

    return [one for one in missions if first <= one.day <= last and fits(one)]


def monday(day: date) -> str:
    return (day - timedelta(days=day.weekday())).isoformat()


KEYS: Mapping[str, Callable[[Plain], str]] = {
    "day": lambda one: one.day.isoformat(),
    "week": lambda one: monday(one.day),
    "firmware": lambda one: one.firmware,
    "model": lambda one: one.model,
    "algorithm": lambda one: one.algorithm,
    "size": lambda one: one.size,
}


def rows(missions: Iterable[Plain], by: str) -> dict[str, dict[str, float]]:
    groups: dict[str, list[Plain]] = {}
    for one in missions:
        groups.setdefault(KEYS[by](one), []).append(one)
    return {key: row(some, some) for key, some in groups.items()}


def rows_by_cause(missions: list[Plain]) -> dict[str, dict[str, float]]:
    """Each says how many of all missions failed by it."""
    names = {one.cause[1] for one in missions if one.cause is not None}
    return {name: row(missions, [one for one in missions if one.cause and one.cause[1] == name]) for name in names}


def row(of: list[Plain], events: list[Plain]) -> dict[str, float]:
    """Of judged missions, those among `events` that failed so; `parked` is of these and the parked ones."""
    judged = [one for one in of if one.outcome != "parked"]
    parked = [one for one in events if one.outcome == "parked"]
    counts = {name: sum(name in one.failed for one in events) for name in ROWS}
    counts |= {name: sum(one.outcome == name for one in events) for name in ("reverted", "needs_review")}
    counts["escapes"] = sum(one.escaped for one in events)
    n, all_n = len(judged), len(judged) + len(parked)
    rates = {f"{name} rate": round(count / n, 6) for name, count in counts.items() if n}
    if all_n:
        rates["parked rate"] = round(len(parked) / all_n, 6)
    robots = {one.robot for one in (*judged, *parked)}
    return {"missions": n, "robots": len(robots), "parked": len(parked)} | counts | rates


def told(document: Any) -> dict[str, float]:
    """The same of a row that the API answers with."""
    found = document if isinstance(document, dict) else document.model_dump()
    names = ("missions", "robots", "parked", "reverted", "needs_review", "escapes")
    rates = {f"{name} rate": share for name, share in found["rates"].items() if share is not None}
    return {name: found[name] for name in names} | dict(found["failed"]) | rates
