"""One edit taken back, on the map as it is now."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from stillroom.errors import Fault
from stillroom.maps.geometry import Line, as_line, as_points, as_tuples, fit_pose
from stillroom.maps.motion import Motion
from stillroom.maps.semantics import Divider, Phantom, Restriction, SemanticMap
from stillroom.pipeline.edits.applying import EditResult, finish
from stillroom.pipeline.edits.draft import Draft, Setting, faults
from stillroom.pipeline.edits.operations import Shape
from stillroom.pipeline.edits.rebase import Touch, moved_polygon, touched
from stillroom.pipeline.params import PARAMS, Params

Zone = TypeVar("Zone", Restriction, Phantom)
ROOM_PROPERTIES = ("name", "kind", "pinned")


def undo(
    before: SemanticMap,
    edited: SemanticMap,
    current: SemanticMap,
    motion: Motion,
    theirs: Collection[Touch],
    params: Params = PARAMS,
) -> EditResult:
    """What `edited` changed of `before` as it was, all else as it is in `current`; features come back with their ids.

    `motion` takes the frame of `edited` to that of `current`; `theirs`: what people touched since. Raises InvalidEdit where they
    touched the same, or the features have no place any more.
    """
    mine = touched(before, edited)
    both = sorted(mine & set(theirs))
    if both:
        names = {r.id: r.name for r in (*before.rooms, *current.rooms)}
        raise faults([Fault("", f"{names.get(f, f)} was changed again since (its {p}).") for f, p in both])
    step = _Step(before, edited, motion)
    draft = Draft.of(current)
    draft = step.dividers(draft)
    draft = replace(
        draft,
        restrictions=step.zones(draft.restrictions, before.restrictions, edited.restrictions),
        phantoms=step.zones(draft.phantoms, before.phantoms, edited.phantoms),
        settings=tuple(step.settings(mine, current)),
    )
    reshaped = {name for name, of in mine if of in ("shape", "exists")}
    back = [replace(room, polygon=moved_polygon(room.polygon, motion)) for room in before.rooms if room.id in reshaped]
    return finish(draft, back, params)


@dataclass(frozen=True)
class _Step:
    before: SemanticMap
    edited: SemanticMap
    motion: Motion

    def dividers(self, draft: Draft) -> Draft:
        old = {d.id: d for d in self.before.dividers}
        new = {d.id: d for d in self.edited.dividers}
        drawn = dict(draft.drawn)
        kept: list[Divider] = []
        for divider in draft.dividers:
            if divider.id in new and divider.id not in old:
                continue
            was, became = old.get(divider.id), new.get(divider.id)
            if was is None or became is None:
                kept.append(divider)
                continue
            if was.line != became.line:
                divider = replace(divider, line=self._line(was), made_by=was.made_by)
                drawn[divider.id] = ""
            kept.append(replace(divider, kind=was.kind) if was.kind != became.kind else divider)
        there = {d.id for d in kept}
        for divider in old.values():
            if divider.id not in new and divider.id not in there:
                kept.append(replace(divider, line=self._line(divider)))
                drawn[divider.id] = ""
        old_meta, new_meta = ({m.id: m for m in of.meta.dividers} for of in (self.before, self.edited))
        present = {m.id for m in draft.meta_dividers}
        back = [
            replace(m, line=as_line(self.motion.apply(as_points(m.line))))
            for m in old_meta.values()
            if m.id not in new_meta and m.id not in present
        ]
        return replace(draft, dividers=tuple(kept), meta_dividers=(*draft.meta_dividers, *back), drawn=drawn)

    def zones(self, now: tuple[Zone, ...], before: tuple[Zone, ...], edited: tuple[Zone, ...]) -> tuple[Zone, ...]:
        """Restrictions or phantoms: those that were made go, those that were moved or removed are where they were."""
        old, new = {z.id: z for z in before}, {z.id: z for z in edited}
        kept: list[Zone] = []
        for zone in now:
            was, became = old.get(zone.id), new.get(zone.id)
            if became is not None and was is None:
                continue
            moved = was is not None and became is not None and was.shape != became.shape
            kept.append(replace(zone, shape=self._shape(was)) if moved and was is not None else zone)
        there = {z.id for z in kept}
        kept += [replace(z, shape=self._shape(z)) for z in before if z.id not in new and z.id not in there]
        return tuple(kept)

    def settings(self, mine: Collection[Touch], current: SemanticMap) -> Iterator[Setting]:
        for room in self.before.rooms:
            changed = [p for p in ROOM_PROPERTIES if (room.id, p) in mine]
            if changed and current.room(room.id) is not None:
                values = {p: getattr(room, p) for p in changed}
                if "name" in changed:
                    values["named_by"] = room.named_by
                yield Setting("", room.id, values)

    def _line(self, divider: Divider) -> Line:
        return as_line(np.round(self.motion.apply(as_points(divider.line)), 4))

    def _shape(self, zone: Restriction | Phantom) -> Shape:
        points = as_points(zone.shape)
        return as_tuples(np.round(fit_pose(points, self.motion.apply(points)).apply(points), 4))
