"""E-mail about accounts. It is sent at once and not queued: what it says is a secret, which is kept nowhere."""

from datetime import datetime
from email.message import EmailMessage
from html import escape

import structlog

from stillroom.errors import Unavailable
from stillroom.service.messages import mail
from stillroom.service.messages.words import Words
from stillroom.service.people.tokens import new_secret
from stillroom.service.people.words import WORDS, Occasion
from stillroom.settings import MailServer, Messaging

log = structlog.get_logger()


def letter(
    to: str, occasion: Occasion, url: str, until: datetime, words: Words, public_url: str, home: str = ""
) -> EmailMessage:
    said = WORDS[words.language]
    subject, text, button = (part.format(home=home) for part in said.letters[occasion])
    end = f"{said.until.format(when=words.day(until))} {said.ignore}"
    made = mail.message(to, f"account-{new_secret()}", subject, public_url)
    made.set_content(f"{text}\n\n{button}:\n{url}\n\n{end}\n")
    shown = f'<a href="{escape(url)}" style="{mail.BUTTON}">{escape(button)}</a>'
    body = f"<p>{escape(text)}</p><p>{shown}</p><p>{escape(end)}</p>"
    made.add_alternative(mail.html(body, words), subtype="html")
    return made


def server_of(messaging: Messaging) -> MailServer:
    """Raises Unavailable."""
    if messaging.mail is None:
        raise Unavailable("This service sends no e-mail: its operator has not said by which server.", 3600)
    return messaging.mail


def post(server: MailServer, made: EmailMessage) -> None:
    """Raises Unavailable where the mail server does not take it."""
    attempt = mail.send(server, made)
    if attempt.result != "delivered":
        log.warning("a letter about an account was not taken", reason=attempt.reason)
        raise Unavailable(attempt.reason or "The mail server could not be used.", 60)
