"""People look at conflicts."""

from collections.abc import Sequence

from stillroom.documents.api import Page
from stillroom.documents.conflicts import ConflictDocument
from stillroom.documents.features import features
from stillroom.documents.stored import decode_map
from stillroom.errors import NotFound
from stillroom.service.access import Principal, visible_to
from stillroom.service.maps import find_map
from stillroom.service.paging import page_of
from stillroom.store import conflicts
from stillroom.store.database import Database, Transaction
from stillroom.store.robots import Selection
from stillroom.store.rows import ConflictRow, MapRow, ProposalRow


def list_conflicts(
    database: Database, robot_id: str, map_name: str, state: str | None, cursor: int | None, limit: int
) -> Page[ConflictDocument]:
    """The newest first. Raises NotFound."""
    with database.read() as tx:
        of = find_map(tx, robot_id, map_name)
        return _page(tx, conflicts.is_of_map(of.id), state, cursor, limit)


def list_all_conflicts(
    database: Database, caller: Principal, state: str | None, cursor: int | None, limit: int
) -> Page[ConflictDocument]:
    """Of all maps that the caller may see, the newest first."""
    with database.read() as tx:
        return _page(tx, visible_to(caller), state, cursor, limit)


def conflict_by_key(database: Database, robot_id: str, map_name: str, key: str) -> ConflictDocument:
    """Raises NotFound."""
    with database.read() as tx:
        _, row = find_conflict(tx, robot_id, map_name, key)
        return documents(tx, [row])[0]


def find_conflict(tx: Transaction, robot_id: str, map_name: str, key: str) -> tuple[MapRow, ConflictRow]:
    """Raises NotFound."""
    of = find_map(tx, robot_id, map_name)
    row = conflicts.by_key(tx, of.id, key)
    if row is None:
        raise NotFound(f"The map {map_name} of {robot_id} has no conflict {key}.")
    return of, row


def conflict_url(row: ConflictRow) -> str:
    return f"/api/v1/robots/{row.robot_id}/maps/{row.map_name}/conflicts/{row.key}"


def documents(tx: Transaction, rows: Sequence[ConflictRow]) -> list[ConflictDocument]:
    proposed = conflicts.proposals(tx, [row.sighting_id for row in rows])
    return [_document(row, proposed[row.sighting_id]) for row in rows]


def _page(tx: Transaction, of: Selection, state: str | None, cursor: int | None, limit: int) -> Page[ConflictDocument]:
    rows, following = page_of(conflicts.page(tx, of, state, cursor, limit + 1), limit, lambda row: str(row.id))
    return Page(items=documents(tx, rows), next=following)


def _document(row: ConflictRow, proposed: Sequence[ProposalRow]) -> ConflictDocument:
    url = conflict_url(row)
    return ConflictDocument.model_validate(
        {
            "id": row.key,
            "robot": row.robot_id,
            "map": row.map_name,
            **{name: getattr(row, name) for name in _SAME},
            "proposals": [
                {
                    "id": proposal.name,
                    "action": proposal.action,
                    "recommended": proposal.recommended,
                    "features": features(decode_map(proposal.changes)),
                    "result": f"{url}/proposals/{proposal.name}",
                }
                for proposal in proposed
            ],
            "default": None if row.due_at is None else {"at": row.due_at},
            "url": url,
        }
    )


_SAME = (
    "kind", "cause", "rooms", "dividers", "restrictions", "mission", "base_version", "state", "summary", "opened_at",
    "fold_count", "response", "proposal", "note", "decided_by", "decided_at", "version", "superseded_by", "quiet",
)  # fmt: skip
