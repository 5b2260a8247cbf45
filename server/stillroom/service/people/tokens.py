"""Secrets that stand for somebody: made at random, shown once, kept as hashes."""

import secrets
from hashlib import sha256

ROBOT, PERSON = "srt_", "stp_"
"""What tokens begin with, so that people and scanners of source code know them."""


def new_secret(prefix: str = "") -> str:
    """256 random bits."""
    return prefix + secrets.token_urlsafe(32)


def new_claim_code() -> str:
    """60 random bits, to be read off a label and typed."""
    return "-".join("".join(secrets.choice("23456789ABCDEFGHJKLMNPQRSTUVWXYZ") for _ in range(4)) for _ in range(3))


def hash_of(secret: str) -> str:
    # What is random needs no slow hash: there is nothing to guess.
    return sha256(secret.encode()).hexdigest()
