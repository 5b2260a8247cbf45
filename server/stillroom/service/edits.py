"""People change maps: edits, edits taken back, old versions brought back.

Nothing is held while it is computed: a change is made from a version, and committed only if that is still the one in force. A
mission that is being processed meanwhile does the same, and is then carried over from the changed map.
"""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

from stillroom.documents import api
from stillroom.documents.operations import OperationDocument, operation_document
from stillroom.documents.stored import decode_map
from stillroom.errors import ChangedSince, InvalidEdit, NotFound, StaleVersion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.decisions import confirm
from stillroom.pipeline.edits import EditResult, Operation, apply_edits
from stillroom.pipeline.edits.rebase import rebase
from stillroom.pipeline.edits.suggesting import suggest_dividers
from stillroom.pipeline.edits.undo import undo
from stillroom.service.access import Principal, signature
from stillroom.service.maps import as_document, document_fields, find_in_force, find_version
from stillroom.service.steps import since
from stillroom.service.versions import ids_of, new_version
from stillroom.store import clock, events, lanes, maps
from stillroom.store.database import Database, Transaction
from stillroom.store.rows import MapRow, VersionHead, VersionRow

UNDOABLE = ("edit", "restore")
"""Causes of versions that are taken back this way. A decision is another matter: its conflict knows of it."""
ATTEMPTS = 5
"""How often a change is made anew because the map changed meanwhile."""


def suggest_edit(database: Database, robot_id: str, map_name: str, sensitivity: float) -> api.SuggestedEdit:
    """What would part the rooms of the version in force anew. Raises NotFound."""
    _, row = find_version(database, robot_id, map_name)
    operations = suggest_dividers(decode_map(row.document), sensitivity)
    return api.SuggestedEdit(version=row.number, operations=[operation_document(o) for o in operations])


def edit_map(
    database: Database,
    caller: Principal,
    robot_id: str,
    map_name: str,
    expected: int,
    operations: Sequence[Operation],
    dry_run: bool,
) -> api.EditedMap | api.EditPreview:
    """All operations on version `expected` as one new version. Raises NotFound, InvalidEdit, and StaleVersion with the merge.

    Computed outside of any transaction; committed only if `expected` is still in force. A mission that is being processed
    meanwhile notices the same way, and is then carried over from the edited map.
    """
    of, row = find_version(database, robot_id, map_name)
    if of.head != expected:
        raise _stale(database, of, row, expected, operations, caller)
    try:
        result = apply_edits(decode_map(row.document, ids_of(of)), operations)
    except InvalidEdit as refused:
        raise _with_fixes(refused) from None
    if dry_run:
        return _preview(of, row, result, caller)
    made = _commit(database, of, row, result, caller, "edit")
    if made is None:
        of, row = find_version(database, robot_id, map_name)
        raise _stale(database, of, row, expected, operations, caller)
    return _edited(of, made, result)


def undo_version(database: Database, caller: Principal, robot_id: str, map_name: str, number: int) -> api.EditedMap:
    """What a person changed with version `number` as it was before, all else as it is now. Raises NotFound, ChangedSince.

    While that version is in force this is the version before it once more; else it is worked out by feature.
    """
    for _ in range(ATTEMPTS):
        of, current = find_version(database, robot_id, map_name)
        with database.read() as tx:
            edited = maps.version_at(tx, of.id, number)
            before = None if edited is None or edited.parent is None else maps.version_at(tx, of.id, edited.parent)
            if edited is None:
                raise NotFound(f"The map {map_name} of {robot_id} has no version {number}.")
            if before is None or edited.cause not in UNDOABLE:
                raise ChangedSince(f"Version {number} is no edit; restore an older one instead.")
            result = _taken_back(tx, of, before, edited, current)
        in_force = edited.number == current.number
        under = before if in_force else current
        made = _commit(database, of, current, result, caller, "restore" if in_force else "edit", under)
        if made is not None:
            return _edited(of, made, result)
    raise StaleVersion("The map changes too fast; try again.", current=of.head)


def _taken_back(tx: Transaction, of: MapRow, before: VersionRow, edited: VersionRow, current: VersionRow) -> EditResult:
    now = decode_map(current.document, ids_of(of))
    if edited.number == current.number:
        restored = decode_map(before.document, ids_of(of))
        return EditResult(restored, ended_by_restore(now, restored))
    later = since(tx, of.id, edited.number, current.number)
    if later is None or before.grid != edited.grid:
        raise ChangedSince(f"Too much has changed since version {edited.number}; restore an older one instead.")
    try:
        return undo(decode_map(before.document), decode_map(edited.document), now, later.motion, later.touched)
    except InvalidEdit as refused:
        raise ChangedSince(refused.detail) from None


def restore_version(
    database: Database, caller: Principal, robot_id: str, map_name: str, number: int
) -> api.MapDocument:
    """An old version again, as a new one. Raises NotFound, and ChangedSince where what was sensed under it is not kept any more."""
    with database.write() as tx:
        found, _ = find_in_force(tx, robot_id, map_name)
        lanes.lock(tx, found.id)
        of, head = find_in_force(tx, robot_id, map_name)
        row, current = maps.version_at(tx, of.id, number), maps.version_at(tx, of.id, head)
        if row is None or current is None:
            raise NotFound(f"The map {map_name} of {robot_id} has no version {number}.")
        if not row.grid and current.grid:
            raise ChangedSince(f"What was sensed under version {number} is not kept any more.")
        restored, now = confirm(decode_map(row.document, ids_of(of))), clock.now(tx)
        new = new_version(
            restored,
            retired=ended_by_restore(decode_map(current.document), restored),
            parent=head,
            cause="restore",
            mission=row.mission,
            made_by=signature(caller),
            grid=row.grid,
            frame_from=number,
            motion=None,
        )
        made_number = maps.add_version(tx, of, new, now)
        events.add(tx, of, [("version", {"version": made_number, "cause": "restore"})], now)
        made = maps.version_at(tx, of.id, made_number)
    assert made is not None
    return as_document(of, made, restored)


def _commit(
    database: Database,
    of: MapRow,
    current: VersionRow,
    result: EditResult,
    caller: Principal,
    cause: str,
    under: VersionRow | None = None,
) -> VersionHead | None:
    """As a new version after `current`, on the grid of `under` (that of `current` itself); None where another is in force by now."""
    grid = under or current
    new = new_version(
        result.map,
        retired=result.retired,
        parent=current.number,
        cause=cause,
        mission=grid.mission,
        made_by=signature(caller),
        grid=grid.grid,
        frame_from=grid.number,
        motion=None,
    )
    with database.write() as tx:
        of, _, now = maps.lock(tx, of.id)
        if of.head != current.number:
            return None
        number = maps.add_version(tx, of, new, now)
        events.add(tx, of, [("version", {"version": number, "cause": cause})], now)
        return maps.version_head(tx, of.id, number)


def _stale(
    database: Database,
    of: MapRow,
    row: VersionRow,
    expected: int,
    operations: Sequence[Operation],
    caller: Principal,
) -> StaleVersion:
    """The error of an edit that was made to another version than the one in force, with what the two come to together."""
    with database.read() as tx:
        base = maps.version_at(tx, of.id, expected)
        between = None if base is None or expected > row.number else since(tx, of.id, expected, row.number)
    preview: api.EditPreview | None = None
    remaining: list[OperationDocument] = []
    conflicts: list[api.MergeConflict] = []
    if base is not None and between is not None:
        current = decode_map(row.document, ids_of(of))
        rebased = rebase(decode_map(base.document), current, operations, between.motion, between.touched)
        conflicts = [
            api.MergeConflict(
                pointer=clash.pointer,
                feature=clash.feature,
                detail=clash.detail,
                operation=None if clash.operation is None else operation_document(clash.operation),
            )
            for clash in rebased.clashes
        ]
        remaining = [operation_document(operation) for operation in rebased.operations]
        preview = None if rebased.result is None else _preview(of, row, rebased.result, caller)
    return StaleVersion(
        f"The map is at version {row.number}; the change was made to version {expected}.",
        current=row.number,
        mergeable=preview is not None,
        merge_preview=preview,
        merge_operations=remaining,
        merge_conflicts=conflicts,
    )


def _preview(of: MapRow, row: VersionRow, result: EditResult, caller: Principal) -> api.EditPreview:
    changed = {"number": row.number + 1, "parent": row.number, "cause": "edit", "made_by": signature(caller)}
    preview = VersionRow(**vars(row) | changed | {"created_at": datetime.now(UTC)})
    stored = document_fields(of, row, result.map)
    # The grid is that of the version in force: a preview has no address of its own.
    grid = {"grid": stored["grid"], "cells": stored["cells"]}
    made = [api.MadeFeature(pointer=pointer, feature=feature) for pointer, feature in result.made.items()]
    return api.EditPreview.model_validate(_fields(of, preview, result) | grid | {"made": made})


def ended_by_restore(current: SemanticMap, restored: SemanticMap) -> Mapping[str, str | None]:
    """Rooms that the restored version does not have -> the room of it that they were split from, where they were."""
    living = {r.id for r in restored.rooms}
    return {r.id: r.derived_from if r.derived_from in living else None for r in current.rooms if r.id not in living}


def _with_fixes(refused: InvalidEdit) -> InvalidEdit:
    fixes = [
        api.FixDocument(pointer=fix.pointer, title=fix.title, operation=operation_document(fix.operation))
        for fix in refused.extra.get("fixes", ())  # type: ignore[attr-defined]
    ]
    return InvalidEdit(refused.detail, refused.faults, fixes=fixes)


def _edited(of: MapRow, row: VersionHead, result: EditResult) -> api.EditedMap:
    return api.EditedMap.model_validate(_fields(of, row, result))


def _fields(of: MapRow, row: VersionHead, result: EditResult) -> dict[str, object]:
    problems = [
        api.EditProblem(
            code=p.code,
            severity=p.severity,
            feature=p.feature,
            message=p.message,
            fix=p.fix,
            fix_operation=None if p.operation is None else operation_document(p.operation),
        )
        for p in result.problems
    ]
    return document_fields(of, row, result.map) | {"problems": problems}
