"""What messages say, in each language, and what they offer to answer."""

from datetime import UTC, datetime
from typing import Any, get_args

import pytest

from stillroom.pipeline.conflicts import Action, Cause, ConflictKind
from stillroom.service.messages.answers import Saying, answers
from stillroom.service.messages.words import ENGLISH, GERMAN, Words, preferred, words_of
from stillroom.store.rows import ConflictRow, ProposalRow

BOTH = pytest.mark.parametrize("words", [ENGLISH, GERMAN], ids=["en", "de"])
NOW = datetime(2026, 3, 5, 8, 41, tzinfo=UTC)


def row(kind: str = "room_recall", cause: str = "unknown", resolved: bool = False, **rooms: float) -> ConflictRow:
    """`rooms`: how much of each was found again."""
    values: dict[str, Any] = dict.fromkeys(ConflictRow.__dataclass_fields__)
    found = [{"id": n, "name": n, "precision": 1.0, "recall": r, "passed": r > 0.5} for n, r in rooms.items()]
    values |= {"kind": kind, "cause": cause, "resolved": resolved, "rooms": found, "summary": "The core's own."}
    return ConflictRow(**values)


def offer(*actions: Action, recommended: int = 0) -> list[ProposalRow]:
    return [ProposalRow(1, f"p{n + 1}", action, n == recommended, {}) for n, action in enumerate(actions)]


@pytest.mark.parametrize(
    ("asked", "was_taken", "proposals", "offered"),
    [
        (row(), False, offer("take_new", "keep_previous"), ["accept:p1 take_new", "accept:p2 keep"]),
        (row(), False, offer("take_new", "keep_previous", recommended=1), ["accept:p2 keep", "accept:p1 take_new"]),
        (row(), False, offer("meta_dividers"), ["accept:p1 repaired", "reject keep"]),
        (row("drift", "drift"), True, offer("take_new"), ["accept:p1 right", "reject leave"]),
        (
            row("connectivity", "new_passage"),
            True,
            offer("meta_dividers", "take_new"),
            ["accept:p1 apart", "accept:p2 together", "reject leave"],
        ),
        (
            row("connectivity", "wall_gap"),
            True,
            offer("meta_occupancy", "take_new"),
            ["accept:p1 wall", "accept:p2 together", "reject leave"],
        ),
        (row("connectivity", "door_closed"), True, offer("take_new"), ["accept:p1 door", "reject no_door"]),
        (
            row("connectivity", "new_passage", resolved=True),
            True,
            offer("take_new", "keep_previous"),
            ["accept:p1 own_room", "accept:p2 part"],
        ),
        (row("wrong_map"), False, offer(), []),
    ],
)
def test_answers_begin_with_the_recommended_one(
    asked: ConflictRow, was_taken: bool, proposals: list[ProposalRow], offered: list[str]
) -> None:
    assert [f"{one.key} {one.saying}" for one in answers(asked, was_taken, proposals)] == offered


@BOTH
def test_every_answer_can_be_said_of_any_number_of_rooms(words: Words) -> None:
    for saying in get_args(Saying):
        for names in ([], ["Bath"], ["Bath", "{Hall}"], ["Bath", "{Hall}", "Study"]):
            said = words.answer(saying, names)
            assert said
            assert said.startswith(tuple("ABCDEFGHIJKLMNOPQRSTUVWXYZ"))
    assert words.listed(["A", "B", "C"]) == f"A, B {words.and_} C"


@BOTH
def test_a_day_is_written_out(words: Words) -> None:
    assert words.day(NOW) == {"en": "05 March 2026, 08:41 UTC", "de": "5. März 2026, 08:41 UTC"}[words.language]


def test_in_german_every_question_has_words_of_its_own() -> None:
    for kind in get_args(ConflictKind):
        for cause in get_args(Cause):
            for resolved in (False, True):
                for proposals in (offer("take_new"), offer("meta_dividers"), offer("keep_previous")):
                    for rooms in ({}, {"Bad": 0.4}):
                        said = GERMAN.summary(row(kind, cause, resolved, **rooms), proposals)
                        assert said != "The core's own.", (kind, cause)
                        assert "{" not in said


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (row(Bad=0.41, Flur=0.9), "59 % von Bad sind weg."),
        (row("room_lost", Bad=0.0, Flur=0.3), "Nicht wiedergefunden: Bad und Flur."),
        (row("room_lost", resolved=True, Bad=0.0, Flur=0.9), "Trotz einer Änderung wie zuvor gehalten: Bad und Flur."),
        (row("connectivity", "door_closed", Bad=1.0, Flur=1.0), "Der Weg zwischen Bad und Flur war zu"),
        (row("connectivity", "new_passage", resolved=True, Bad=1.0), "Ein neuer Raum wurde gefunden: Bad."),
        (row("drift", "drift", Bad=0.8), "Bad ist gegen die anderen Räume verrutscht: 20 % der Fläche"),
    ],
)
def test_in_german_numbers_and_rooms_are_told(asked: ConflictRow, said: str) -> None:
    assert GERMAN.summary(asked, offer("take_new")).startswith(said)
    assert ENGLISH.summary(asked, offer("take_new")) == "The core's own."


@pytest.mark.parametrize(
    ("header", "language"),
    [
        ("de-AT,de;q=0.9,en;q=0.8", "de"),
        ("fr-FR, de;q=0.5, en;q=0.3", "de"),
        ("en-GB", "en"),
        ("fr", "en"),
        ("", "en"),
        (",;q=" * 10_000 + "de", "en"),
    ],
)
def test_a_browser_s_first_language_that_there_is_is_taken(header: str, language: str) -> None:
    assert preferred(header).language == language
    assert words_of(None) is words_of("xx") is ENGLISH
