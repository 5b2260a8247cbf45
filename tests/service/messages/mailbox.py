"""A mail server of the tests."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from email import message_from_bytes
from email.message import EmailMessage
from email.policy import default
from typing import Any

from aiosmtpd.controller import Controller
from aiosmtpd.smtp import SMTP, Envelope, Session

from stillroom.settings import MailServer
from tests.ports import free_port

ANN = "ann@example.org"
SENDER = "maps@example.org"


@dataclass
class MailBox:
    """What it does, and what it was sent."""

    port: int
    answer: str = "250 OK"
    to_recipient: str = "250 OK"
    messages: list[EmailMessage] = field(default_factory=list)
    senders: list[tuple[str | None, list[str]]] = field(default_factory=list)

    async def handle_RCPT(  # noqa: N802
        self, _server: SMTP, _session: Session, envelope: Envelope, address: str, _options: list[str]
    ) -> str:
        if self.to_recipient.startswith("250"):
            envelope.rcpt_tos.append(address)
        return self.to_recipient

    async def handle_DATA(self, _server: SMTP, _session: Session, envelope: Envelope) -> str:  # noqa: N802
        if self.answer.startswith("250"):
            content = envelope.content
            assert isinstance(content, bytes)
            parsed = message_from_bytes(content, policy=default)
            assert isinstance(parsed, EmailMessage)
            self.messages.append(parsed)
            self.senders.append((envelope.mail_from, envelope.rcpt_tos))
        return self.answer


@contextmanager
def mail_server(**how: Any) -> Iterator[MailBox]:
    box = MailBox(free_port())
    controller = Controller(box, hostname="127.0.0.1", port=box.port, ready_timeout=60.0, **how)
    controller.start()
    try:
        yield box
    finally:
        controller.stop()


def server_of(box: MailBox) -> MailServer:
    return MailServer("127.0.0.1", box.port, "none", None, None, SENDER)
