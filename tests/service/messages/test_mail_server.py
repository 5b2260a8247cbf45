"""The conversation with a mail server."""

from dataclasses import replace
from email.message import EmailMessage
from pathlib import Path
from typing import Any

import pytest
from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from stillroom.service.messages import mail
from stillroom.settings import MailServer
from tests.service.messages.certificates import self_signed
from tests.service.messages.mailbox import ANN, SENDER, mail_server, server_of
from tests.telling import Json, silent


def plain_message() -> EmailMessage:
    message = EmailMessage()
    message["To"], message["Subject"] = ANN, "Hello"
    message.set_content("Hello")
    return message


def only_ann(_server: SMTP, _session: Session, _envelope: Envelope, _mechanism: str, data: LoginPassword) -> AuthResult:
    return AuthResult(success=(data.login, data.password) == (b"ann", b"secret"), handled=False)


@pytest.mark.filterwarnings(
    "ignore:Requiring AUTH while not requiring TLS"
)  # the test's server does not know that it has TLS
@pytest.mark.parametrize("security", ["starttls", "tls"])
def test_the_conversation_is_encrypted_with_a_server_that_somebody_vouches_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, security: Any
) -> None:
    context = self_signed(tmp_path, "localhost")
    how: Json = {"ssl_context": context} if security == "tls" else {"tls_context": context, "require_starttls": True}
    with mail_server(**how, authenticator=only_ann, auth_required=True, auth_require_tls=security == "starttls") as box:
        server = MailServer("localhost", box.port, security, "ann", "secret", SENDER)
        untrusted = mail.send(server, plain_message())
        assert (untrusted.result, "CERTIFICATE_VERIFY_FAILED" in str(untrusted.reason)) == ("failed", True)
        monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "certificate.pem"))
        assert mail.send(server, plain_message()).result == "delivered"
        wrong = mail.send(replace(server, password="guess"), plain_message())
        assert (wrong.result, wrong.status_code) == ("failed", 535), wrong.reason  # its operator can put it right
        assert len(box.messages) == 1


def test_a_mail_server_that_is_not_there_is_asked_again_later() -> None:
    with mail_server() as box:
        server = server_of(box)
    attempt = mail.send(server, plain_message())
    assert (attempt.result, "could not be used" in str(attempt.reason)) == ("failed", True)


def test_a_mail_server_that_hangs_is_not_waited_for_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mail, "TIMEOUT_S", 0.2)
    with silent() as port:
        attempt = mail.send(MailServer("127.0.0.1", port, "none", None, None, SENDER), plain_message())
    assert (attempt.result, "timed out" in str(attempt.reason)) == ("failed", True)
