"""The service's part in a benchmark, in memory: one map's versions, the pure core, and the rules of `service.processing`."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from pydantic import ValidationError

from stillroom.documents.features import features
from stillroom.documents.missions import MissionMeta, stored_meta
from stillroom.documents.operations import EditRequest
from stillroom.documents.stored import decode_map, encode_map
from stillroom.errors import InvalidEdit
from stillroom.maps.grid import OccupancyGrid
from stillroom.maps.mission import Mission, tracked_motion
from stillroom.maps.motion import IDENTITY, Motion
from stillroom.maps.semantics import Ids, SemanticMap
from stillroom.pipeline.edits import apply_edits
from stillroom.pipeline.update import Ablation, MapUpdate, create_semantic_map, update_map
from stillroom.simulator.client import Json, Refused

Verdict = Literal["created", "updated", "resolved", "needs_review", "reverted", "parked", "superseded"]
UNPROCESSABLE = 422


@dataclass(frozen=True)
class Version:
    """A map as it was in force; `motion` from the version before to this one, None: the same frame. `mission` and `grid` lie under it."""

    map: SemanticMap
    mission: int
    grid: OccupancyGrid
    motion: Motion | None


@dataclass(frozen=True)
class Answer:
    """What came of a mission. `update` is None where it was late or the core raised; `seconds` of CPU are the core's."""

    verdict: Verdict
    reason: str
    seconds: float
    update: MapUpdate | None = None

    @property
    def taken(self) -> bool:
        return self.update is not None and self.update.taken

    @property
    def ablation(self) -> Ablation:
        nothing = Ablation(False, False, False)
        return nothing if self.update is None else self.update.ablation or nothing


class MemoryService:
    """Versions are numbered from 1, as over HTTP."""

    def __init__(self) -> None:
        self.versions: list[Version] = []
        self._newest = (0, -1)
        self._document: Json | None = None

    @property
    def in_force(self) -> Version:
        return self.versions[-1]

    def document(self) -> Json | None:
        """What `GET` of the map answers, as far as a robot or an owner looks at it; None before the first mission."""
        if self.versions and (self._document is None or self._document["version"] != len(self.versions)):
            found = [feature.model_dump(mode="json") for feature in features(self.in_force.map)]
            self._document = {
                "version": len(self.versions),
                "mission": str(self.in_force.mission),
                "features": found,
            }
        return self._document

    def process(self, mission: int, grid: OccupancyGrid, meta: Mapping[str, Any]) -> Answer:
        """An upload; `meta` as the robot sends it."""
        parsed = stored_meta(dict(meta))
        if not self.versions:
            began = time.process_time()
            update = create_semantic_map(grid, str(mission), Ids())
        elif (parsed.epoch, parsed.sequence) < self._newest:
            return Answer("superseded", "A newer mission was processed before this one.", 0.0)
        else:
            motion = self._motion(parsed)
            began = time.process_time()
            try:
                update = update_map(self.in_force.map, Mission(str(mission), grid, motion))
            except Exception as error:  # as the worker does: the mission is kept, the lane goes on
                return Answer("reverted", f"{type(error).__name__}: {error}", time.process_time() - began)
        seconds = time.process_time() - began
        self._newest = max(self._newest, (parsed.epoch, parsed.sequence))
        if update.taken:
            self.versions.append(Version(_stored(update.map), mission, grid, update.motion))
        return Answer(update.outcome, update.reason, seconds, update)

    def edit(self, operations_for: Callable[[Json], Sequence[Json]]) -> Json | None:
        """An owner's batch of edits, as `Client.edit`. Raises Refused."""
        document = self.document()
        operations = [] if document is None else list(operations_for(document))
        if not operations:
            return None
        try:
            asked = EditRequest.model_validate_json(json.dumps({"operations": operations}))
            edited = apply_edits(self.in_force.map, [operation.as_operation() for operation in asked.operations])
        except (InvalidEdit, ValidationError) as error:
            raise Refused(UNPROCESSABLE, str(error)) from None
        self.versions.append(replace(self.in_force, map=_stored(edited.map), motion=None))
        return self.document()

    def _motion(self, meta: MissionMeta) -> Motion | None:
        """From the frame of the version in force to the mission's, as the robot tracked it."""
        if meta.base_version is None or not 1 <= meta.base_version <= len(self.versions):
            return None
        from_base, _ = tracked_motion(self.versions[meta.base_version - 1].map, meta.tracking.as_tracking())
        if from_base is None:
            return None
        to_base = IDENTITY
        for version in reversed(self.versions[meta.base_version :]):
            if version.motion is not None:
                to_base = version.motion.inverse().after(to_base)
        return from_base.after(to_base)


def _stored(semantic_map: SemanticMap) -> SemanticMap:
    """The map as it comes back from the store."""
    return decode_map(encode_map(semantic_map), semantic_map.ids)
