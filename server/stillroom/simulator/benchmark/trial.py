"""One robot's missions, one after the other, with the owner's edits between them."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from stillroom.documents.pictures import Image
from stillroom.pipeline.update import Row
from stillroom.simulator.benchmark.failure_pictures import failure, save
from stillroom.simulator.benchmark.judging import Record, lost_and_wrong, meta_share
from stillroom.simulator.benchmark.memory import Answer, MemoryService, Version
from stillroom.simulator.benchmark.sorties import sorties_of
from stillroom.simulator.building import home_of
from stillroom.simulator.client import Json
from stillroom.simulator.effects import Effects, Streams
from stillroom.simulator.fleet import SimulatedRobot, Sortie
from stillroom.simulator.floor_plans import planned_home
from stillroom.simulator.owner import served_rooms, tidy_up
from stillroom.simulator.truth import MapFit, fit


@dataclass(frozen=True)
class Trial:
    """What one robot is asked to do."""

    seed: int
    robot: int
    missions: int
    """After the first, which makes the map."""
    effects: Effects
    cache: Path | None
    """A folder of sorties that were simulated before."""
    pictures: Path | None = None
    """A folder for a picture of each error,"""
    row: Row | None = None
    """and of each mission that this much of the system did not carry."""
    plans: Path | None = None
    """A folder of floor plans of Sweet Home 3D; None: homes are drawn."""
    repairs: bool = False
    """Whether owners put right what they see is wrong with rooms that they had named; else they look at new rooms alone."""


class Household:
    """A robot, its home and its owner, with the service in memory."""

    def __init__(self, trial: Trial) -> None:
        streams = Streams(trial.seed, trial.robot)
        effects = trial.effects.of_robot(streams.of("model"))
        (resolution,) = effects.resolutions
        home = home_of(streams, effects) if trial.plans is None else planned_home(trial.plans, streams, effects)
        self.robot = SimulatedRobot(home, streams, effects, resolution)
        self.trial = trial
        self.service = MemoryService()
        self.sorties = sorties_of(self.robot, trial.missions + 1, trial.cache)
        self.named: set[str] = set()
        """The true rooms that the owner has named so far."""
        self._known: frozenset[str] = frozenset()

    def run(self) -> Iterator[Record]:
        """In the order in which the missions arrive."""
        known = None
        for sortie, happened in self._arrivals():
            before = self.service.in_force if self.service.versions else None
            document = self.service.document()
            base = known if known and happened & {"stale_bases", "late_uploads"} else document
            known = document
            answer = self.service.process(sortie.number, sortie.sensed.grid, self.robot.meta(sortie, base))
            record = self._record(sortie, answer, happened)
            if self.trial.pictures is not None and before is not None and self._is_shown(record):
                save(self._picture(record, before, sortie, answer), record, self.trial.pictures)
            yield record
            self._settle_in(sortie, sees_it=self.trial.repairs and bool(record.lost or record.wrong))

    def _arrivals(self) -> Iterator[tuple[Sortie, frozenset[str]]]:
        """Each mission, with what happened to it until it arrived."""
        waiting = None
        for sortie in self.sorties:
            late, stale = self.robot.streams.of("uploads", sortie.number).random(2).tolist()
            if 0 < sortie.number < len(self.sorties) - 1 and waiting is None and late < self.robot.effects.late_uploads:
                waiting = sortie
                continue
            is_stale = sortie.number > 1 and waiting is None and stale < self.robot.effects.stale_bases
            yield sortie, sortie.happened | ({"stale_bases"} if is_stale else frozenset())
            if waiting is not None:
                yield waiting, waiting.happened | {"late_uploads"}
                waiting = None

    def _record(self, sortie: Sortie, answer: Answer, happened: frozenset[str]) -> Record:
        found = self._fit(sortie)
        lost, wrong = lost_and_wrong(found, self.named)
        refuse = "late_uploads" if "late_uploads" in happened else sortie.refuse
        error = answer.taken if refuse else not answer.taken or bool(lost or wrong)
        version = self.service.in_force
        ablation = answer.ablation
        return Record(
            self.trial.seed,
            self.trial.robot,
            sortie.number,
            tuple(sorted(happened | self.robot.home.traits)),
            refuse,
            answer.verdict,
            answer.taken,
            None if answer.update is None else answer.update.succeeded_at,
            ablation.transfer,
            ablation.meta_occupancy,
            ablation.meta_dividers,
            error,
            error and answer.taken,
            round(found.mean_iou, 4),
            round(meta_share(version.map, version.grid), 4),
            lost,
            wrong,
            round(1000 * answer.seconds, 2),
            answer.reason,
        )

    def _is_shown(self, record: Record) -> bool:
        row = self.trial.row
        return record.error or (row is not None and record.refuse is None and not getattr(record, row))

    def _picture(self, record: Record, before: Version, sortie: Sortie, answer: Answer) -> Image:
        update, after = answer.update, self.service.in_force
        motion, candidate = (None, None) if update is None else (update.motion, update.candidate)
        bent = self.robot.distortion(after.mission)
        return failure(record, before, sortie.sensed.grid, motion, candidate, after, self.robot.home, bent)

    def _fit(self, sortie: Sortie) -> MapFit:
        document, bent = self._document(), self.robot.distortion(self.service.in_force.mission)
        return fit(self.robot.home, sortie.sensed.floor.frame, sortie.explored, document, bent)

    def _document(self) -> Json:
        document = self.service.document()
        assert document is not None
        return document

    def _settle_in(self, sortie: Sortie, sees_it: bool) -> None:
        """The owner looks at the map where its rooms are others than before, or where it is seen to be wrong.

        Only rooms that lie right count as named.
        """
        if frozenset(served_rooms(self._document())) == self._known and not sees_it:
            return
        tidy_up(self.service.edit, sortie.world.home, self.robot.distortion(self.service.in_force.mission))
        self._known = frozenset(served_rooms(self._document()))
        self.named |= {room.name for room in self._fit(sortie).rooms if room.named is not None and room.named.passed}
