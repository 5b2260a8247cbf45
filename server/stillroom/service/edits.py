"""People change maps: edits, old versions brought back, names.

Nothing is held while it is computed: a change is made from a version, and committed only if that is still the one in force. A
mission that is being processed meanwhile does the same, and is then carried over from the changed map.
"""

from collections.abc import Sequence
from datetime import UTC, datetime

from stillroom.documents import api
from stillroom.documents.stored import decode_map
from stillroom.errors import NotFound, StaleVersion
from stillroom.maps.semantics import SemanticMap
from stillroom.pipeline.edits import EditResult, Operation, apply_edits
from stillroom.service.accounts import Principal, signature
from stillroom.service.maps import as_document, document_fields, find_in_force, find_map, find_version, map_summary
from stillroom.service.versions import ids_of, new_version
from stillroom.store import clock, events, lanes, maps
from stillroom.store.database import Database
from stillroom.store.rows import MapRow, VersionHead, VersionRow


def edit_map(
    database: Database,
    caller: Principal,
    robot_id: str,
    map_name: str,
    expected: int,
    operations: Sequence[Operation],
    dry_run: bool,
) -> api.EditedMap:
    """All operations on version `expected` as one new version. Raises NotFound, StaleVersion, InvalidEdit.

    Computed outside of any transaction; committed only if `expected` is still in force. A mission that is being processed
    meanwhile notices the same way, and is then carried over from the edited map.
    """
    of, row = _expected(database, robot_id, map_name, expected)
    result = apply_edits(decode_map(row.document, ids_of(of)), operations)
    made_by = signature(caller)
    if dry_run:
        changed = {"number": row.number + 1, "parent": row.number, "cause": "edit", "made_by": made_by}
        preview = VersionRow(**vars(row) | changed | {"created_at": datetime.now(UTC)})
        return _edited(of, preview, result)
    new = new_version(
        result.map,
        retired=result.retired,
        parent=row.number,
        cause="edit",
        mission=row.mission,
        made_by=made_by,
        grid=row.grid,
        frame_from=row.number,
        motion=None,
    )
    with database.write() as tx:
        lanes.lock(tx, of.id)
        _check_in_force(maps.get(tx, of.id), expected)
        now = clock.now(tx)
        number = maps.add_version(tx, of.id, new, now)
        events.add(tx, of, [("version", {"version": number, "cause": "edit"})], now)
        made = maps.version_at(tx, of.id, number)
    assert made is not None
    return _edited(of, made, result)


def restore_version(
    database: Database, caller: Principal, robot_id: str, map_name: str, number: int
) -> api.MapDocument:
    """An old version again, as a new one. Raises NotFound."""
    with database.write() as tx:
        found, _ = find_in_force(tx, robot_id, map_name)
        lanes.lock(tx, found.id)
        of, head = find_in_force(tx, robot_id, map_name)
        row, current = maps.version_at(tx, of.id, number), maps.version_at(tx, of.id, head)
        if row is None or current is None:
            raise NotFound(f"The map {map_name} of {robot_id} has no version {number}.")
        restored, now = decode_map(row.document, ids_of(of)), clock.now(tx)
        new = new_version(
            restored,
            retired=_ended_by_restore(decode_map(current.document), restored),
            parent=head,
            cause="restore",
            mission=row.mission,
            made_by=signature(caller),
            grid=row.grid,
            frame_from=number,
            motion=None,
        )
        made_number = maps.add_version(tx, of.id, new, now)
        events.add(tx, of, [("version", {"version": made_number, "cause": "restore"})], now)
        made = maps.version_at(tx, of.id, made_number)
    assert made is not None
    return as_document(of, made, restored)


def change_settings(database: Database, robot_id: str, map_name: str, settings: api.MapSettings) -> api.MapSummary:
    """Raises NotFound."""
    values = {"title": settings.name and settings.name.strip(), "review": settings.review}
    changed = {name: value for name, value in values.items() if value is not None}
    with database.write() as tx:
        of = find_map(tx, robot_id, map_name)
        if changed:
            maps.change_settings(tx, of.id, changed)
            events.add(tx, of, [("settings", {})], clock.now(tx))
        of = maps.get(tx, of.id)
        return map_summary(of, maps.heads(tx, [of]).get(of.id))


def _expected(database: Database, robot_id: str, map_name: str, expected: int) -> tuple[MapRow, VersionRow]:
    of, row = find_version(database, robot_id, map_name)
    _check_in_force(of, expected)
    return of, row


def _check_in_force(of: MapRow, expected: int) -> None:
    if of.head != expected:
        raise StaleVersion(
            f"The map is at version {of.head}; the change was made to version {expected}.", current=of.head
        )


def _ended_by_restore(current: SemanticMap, restored: SemanticMap) -> dict[str, str | None]:
    """Rooms that the restored version does not have -> the room of it that they were split from, where they were."""
    living = {r.id for r in restored.rooms}
    return {r.id: r.derived_from if r.derived_from in living else None for r in current.rooms if r.id not in living}


def _edited(of: MapRow, row: VersionHead, result: EditResult) -> api.EditedMap:
    problems = [api.EditProblem.model_validate(vars(problem)) for problem in result.problems]
    return api.EditedMap.model_validate(document_fields(of, row, result.map) | {"problems": problems})
