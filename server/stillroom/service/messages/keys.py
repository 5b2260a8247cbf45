"""The secrets of the service: made when first needed, and shared by all its machines through the database."""

import base64
import secrets
from dataclasses import dataclass

from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from stillroom.store import receivers
from stillroom.store.database import Database


@dataclass(frozen=True)
class VapidKey:
    """The key pair by which push services know this one (RFC 8292)."""

    private: ec.EllipticCurvePrivateKey

    @property
    def public(self) -> str:
        """The uncompressed point, base64url: a browser's `applicationServerKey`."""
        point = self.private.public_key().public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)
        return encode_base64url(point)


def vapid_key(database: Database) -> VapidKey:
    new = ec.generate_private_key(ec.SECP256R1()).private_numbers().private_value
    return VapidKey(ec.derive_private_key(int(_shared(database, "vapid", f"{new:x}"), 16), ec.SECP256R1()))


def link_key(database: Database) -> bytes:
    """What links in messages are signed with."""
    return bytes.fromhex(_shared(database, "links", secrets.token_hex(32)))


def encode_base64url(content: bytes) -> str:
    return base64.urlsafe_b64encode(content).rstrip(b"=").decode()


def decode_base64url(text: str) -> bytes:
    """Raises ValueError."""
    bare = text.rstrip("=")
    return base64.b64decode(bare + "=" * (-len(bare) % 4), altchars=b"-_", validate=True)


def _shared(database: Database, name: str, new: str) -> str:
    with database.read() as tx:
        known = receivers.known_secret(tx, name)
    if known is not None:
        return known
    with database.write() as tx:
        return receivers.service_secret(tx, name, new)
