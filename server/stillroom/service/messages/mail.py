"""E-mail: text, HTML and a picture of each question, with links that open the app; sent by the operator's SMTP server."""

import smtplib
import ssl
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import format_datetime
from html import escape
from urllib.parse import quote, urlsplit

from stillroom.service.messages.attempts import Attempt
from stillroom.service.messages.links import SignedLink, sign
from stillroom.service.messages.topics import Topic
from stillroom.service.messages.words import Words
from stillroom.settings import MailServer
from stillroom.store.rows import ReceiverRow

TIMEOUT_S = 20.0
"""Of each step of the conversation."""
CONFIRM_WITHIN = timedelta(days=3)
MOST_PICTURES = 4
MOST_TOPICS = 20
_POLICY = SMTP.clone(max_line_length=998)  # signed links are long, and folding would break them
BUTTON = "display:inline-block;padding:10px 18px;background:#1c6b48;color:#fff;text-decoration:none;border-radius:6px"
_OTHER = "display:inline-block;padding:9px 17px;border:1px solid #1c6b48;color:#1c6b48;text-decoration:none;border-radius:6px"


def confirmation(to: ReceiverRow, key: str, public_url: str, link_key: bytes, words: Words) -> EmailMessage:
    """Asks whether the address is right, and says nothing else."""
    until = datetime.now(UTC) + CONFIRM_WITHIN
    token = sign(SignedLink("confirm", to.key, to.address, until), link_key)
    url = f"{public_url}/email/confirm?token={quote(token)}"
    said, ignore = words.confirm_said, words.confirm_ignore
    made = message(to.address, key, words.confirm, public_url)
    made.set_content(f"{said}\n\n{words.confirm_open}\n{url}\n\n{ignore}\n")
    button = f'<a href="{escape(url)}" style="{BUTTON}">{words.confirm_button}</a>'
    made.add_alternative(html(f"<p>{escape(said)}</p><p>{button}</p><p>{escape(ignore)}</p>", words), subtype="html")
    return made


def letter(
    to: ReceiverRow,
    key: str,
    about: Sequence[Topic],
    pictures: Sequence[bytes],
    public_url: str,
    link_key: bytes,
    words: Words,
) -> EmailMessage:
    """All that is to be told at once. `pictures`: PNG of the first topics."""
    subject = about[0].title if len(about) == 1 else words.many.format(n=len(about))
    stop = f"{public_url}/email/stop?token={quote(sign(SignedLink('stop', to.key, to.address), link_key))}"
    shown, more = about[:MOST_TOPICS], len(about[MOST_TOPICS:])
    rest = words.more.format(n=more, url=f"{public_url}/questions") if more else ""
    made = message(to.address, key, subject, public_url)
    made["List-Unsubscribe"] = f"<{stop}>"
    made["List-Unsubscribe-Post"] = "List-Unsubscribe=One-Click"
    texts = [_plain(topic) for topic in shown]
    made.set_content("\n".join([*texts, *([rest] if rest else []), "-- ", f"{words.stop}: {stop}", ""]))
    # A content id is found within one message alone; it needs nothing more to be unique.
    ids = [f"picture{number}" for number in range(len(pictures))]
    parts = [_part(topic, ids[n] if n < len(ids) else None, words) for n, topic in enumerate(shown)]
    end = f'<p style="color:#555;font-size:13px"><a href="{escape(stop)}">{words.stop}</a></p>'
    body = "".join([*parts, f"<p>{escape(rest)}</p>" if rest else "", end])
    made.add_alternative(html(body, words), subtype="html")
    shown_as = made.get_body(("html",))
    assert shown_as is not None
    for name, picture in zip(ids, pictures, strict=True):
        shown_as.add_related(picture, "image", "png", cid=f"<{name}>", filename=f"{name}.png", disposition="inline")
    return made


def send(server: MailServer, letter: EmailMessage) -> Attempt:
    """Never raises what the network or the server may do."""
    letter["From"] = server.sender
    try:
        with _connected(server) as smtp:
            smtp.send_message(letter)
    except smtplib.SMTPRecipientsRefused as error:
        code, said = next(iter(error.recipients.values()))
        return _refusal(code, said, permanent=500 <= code < 600)
    except smtplib.SMTPDataError as error:
        return _refusal(error.smtp_code, error.smtp_error, permanent=500 <= error.smtp_code < 600)
    except smtplib.SMTPResponseException as error:  # of the server, not of this message: its operator can mend it
        return _refusal(error.smtp_code, error.smtp_error, permanent=False)
    except (OSError, smtplib.SMTPException) as error:
        return Attempt("failed", f"The mail server could not be used: {error}")
    return Attempt("delivered")


def _connected(server: MailServer) -> smtplib.SMTP:
    """Encrypted and signed in as the settings say; ends with the block, also where a step fails."""
    trust = ssl.create_default_context()
    smtp: smtplib.SMTP
    if server.security == "tls":
        smtp = smtplib.SMTP_SSL(server.host, server.port, timeout=TIMEOUT_S, context=trust)
    else:
        smtp = smtplib.SMTP(server.host, server.port, timeout=TIMEOUT_S)
    try:
        if server.security == "starttls":
            smtp.starttls(context=trust)
        if server.user is not None:
            smtp.login(server.user, server.password or "")
    except BaseException:
        smtp.close()
        raise
    return smtp


def _refusal(code: int, said: bytes | str, permanent: bool) -> Attempt:
    text = said.decode(errors="replace") if isinstance(said, bytes) else said
    reason = f"The mail server answered {code}: {' '.join(text.split())[:300]}"
    return Attempt("refused" if permanent else "failed", reason, code)


def message(address: str, key: str, subject: str, public_url: str) -> EmailMessage:
    """An empty one."""
    made = EmailMessage(_POLICY)
    made["Subject"] = " ".join(subject.split())[:200]
    made["To"] = address
    made["Date"] = format_datetime(datetime.now(UTC))
    # The same for every attempt, so that whoever gets it twice is shown it once.
    made["Message-ID"] = f"<{key}@{urlsplit(public_url).hostname}>"
    made["Auto-Submitted"] = "auto-generated"
    return made


def _plain(topic: Topic) -> str:
    return "\n".join([topic.title, topic.text, topic.url, *(f"{said}: {url}" for said, url in topic.answers), ""])


def _part(topic: Topic, cid: str | None, words: Words) -> str:
    """With a button for each answer; each leads to the page that shows what it means and asks whether it is meant."""
    title = f"<h2 style='font-size:18px;margin:24px 0 8px'>{escape(topic.title)}</h2><p>{escape(topic.text)}</p>"
    picture = "" if cid is None else f'<p><img src="cid:{cid}" alt="{escape(topic.text)}" style="max-width:100%"></p>'
    links = [*topic.answers, (words.look_first if topic.answers else words.look, topic.url)]
    buttons = "".join(
        f'<p><a href="{escape(url)}" style="{_OTHER if number else BUTTON}">{escape(said)}</a></p>'
        for number, (said, url) in enumerate(links)
    )
    return f"{title}{picture}{buttons}"


def html(body: str, words: Words) -> str:
    return (
        f'<!doctype html><html lang="{words.language}"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f'<body style="font:16px/1.5 sans-serif;color:#222;max-width:640px">{body}</body></html>'
    )
