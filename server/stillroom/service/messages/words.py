"""What messages say, in the languages that the app has. The web app's own words are in web/src/texts; both say the same of the same."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from stillroom.documents.notifications import Language
from stillroom.pipeline.questions import is_discovery
from stillroom.service.messages.answers import Saying
from stillroom.store.rows import ConflictRow, Json, ProposalRow


@dataclass(frozen=True)
class Page:
    """One that the service makes itself, where a link in an e-mail leads."""

    title: str
    text: str
    button: str = ""


@dataclass(frozen=True)
class Words:
    language: Language
    and_: str
    date: str
    months: tuple[str, ...]
    """Empty: numbers do."""
    point: str
    """In decimal numbers."""
    confirm: str
    confirm_said: str
    confirm_open: str
    confirm_ignore: str
    confirm_button: str
    many: str
    more: str
    stop: str
    look: str
    look_first: str
    test: tuple[str, str]
    grant: tuple[str, str]
    """Somebody asks to look at floor plans."""
    service: Mapping[str, tuple[str, str]]
    """Of rollouts and rates, by kind of message."""
    deadline: str
    which_floor: str
    new_room: tuple[str, str]
    """Without a name, with one."""
    question: tuple[str, str]
    """About the map, about rooms."""
    answers: Mapping[Saying, tuple[str, str, str]]
    """About no room, one, more."""
    summaries: Mapping[str, str]
    """What questions are about, by kind and cause; where there is none, the core's own sentence is told."""
    ask_to_confirm: Page
    confirmed: Page
    ask_to_sign_in: Page
    ask_to_stop: Page
    stopped: Page
    failed: str

    def day(self, at: datetime) -> str:
        month = self.months[at.month - 1]
        return self.date.format(day=at.day, month=month, year=at.year, time=f"{at:%H:%M}")

    def figure(self, value: object) -> str:
        """Shares as per cent; all else as it is."""
        return f"{100 * value:.1f} %".replace(".", self.point) if isinstance(value, float) else str(value)

    def listed(self, names: Sequence[str]) -> str:
        return f" {self.and_} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)

    def answer(self, saying: Saying, names: Sequence[str]) -> str:
        return self.answers[saying][min(len(names), 2)].format(rooms=self.listed(names))

    def summary(self, row: ConflictRow, proposals: Sequence[ProposalRow]) -> str:
        """What a question is about."""
        template = next((self.summaries[key] for key in _keys(row, proposals) if key in self.summaries), None)
        if template is None:
            return row.summary
        lost = round(100 * (1 - min((room["recall"] for room in row.rooms), default=1.0)))
        names = [room["name"] for room in (row.rooms if row.resolved else concerned(row))]
        return template.format(rooms=self.listed(names), percent=lost)


def concerned(row: ConflictRow) -> list[Json]:
    """The rooms that did not come through; all, where none failed."""
    return [room for room in row.rooms if not room["passed"]] or row.rooms


def words_of(language: str | None) -> Words:
    return next((words for words in (ENGLISH, GERMAN) if words.language == language), ENGLISH)


def preferred(accepted: str) -> Words:
    """By an `Accept-Language` header."""
    tags = (tag.strip()[:2].lower() for tag in accepted[:1000].split(","))
    return words_of(next((tag for tag in tags if tag in ("en", "de")), None))


def _keys(row: ConflictRow, proposals: Sequence[ProposalRow]) -> list[str]:
    """The most fitting one first."""
    actions = {proposal.action for proposal in proposals}
    of_room = row.kind.startswith("room_")
    keys = []
    if is_discovery(row):
        keys.append("discovery")
    elif row.kind == "connectivity" and "keep_previous" in actions:
        keys.append(f"held {row.cause}")
    keys.append(f"{row.kind} {row.cause}")
    if of_room and row.resolved:
        keys.append("settled")
    elif of_room and actions & {"meta_dividers", "meta_occupancy"}:
        keys.append("held room")
    return [*keys, row.kind if row.rooms else f"{row.kind} nowhere", row.kind]


def _same(text: str) -> tuple[str, str, str]:
    return text, text, text


ENGLISH = Words(
    language="en",
    and_="and",
    date="{day:02} {month} {year}, {time} UTC",
    months=(
        "January", "February", "March", "April", "May", "June",
        "July", "August", "September", "October", "November", "December",
    ),
    point=".",
    confirm="Confirm your address",
    confirm_said="Somebody asked for messages about a robot's maps to be sent to this address.",
    confirm_open="To confirm that it was you, open",
    confirm_ignore="If it was not you, do nothing: no other message will come. The link works for three days.",
    confirm_button="Confirm",
    many="{n} questions about your maps",
    more="And {n} more: {url}",
    stop="No more messages",
    look="Look and answer",
    look_first="Look at it first",
    test=("This is a test", "Messages about your maps reach you here."),
    grant=(
        "May somebody look at your floor plan?",
        ("Those who run the service ask to look at the floor plans of {robot} for {hours} hours. They say: {reason} "
        "Without your leave they see numbers alone, and each look is listed for you. The question ends on {when}."),
    ),
    service={
        "rollout.advanced": (
            "{rollout}: now in {stage} % of homes", "The rollout {rollout} passed its gates and goes on in {stage} % of homes."
        ),
        "rollout.halted": (
            "{rollout} was halted",
            "The rollout {rollout} harms and was halted at {stage} % of homes, which go back to what they had. {reason}",
        ),
        "rollout.successful": (
            "{rollout} is in force", "The rollout {rollout} has reached all homes and passed its gates."
        ),
        "rollout.ended": (
            "{rollout} has ended", "The rollout {rollout} ended undecided at {stage} % of homes. {reason}"
        ),
        "alert.raised": (
            "{alert}: {share}",
            "{measure} is at {share} ({low} to {high}) of {missions} missions since {first}, and surely above {above}.",
        ),
        "alert.ended": (
            "{alert}: over", "{measure} is at {share} of {missions} missions since {first}, and below {below} again."
        ),
    },
    deadline="If nobody answers by {when}, the map stays as it was.",
    which_floor="which floor is this?",
    new_room=("a new room", "a new room, {rooms}"),
    question=("a question about your map", "a question about {rooms}"),
    answers={
        "keep": ("Keep the map as it was", "Keep {rooms} as it was", "Keep {rooms} as they were"),
        "take_new": _same("Take the new map"),
        "right": _same("It is right as it is now"),
        "repaired": _same("Take the map with the repair"),
        "apart": ("Keep the rooms apart", "Keep {rooms} apart", "Keep {rooms} apart"),
        "together": ("The rooms are one", "{rooms} are one room", "{rooms} are one room"),
        "wall": _same("There really is a wall"),
        "leave": _same("Leave everything as it is"),
        "door": _same("This is a door"),
        "no_door": _same("It is no door"),
        "own_room": ("It is a room of its own", "{rooms} is a room of its own", "{rooms} are rooms of their own"),
        "part": _same("It is part of the next room"),
    },
    summaries={"wrong_map": "A mission waits for its floor."},
    ask_to_confirm=Page("Confirm your address", "Messages about your maps will be sent to it.", "Confirm"),
    confirmed=Page("Address confirmed", "Messages are sent to {address} from now on."),
    ask_to_sign_in=Page("Sign in?", "This link signs this browser in as {address}.", "Sign in"),
    ask_to_stop=Page("No more messages?", "None will be sent to this address any more.", "Stop messages"),
    stopped=Page("No more messages", "Nothing is sent to {address} any more."),
    failed="That did not work",
)  # fmt: skip

GERMAN = Words(
    language="de",
    and_="und",
    date="{day}. {month} {year}, {time} UTC",
    months=(
        "Januar", "Februar", "März", "April", "Mai", "Juni",
        "Juli", "August", "September", "Oktober", "November", "Dezember",
    ),
    point=",",
    confirm="Bestätigen Sie Ihre Adresse",
    confirm_said="Jemand möchte, dass Nachrichten über die Karten eines Roboters an diese Adresse gehen.",
    confirm_open="Waren Sie es, öffnen Sie",
    confirm_ignore="Waren Sie es nicht, tun Sie nichts: Es kommt keine weitere Nachricht. Der Link gilt drei Tage.",
    confirm_button="Bestätigen",
    many="{n} Fragen zu Ihren Karten",
    more="Und {n} weitere: {url}",
    stop="Keine Nachrichten mehr",
    look="Ansehen und antworten",
    look_first="Erst ansehen",
    test=("Das ist ein Versuch", "Nachrichten über Ihre Karten erreichen Sie hier."),
    grant=(
        "Darf jemand Ihren Grundriss ansehen?",
        ("Wer den Dienst betreibt, möchte für {hours} Stunden die Grundrisse von {robot} ansehen. Begründung: {reason} "
        "Ohne Ihre Erlaubnis sind nur Zahlen zu sehen, und jeder Blick wird für Sie aufgeführt. Die Frage endet am {when}."),
    ),
    service={
        "rollout.advanced": (
            "{rollout}: jetzt bei {stage} % der Haushalte",
            "Der Rollout {rollout} hat bestanden und geht bei {stage} % der Haushalte weiter.",
        ),
        "rollout.halted": (
            "{rollout} wurde angehalten",
            ("Der Rollout {rollout} schadet und wurde bei {stage} % der Haushalte angehalten; "
            "sie haben wieder, was sie hatten. {reason}"),
        ),
        "rollout.successful": (
            "{rollout} gilt jetzt", "Der Rollout {rollout} hat alle Haushalte erreicht und bestanden."
        ),
        "rollout.ended": (
            "{rollout} ist beendet",
            "Der Rollout {rollout} wurde bei {stage} % der Haushalte ohne Ergebnis beendet. {reason}",
        ),
        "alert.raised": (
            "{alert}: {share}",
            "{measure} liegt bei {share} ({low} bis {high}) von {missions} Fahrten seit {first}, sicher über {above}.",
        ),
        "alert.ended": (
            "{alert}: vorbei",
            "{measure} liegt bei {share} von {missions} Fahrten seit {first}, wieder unter {below}.",
        ),
    },
    deadline="Antwortet bis {when} niemand, bleibt die Karte, wie sie war.",
    which_floor="Welches Stockwerk ist das?",
    new_room=("ein neuer Raum", "ein neuer Raum, {rooms}"),
    question=("eine Frage zu Ihrer Karte", "eine Frage zu {rooms}"),
    answers={
        "keep": ("Die Karte lassen, wie sie war", "{rooms} lassen, wie es war", "{rooms} lassen, wie sie waren"),
        "take_new": _same("Die neue Karte nehmen"),
        "right": _same("Es ist richtig, wie es jetzt ist"),
        "repaired": _same("Die Karte mit der Reparatur nehmen"),
        "apart": ("Die Räume getrennt lassen", "{rooms} getrennt lassen", "{rooms} getrennt lassen"),
        "together": ("Die Räume sind einer", "{rooms} sind ein Raum", "{rooms} sind ein Raum"),
        "wall": _same("Dort ist wirklich eine Wand"),
        "leave": _same("Alles lassen, wie es ist"),
        "door": _same("Das ist eine Tür"),
        "no_door": _same("Das ist keine Tür"),
        "own_room": ("Das ist ein eigener Raum", "{rooms} ist ein eigener Raum", "{rooms} sind eigene Räume"),
        "part": _same("Das gehört zum Raum daneben"),
    },
    summaries={
        "room_lost": "Nicht wiedergefunden: {rooms}.",
        "room_recall": "{percent} % von {rooms} sind weg.",
        "room_precision": "Mit der Umgebung zusammengelaufen: {rooms}.",
        "settled": "Trotz einer Änderung wie zuvor gehalten: {rooms}.",
        "held room": "Mit einer Reparatur bliebe wie zuvor, was sich geändert hat: {rooms}.",
        "divider_lost nowhere": "Eine Trennlinie fand keine Wand, an der sie enden kann, und ist nicht mehr auf der Karte.",
        "divider_lost": "Die Trennlinie bei {rooms} fand keine Wand, an der sie enden kann, und ist nicht mehr auf der Karte.",
        "connectivity door_closed": "Der Weg zwischen {rooms} war zu und ist wieder offen. Ist dort eine Tür?",
        "held new_passage": "Ein neuer Raum käme hinzu.",
        "held unknown": "Die Karte würde repariert.",
        "discovery": "Ein neuer Raum wurde gefunden: {rooms}.",
        "connectivity nowhere": "Der Roboter findet einen offenen Weg, wo die Karte trennt.",
        "connectivity": "Der Roboter findet einen offenen Weg, wo die Karte {rooms} trennt.",
        "shape nowhere": (
            "Die Räume wurden wiedergefunden, aber die neue Karte ist in sich nicht stimmig. Die vorige blieb."
        ),
        "shape": "{rooms} hat eine andere Form.",
        "drift": "{rooms} ist gegen die anderen Räume verrutscht: {percent} % der Fläche liegen jetzt anderswo.",
        "wrong_map": "Eine Fahrt sucht ihr Stockwerk.",
        "restriction_unplaced": "Eine Zone fand auf der neuen Karte keinen Platz. Bitte zeichnen Sie sie neu.",
    },
    ask_to_confirm=Page("Adresse bestätigen", "Nachrichten über Ihre Karten gehen dann dorthin.", "Bestätigen"),
    confirmed=Page("Adresse bestätigt", "Nachrichten gehen von jetzt an an {address}."),
    ask_to_sign_in=Page("Anmelden?", "Dieser Link meldet diesen Browser an als: {address}.", "Anmelden"),
    ask_to_stop=Page("Keine Nachrichten mehr?", "An diese Adresse wird dann keine mehr gesendet.", "Beenden"),
    stopped=Page("Keine Nachrichten mehr", "An {address} wird nichts mehr gesendet."),
    failed="Das ging nicht",
)  # fmt: skip
