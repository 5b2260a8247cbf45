"""What the environment decides. Nothing else in stillroom reads environment variables."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from ipaddress import IPv4Network, IPv6Network, ip_network
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args
from urllib.parse import urlsplit

if TYPE_CHECKING:  # a command that only prints must not wait for the pipeline's libraries
    from stillroom.pipeline.update import ResolverName

RESOLVER_CHOICES: "Mapping[str, tuple[ResolverName, ...]]" = {
    "none": (),
    "meta_occupancy": ("meta_occupancy",),
    "meta_occupancy,meta_dividers": ("meta_occupancy", "meta_dividers"),
}
_ALL_RESOLVERS = "meta_occupancy,meta_dividers"


class InvalidSetting(Exception):
    """The environment asks for what there is not."""


MailSecurity = Literal["starttls", "tls", "none"]
_PORTS: Mapping[MailSecurity, int] = {"starttls": 587, "tls": 465, "none": 25}


@dataclass(frozen=True)
class MailServer:
    """Which server sends e-mail, and in whose name."""

    host: str
    port: int
    security: MailSecurity
    user: str | None
    password: str | None
    sender: str


@dataclass(frozen=True)
class Outbound:
    """Where messages may go that people gave addresses for: by https to public addresses, and to what is named here."""

    networks: tuple[IPv4Network | IPv6Network, ...] = ()
    """Not public, and allowed all the same."""
    insecure_http: bool = False


@dataclass(frozen=True)
class Messaging:
    """How people and their programs are told what happens."""

    public_url: str = ""
    """Where people reach the service: what links in messages begin with. Empty: where it listens."""
    mail: MailServer | None = None
    """None: no e-mail is sent."""
    outbound: Outbound = Outbound()


@dataclass(frozen=True)
class QueueLimits:
    """How much may wait to be processed before robots are asked to come again later."""

    missions: int = 10_000
    age_s: float = 300.0
    """That the mission which is next has waited."""


@dataclass(frozen=True)
class Provider:
    """Who signs people in beside this service: an OpenID Connect provider, and what it knows the service by."""

    issuer: str
    client_id: str
    client_secret: str | None
    name: str
    """What the button says."""


@dataclass(frozen=True)
class Settings:
    data_dir: Path
    database_url: str
    """SQLAlchemy URL."""
    grid_store_url: str
    """A folder, or a bucket of an S3-compatible store (`store.grids`)."""
    admin_token: str | None
    """Bearer token of an operator."""
    resolvers: "tuple[ResolverName, ...]" = RESOLVER_CHOICES[_ALL_RESOLVERS]
    """How far missions are helped by the meta layer: all of it, or one of the paper's ablation rows."""
    messaging: Messaging = Messaging()
    queue: QueueLimits = QueueLimits()
    provider: Provider | None = None

    @staticmethod
    def from_environment(environment: Mapping[str, str] = os.environ) -> "Settings":
        """Raises InvalidSetting."""
        data_dir = Path(environment.get("STILLROOM_DATA_DIR") or "data").absolute()
        return Settings(
            data_dir=data_dir,
            database_url=_secret(environment, "STILLROOM_DATABASE_URL") or f"sqlite:///{data_dir / 'stillroom.sqlite'}",
            grid_store_url=_grid_store(environment.get("STILLROOM_GRID_STORE_URL") or str(data_dir / "grids")),
            admin_token=_secret(environment, "STILLROOM_ADMIN_TOKEN"),
            resolvers=_resolvers(environment.get("STILLROOM_RESOLVERS") or _ALL_RESOLVERS),
            messaging=_messaging(environment),
            provider=_provider(environment) if environment.get("STILLROOM_OIDC_ISSUER") else None,
            queue=QueueLimits(
                _number(environment, "STILLROOM_QUEUE_LIMIT", QueueLimits.missions),
                float(_number(environment, "STILLROOM_QUEUE_AGE", int(QueueLimits.age_s))),
            ),
        )


def _grid_store(value: str) -> str:
    if "://" in value and not (value.startswith("s3://") and urlsplit(value).netloc):
        raise InvalidSetting(f"STILLROOM_GRID_STORE_URL is {value!r}; it can be a folder, or like s3://bucket/prefix.")
    return value


def _resolvers(value: str) -> "tuple[ResolverName, ...]":
    if value not in RESOLVER_CHOICES:
        raise InvalidSetting(f"STILLROOM_RESOLVERS is {value!r}; it can be {', '.join(map(repr, RESOLVER_CHOICES))}.")
    return RESOLVER_CHOICES[value]


def _messaging(environment: Mapping[str, str]) -> Messaging:
    networks = (environment.get("STILLROOM_WEBHOOK_NETWORKS") or "").replace(",", " ").split()
    return Messaging(
        public_url=_url(environment["STILLROOM_PUBLIC_URL"]) if environment.get("STILLROOM_PUBLIC_URL") else "",
        mail=_mail_server(environment) if environment.get("STILLROOM_SMTP_HOST") else None,
        outbound=Outbound(tuple(map(_network, networks)), _flag(environment, "STILLROOM_WEBHOOK_HTTP")),
    )


def _provider(environment: Mapping[str, str]) -> Provider:
    client_id = environment.get("STILLROOM_OIDC_CLIENT_ID")
    if not client_id:
        raise InvalidSetting("STILLROOM_OIDC_CLIENT_ID must be what the identity provider knows this service by.")
    return Provider(
        issuer=_url(environment["STILLROOM_OIDC_ISSUER"], "STILLROOM_OIDC_ISSUER"),
        client_id=client_id,
        client_secret=_secret(environment, "STILLROOM_OIDC_CLIENT_SECRET"),
        name=environment.get("STILLROOM_OIDC_NAME") or "OpenID Connect",
    )


def _mail_server(environment: Mapping[str, str]) -> MailServer:
    security = environment.get("STILLROOM_SMTP_SECURITY") or "starttls"
    if security not in get_args(MailSecurity):
        raise InvalidSetting(f"STILLROOM_SMTP_SECURITY is {security!r}; it can be 'starttls', 'tls' or 'none'.")
    known: MailSecurity = security  # type: ignore[assignment]
    port = environment.get("STILLROOM_SMTP_PORT") or str(_PORTS[known])
    if not port.isdecimal() or not 0 < int(port) < 2**16:
        raise InvalidSetting(f"STILLROOM_SMTP_PORT is {port!r}; it must be a port's number.")
    sender = environment.get("STILLROOM_MAIL_FROM") or ""
    if "@" not in sender:
        raise InvalidSetting("STILLROOM_MAIL_FROM must be the address that e-mail comes from.")
    return MailServer(
        host=environment["STILLROOM_SMTP_HOST"],
        port=int(port),
        security=known,
        user=environment.get("STILLROOM_SMTP_USER") or None,
        password=_secret(environment, "STILLROOM_SMTP_PASSWORD"),
        sender=sender,
    )


def _secret(environment: Mapping[str, str], name: str) -> str | None:
    """Its value, or the content of the file that `…_FILE` names."""
    file = environment.get(f"{name}_FILE")
    if not file:
        return environment.get(name) or None
    try:
        return Path(file).read_text().strip() or None
    except OSError as error:
        raise InvalidSetting(f"{name}_FILE can't be read: {error.strerror}.") from error


def _url(value: str, name: str = "STILLROOM_PUBLIC_URL") -> str:
    parts = urlsplit(value)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise InvalidSetting(f"{name} is {value!r}; it must be like https://maps.example.org.")
    return value.rstrip("/")


def _network(value: str) -> IPv4Network | IPv6Network:
    try:
        return ip_network(value)
    except ValueError as error:
        raise InvalidSetting(f"STILLROOM_WEBHOOK_NETWORKS holds {value!r}, which is no network: {error}.") from error


def _number(environment: Mapping[str, str], name: str, default: int) -> int:
    value = environment.get(name) or str(default)
    if not value.isdecimal() or int(value) == 0:
        raise InvalidSetting(f"{name} is {value!r}; it must be a number above 0.")
    return int(value)


def _flag(environment: Mapping[str, str], name: str) -> bool:
    value = environment.get(name) or "false"
    if value not in ("true", "false"):
        raise InvalidSetting(f"{name} is {value!r}; it can be 'true' or 'false'.")
    return value == "true"
