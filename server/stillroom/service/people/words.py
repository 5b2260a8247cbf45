"""What letters about accounts say."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Occasion = Literal["reset", "account", "member", "viewer"]


@dataclass(frozen=True)
class AccountWords:
    letters: Mapping[Occasion, tuple[str, str, str]]
    """Subject, text, button. `{home}`: whose home it is."""
    until: str
    ignore: str


WORDS: Mapping[str, AccountWords] = {
    "en": AccountWords(
        letters={
            "reset": (
                "Set a new password",
                "Somebody asked for a new password for the account of this address.",
                "Set a new password",
            ),
            "account": (
                "You are invited to stillroom",
                "Somebody who runs this service has made an account for this address.",
                "Accept the invitation",
            ),
            "member": (
                "You are invited to a home",
                "{home} asks you to look after the maps of their robots together: see them, edit them, answer questions.",
                "Accept the invitation",
            ),
            "viewer": (
                "You are invited to a home",
                "{home} asks you to see the maps of their robots.",
                "Accept the invitation",
            ),
        },
        until="The link works once, until {when}.",
        ignore="If you did not expect this, do nothing.",
    ),
    "de": AccountWords(
        letters={
            "reset": (
                "Neues Passwort setzen",
                "Jemand möchte für das Konto zu dieser Adresse ein neues Passwort.",
                "Neues Passwort setzen",
            ),
            "account": (
                "Einladung zu stillroom",
                "Jemand, der diesen Dienst betreibt, hat für diese Adresse ein Konto angelegt.",
                "Einladung annehmen",
            ),
            "member": (
                "Einladung in ein Zuhause",
                "{home} möchte die Karten der Roboter mit Ihnen gemeinsam pflegen: ansehen, bearbeiten, Fragen beantworten.",
                "Einladung annehmen",
            ),
            "viewer": (
                "Einladung in ein Zuhause",
                "{home} möchte Ihnen die Karten der Roboter zeigen.",
                "Einladung annehmen",
            ),
        },
        until="Der Link gilt einmal, bis {when}.",
        ignore="Haben Sie damit nicht gerechnet, tun Sie nichts.",
    ),
}
