"""Which of a robot's floors a parked mission looks like: what a person is asked about it."""

from collections.abc import Sequence
from dataclasses import dataclass

from stillroom.documents.stored import decode_map
from stillroom.maps.grid import OccupancyGrid
from stillroom.pipeline.params import PARAMS
from stillroom.pipeline.registration import register
from stillroom.store import maps, missions
from stillroom.store.database import Database, Transaction
from stillroom.store.rows import Json, MapRow, MissionRow, VersionRow

MOST_FLOORS = 10
"""Some hundredths of a second each."""


@dataclass(frozen=True)
class Candidate:
    of: MapRow
    rooms: int
    restrictions: int
    share: float
    """Of the floor's walls that lie where the mission has walls, at best."""
    fit: float
    """How well it fits in all: what candidates are compared by."""
    certain: bool


@dataclass(frozen=True)
class Question:
    """What a person is asked about a parked mission."""

    candidates: Sequence[Candidate]
    advice: str

    def as_json(self) -> Json:
        return {"candidates": [{"map": c.of.name, "share": c.share, "certain": c.certain} for c in self.candidates]}


def ask(database: Database, of: MapRow, current: VersionRow, mission: MissionRow, grid: OccupancyGrid) -> Question:
    """Looks at all floors of the robot. `of` is where it was sent, with the version `current` in force."""
    with database.read() as tx:
        under = under_version(tx, current)
    was_reset = under is not None and under.map_id == of.id and under.epoch < mission.epoch
    candidates = find_candidates(database, of, grid)
    return Question(candidates, advice(of, was_reset, candidates))


def find_candidates(database: Database, of: MapRow, grid: OccupancyGrid) -> list[Candidate]:
    """The floors of the robot that have a version, the likeliest first; the one that it was sent to is among them."""
    with database.read() as tx:
        floors = maps.of_robots(tx, [of.robot_id])
        nearest = sorted(floors, key=lambda floor: floor.id != of.id)[:MOST_FLOORS]
        found = [(floor, maps.version_at(tx, floor.id, floor.head)) for floor in nearest if floor.head is not None]
    candidates = [_candidate(floor, row, grid) for floor, row in found if row is not None]
    return sorted(candidates, key=lambda candidate: (candidate.certain, candidate.fit), reverse=True)


def _candidate(of: MapRow, row: VersionRow, grid: OccupancyGrid) -> Candidate:
    semantic_map = decode_map(row.document)
    registered = register(semantic_map, grid, PARAMS)
    return Candidate(
        of,
        rooms=len(semantic_map.rooms),
        restrictions=len(semantic_map.restrictions),
        share=round(registered.share, 3),
        fit=registered.fit,
        certain=registered.found(PARAMS),
    )


def advice(of: MapRow, was_reset: bool, candidates: Sequence[Candidate]) -> str:
    """What a person who is asked should know, in one or two sentences."""
    likeliest = candidates[0] if candidates else None
    if likeliest is not None and likeliest.certain and likeliest.of.id != of.id:
        return f"It looks like {likeliest.of.title} ({likeliest.share:.0%} of its walls fit): say whether it is."
    here = next((candidate for candidate in candidates if candidate.of.id == of.id), None)
    if was_reset and here is not None:
        brought = _counted(here.rooms, "room")
        if here.restrictions:
            brought += f" and {_counted(here.restrictions, 'restriction')}"
        return f"The robot was reset. If this is {of.title} all the same, say so: that brings back {brought}."
    return "Say which floor it belongs to; it may be a new one."


def under_version(tx: Transaction, version: VersionRow) -> MissionRow | None:
    """The mission that a version lies on, as the robot sent it: not as it was placed."""
    row = None if version.mission is None else missions.by_key(tx, version.map_id, version.mission)
    return row if row is None or row.placed_from is None else missions.get(tx, row.placed_from)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
