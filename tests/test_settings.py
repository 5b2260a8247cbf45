"""What the environment decides."""

import re
from dataclasses import replace
from ipaddress import ip_network
from pathlib import Path

import pytest

from stillroom.__main__ import main
from stillroom.pipeline.update import RESOLVERS
from stillroom.settings import InvalidSetting, MailServer, Messaging, Outbound, Provider, Settings


@pytest.mark.parametrize(
    ("said", "resolvers"),
    [
        (None, RESOLVERS),
        ("", RESOLVERS),
        ("none", ()),
        ("meta_occupancy", RESOLVERS[:1]),
        ("meta_occupancy,meta_dividers", RESOLVERS),
    ],
)
def test_the_rows_of_the_ablation_are_switched_by_the_environment(said: str | None, resolvers: tuple[str, ...]) -> None:
    environment = {} if said is None else {"STILLROOM_RESOLVERS": said}
    assert Settings.from_environment(environment).resolvers == resolvers


@pytest.mark.parametrize("said", ["meta_dividers", "meta_dividers,meta_occupancy", "all", "NONE", "meta_occupancy,"])
def test_any_other_row_is_refused_with_those_that_there_are(said: str) -> None:
    with pytest.raises(InvalidSetting, match="'none', 'meta_occupancy', 'meta_occupancy,meta_dividers'"):
        Settings.from_environment({"STILLROOM_RESOLVERS": said})


def test_a_service_with_a_wrong_setting_does_not_start_and_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STILLROOM_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setenv("STILLROOM_RESOLVERS", "everything")
    assert main(["serve", "--port", "0"]) == 1
    assert "STILLROOM_RESOLVERS is 'everything'" in capsys.readouterr().err
    assert not (tmp_path / "data").exists()


def test_without_more_no_e_mail_is_sent_and_messages_go_to_public_addresses_by_https() -> None:
    assert Settings.from_environment({}).messaging == Messaging("", None, Outbound((), insecure_http=False))


def test_the_mail_server_is_said_by_the_environment_and_its_password_by_a_file(tmp_path: Path) -> None:
    (tmp_path / "password").write_text("s3cret\n")
    environment = {
        "STILLROOM_SMTP_HOST": "mail.example.org",
        "STILLROOM_SMTP_USER": "maps",
        "STILLROOM_SMTP_PASSWORD_FILE": str(tmp_path / "password"),
        "STILLROOM_MAIL_FROM": "maps@example.org",
    }
    expected = MailServer("mail.example.org", 587, "starttls", "maps", "s3cret", "maps@example.org")
    assert Settings.from_environment(environment).messaging.mail == expected
    more = environment | {"STILLROOM_SMTP_SECURITY": "tls", "STILLROOM_SMTP_PORT": ""}
    assert Settings.from_environment(more).messaging.mail == replace(expected, security="tls", port=465)
    plain = {"STILLROOM_SMTP_HOST": "localhost", "STILLROOM_SMTP_SECURITY": "none", "STILLROOM_SMTP_PORT": "2525"}
    without = Settings.from_environment(plain | {"STILLROOM_MAIL_FROM": "maps@example.org"}).messaging.mail
    assert without == MailServer("localhost", 2525, "none", None, None, "maps@example.org")


def test_where_links_lead_and_where_webhooks_may_go_is_said_by_the_environment() -> None:
    environment = {
        "STILLROOM_PUBLIC_URL": "https://maps.example.org/",
        "STILLROOM_WEBHOOK_NETWORKS": "10.1.0.0/16, fd00::/8",
        "STILLROOM_WEBHOOK_HTTP": "true",
    }
    outbound = Outbound((ip_network("10.1.0.0/16"), ip_network("fd00::/8")), insecure_http=True)
    assert Settings.from_environment(environment).messaging == Messaging("https://maps.example.org", None, outbound)


MAIL = {"STILLROOM_SMTP_HOST": "mail.example.org", "STILLROOM_MAIL_FROM": "maps@example.org"}


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        (MAIL | {"STILLROOM_MAIL_FROM": ""}, "STILLROOM_MAIL_FROM must be"),
        (MAIL | {"STILLROOM_SMTP_SECURITY": "ssl"}, "'ssl'; it can be 'starttls', 'tls' or 'none'"),
        (MAIL | {"STILLROOM_SMTP_PORT": "smtp"}, "STILLROOM_SMTP_PORT is 'smtp'"),
        (MAIL | {"STILLROOM_SMTP_PORT": "70000"}, "STILLROOM_SMTP_PORT is '70000'"),
        (MAIL | {"STILLROOM_SMTP_PASSWORD_FILE": "/nowhere/password"}, "STILLROOM_SMTP_PASSWORD_FILE can't be read"),
        ({"STILLROOM_PUBLIC_URL": "maps.example.org"}, "must be like https://"),
        ({"STILLROOM_PUBLIC_URL": "https://maps.example.org/?a=b"}, "must be like https://"),
        ({"STILLROOM_WEBHOOK_NETWORKS": "10.1.0.1/16"}, "holds '10.1.0.1/16', which is no network"),
        ({"STILLROOM_WEBHOOK_NETWORKS": "hooks.example.org"}, "which is no network"),
        ({"STILLROOM_WEBHOOK_HTTP": "yes"}, "it can be 'true' or 'false'"),
    ],
)
def test_wrong_settings_of_messages_are_refused_and_say_why(environment: dict[str, str], said: str) -> None:
    with pytest.raises(InvalidSetting, match=re.escape(said)):
        Settings.from_environment(environment)


def test_an_identity_provider_is_named_whole(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("from a file\n")
    environment = {
        "STILLROOM_OIDC_ISSUER": "https://id.example.org/",
        "STILLROOM_OIDC_CLIENT_ID": "stillroom",
        "STILLROOM_OIDC_CLIENT_SECRET_FILE": str(tmp_path / "secret"),
        "STILLROOM_OIDC_NAME": "The Company",
    }
    provider = Settings.from_environment(environment).provider
    assert provider == Provider("https://id.example.org", "stillroom", "from a file", "The Company")
    assert Settings.from_environment({}).provider is None
    for wrong in ({"STILLROOM_OIDC_CLIENT_ID": ""}, {"STILLROOM_OIDC_ISSUER": "id.example.org"}):
        with pytest.raises(InvalidSetting, match="STILLROOM_OIDC"):
            Settings.from_environment(environment | wrong)
