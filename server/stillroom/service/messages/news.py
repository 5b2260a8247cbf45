"""What an event is news of, to programs and to people."""

from dataclasses import dataclass

from stillroom.documents.notifications import MessageKind, WebhookType
from stillroom.pipeline.questions import is_discovery
from stillroom.service.messages.links import page_url
from stillroom.store import conflicts, missions
from stillroom.store.database import Transaction
from stillroom.store.rows import ConflictRow, Json, UntoldRow


@dataclass(frozen=True)
class News:
    type: WebhookType
    data: Json
    """As its owner's programs are told."""
    kind: MessageKind | None = None
    """What a person is told of it; None: nothing."""

    @property
    def anonymous(self) -> Json:
        """As programs of the fleet are told: who runs the service sees numbers, and nothing that people wrote."""
        data = {
            name: value for name, value in self.data.items() if name not in ("summary", "reason", "decided_by", "room")
        }
        if "rooms" in data:
            data["rooms"] = [{name: value for name, value in room.items() if name != "name"} for room in data["rooms"]]
        return data


def news_of(tx: Transaction, event: UntoldRow, public_url: str) -> News | None:
    """None: nobody is told of it."""
    match event.kind:
        case "version":
            return News("map.updated", _about(event, public_url, "version", "cause", "mission"))
        case "mission" if event.data.get("outcome") == "parked":
            return _parked(tx, event, public_url)
        case "conflict":
            row = conflicts.by_key(tx, event.map_id, event.data["conflict"])
            return None if row is None else _conflict(event, row, public_url)
    return None


def _parked(tx: Transaction, event: UntoldRow, public_url: str) -> News:
    """People are told of the question that it opens: that one folds where missions of the other floor follow."""
    row = missions.by_key(tx, event.map_id, event.data["mission"])
    found = {} if row is None or row.result is None else row.result
    said = {"reason": found.get("reason", ""), "candidates": found.get("candidates", [])}
    return News("mission.parked", _about(event, public_url, "mission", "outcome", "version") | said)


def _conflict(event: UntoldRow, row: ConflictRow, public_url: str) -> News:
    data = _about(event, public_url, "conflict", "state", "mission", "version") | {
        name: getattr(row, name) for name in ("kind", "cause", "rooms", "dividers", "restrictions", "summary", "quiet")
    }
    state = event.data["state"]
    if state == "open":
        due = None if row.due_at is None else {"response": "reject", "at": row.due_at.isoformat()}
        return News("conflict.opened", data | {"default": due}, _kind(row))
    if state != "resolved_automatically":
        decided_at = row.decided_at and row.decided_at.isoformat()
        return News("conflict.closed", data | {"decided_by": row.decided_by, "decided_at": decided_at})
    if is_discovery(row) and row.rooms:
        found = {name: row.rooms[0][name] for name in ("id", "name")}
        return News("room.discovered", data | {"room": found}, None if row.quiet else "room")
    return News("conflict.resolved", data)


def _kind(row: ConflictRow) -> MessageKind | None:
    if row.quiet:
        return None
    return "parked" if row.kind == "wrong_map" else "conflict"


def _about(event: UntoldRow, public_url: str, *names: str) -> Json:
    about = {"robot": event.robot_id, "map": event.map_name} | {name: event.data.get(name) for name in names}
    return about | {"page": page_url(public_url, about)}
