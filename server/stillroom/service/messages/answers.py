"""What a message offers to answer. A link picks the answer out; that it is meant is said in the app (web/src/review/answers.ts has them all)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from stillroom.pipeline.questions import is_discovery, is_door
from stillroom.store.rows import ConflictRow, ProposalRow

Saying = Literal[
    "keep", "take_new", "right", "repaired", "apart", "together", "wall", "leave", "door", "no_door", "own_room", "part"
]
MOST = 3


@dataclass(frozen=True)
class Answer:
    key: str
    """As in an address: `accept:p1`, `reject`."""
    saying: Saying


def answers(row: ConflictRow, was_taken: bool, proposals: Sequence[ProposalRow]) -> list[Answer]:
    """The recommended one first; none where the answer is a floor. `was_taken`: the mission's map is in force."""
    if row.kind == "wrong_map":
        return []
    ordered = sorted(proposals, key=lambda proposal: not proposal.recommended)
    found = [Answer(f"accept:{proposal.name}", _saying(row, proposal.action, was_taken)) for proposal in ordered]
    if not any(proposal.action == "keep_previous" for proposal in proposals):
        found.append(Answer("reject", "no_door" if is_door(row) else "leave" if was_taken else "keep"))
    return found[:MOST]


def _saying(row: ConflictRow, action: str, was_taken: bool) -> Saying:
    if is_discovery(row):
        return "part" if action == "keep_previous" else "own_room"
    if is_door(row):
        return "no_door" if action == "keep_previous" else "door"
    if action == "keep_previous":
        return "keep"
    if not was_taken:
        return "take_new" if action == "take_new" else "repaired"
    if action == "take_new":
        return "together" if row.kind == "connectivity" else "right"
    return "apart" if action == "meta_dividers" else "wall"
