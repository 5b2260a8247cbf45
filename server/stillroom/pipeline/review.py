"""Updates that wait until a person agrees: where the owner wants to be asked first, and where something is pinned."""

from collections.abc import Iterator
from dataclasses import replace

from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.conflicts import Action, Conflict, Naming, Proposal, kept
from stillroom.pipeline.update import MapUpdate


def hold_back(previous: SemanticMap, mission_id: str, update: MapUpdate, ask_first: bool, pinned: bool) -> MapUpdate:
    """The update, or where a person is to agree first: the previous map, and the update as a proposal.

    `ask_first`: an update that needed the meta layer, found new rooms or ended one waits. `pinned`: so does any about which there is a
    conflict; where single rooms are pinned, any about which one of them has a conflict.
    """
    if not update.taken or not _asks(previous, update, ask_first, pinned):
        return update
    conflicts = update.conflicts or (_change(previous, mission_id, update),)
    return replace(
        update,
        outcome="needs_review",
        map=previous,
        taken=False,
        reason=f"{update.reason} It waits until somebody agrees.",
        succeeded_at=None,
        conflicts=tuple(_held(conflict, previous, update) for conflict in conflicts),
        discovered=(),
        retired={},
    )


def _asks(previous: SemanticMap, update: MapUpdate, ask_first: bool, pinned: bool) -> bool:
    changes = bool(update.discovered or update.retired or update.outcome == "resolved")
    if pinned:
        return changes or bool(update.conflicts)
    kept = {room.id for room in previous.rooms if room.pinned}
    touched = {room.id for conflict in update.conflicts for room in conflict.rooms}
    return bool(kept & touched) or (ask_first and changes)


def _held(conflict: Conflict, previous: SemanticMap, update: MapUpdate) -> Conflict:
    choices: list[tuple[Action, SemanticMap]] = [(_action(update.map), update.map)]
    choices += [(p.action, p.map) for p in conflict.proposals if p.action == "take_new" and p.map != update.map]
    choices += [("keep_previous", previous)]
    proposals = tuple(Proposal(f"p{n}", action, n == 1, m) for n, (action, m) in enumerate(choices, 1))
    summary = _would_be_kept(conflict, previous) if conflict.resolved and conflict.rooms else conflict.summary
    return replace(conflict, resolved=False, proposals=proposals, summary=summary)


def _would_be_kept(conflict: Conflict, previous: SemanticMap) -> str:
    ids = [room.id for room in conflict.rooms]
    return f"{Naming(previous, '').rooms(ids)} {kept(ids, conflict.cause, would=True)}."


def _action(m: SemanticMap) -> Action:
    if m.meta.dividers:
        return "meta_dividers"
    return "meta_occupancy" if m.meta.occupancy else "take_new"


def _change(previous: SemanticMap, mission_id: str, update: MapUpdate) -> Conflict:
    """An update with which nothing is wrong, but that changes what a person wants to be asked about."""
    named = Naming(previous, mission_id)
    beside = {room for rooms in _changed_borders(update) for room in rooms}
    scores = tuple(score for score in update.rooms if score.id in beside)
    new = update.discovered
    summary = f"{named.rooms(new, update.map)} would be new." if new else "The map would be corrected."
    id_ = named.id_of("connectivity", [score.id for score in scores])
    return Conflict(id_, "connectivity", "new_passage" if new else "unknown", scores, (), (), summary, False)


def _changed_borders(update: MapUpdate) -> Iterator[tuple[str, ...]]:
    """The rooms beside each divider of a new room; where none is new, beside each meta-divider."""
    new = set(update.discovered)
    for meta_divider in update.map.meta.dividers:
        if not new or new & set(meta_divider.rooms):
            yield meta_divider.rooms
    for divider in update.map.dividers:
        if new & set(divider.rooms):
            yield divider.rooms
