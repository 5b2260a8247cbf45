"""Links in messages: to pages of the app, and signed ones that work without signing in."""

import hmac
import json
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any, Literal
from urllib.parse import quote

from stillroom.errors import InvalidInput
from stillroom.service.messages.keys import decode_base64url, encode_base64url

Purpose = Literal["confirm", "stop"]


@dataclass(frozen=True)
class SignedLink:
    """Says that whoever has it reads the e-mail of `address`."""

    purpose: Purpose
    receiver: str
    address: str
    until: datetime | None = None
    """None: for ever."""


def sign(link: SignedLink, key: bytes) -> str:
    """The token that stands for it."""
    until = None if link.until is None else int(link.until.timestamp())
    said = json.dumps([link.purpose, link.receiver, link.address, until], separators=(",", ":")).encode()
    return f"{encode_base64url(said)}.{encode_base64url(_mac(said, key))}"


def read(token: str, purpose: Purpose, key: bytes) -> SignedLink:
    """Raises InvalidInput for a token that is not ours, is for something else, or is too old."""
    said, _, mac = token.partition(".")
    try:
        content, given = decode_base64url(said), decode_base64url(mac)
    except ValueError as error:
        raise InvalidInput("The link is damaged: copy the whole of it.") from error
    if not hmac.compare_digest(_mac(content, key), given):
        raise InvalidInput("The link is damaged: copy the whole of it.")
    for_what, receiver, address, seconds = json.loads(content)
    until = None if seconds is None else datetime.fromtimestamp(seconds, UTC)
    if for_what != purpose:
        raise InvalidInput("The link is for something else.")
    if until is not None and until < datetime.now(UTC):
        raise InvalidInput("The link has expired: ask for a new one on the page of settings.")
    return SignedLink(purpose, receiver, address, until)


def _mac(said: bytes, key: bytes) -> bytes:
    return hmac.new(key, said, sha256).digest()


def page_url(public_url: str, content: dict[str, Any]) -> str:
    """The app's page about what a message tells."""
    if "robot" not in content:
        return public_url
    of_map = f"{public_url}/robots/{quote(content['robot'], '')}/maps/{quote(content['map'], '')}"
    return f"{of_map}/conflicts/{quote(content['conflict'], '')}" if content.get("conflict") else of_map
