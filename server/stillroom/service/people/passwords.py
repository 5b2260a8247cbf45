"""Passwords: what may be one, and how it is checked."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import BoundedSemaphore

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from stillroom.errors import Fault, InvalidInput, Unavailable

HASHER = PasswordHasher()
"""argon2id with the package's parameters (RFC 9106's second recommendation): 64 MiB, some 0.1 s."""
SHORTEST, LONGEST = 12, 1000
_FEWEST_DIFFERENT = 5
_AT_ONCE = BoundedSemaphore(4)
"""Each takes a core and 64 MiB for as long as it lasts."""
_PATIENCE_S = 5.0
_OF_NOBODY = "$argon2id$v=19$m=65536,t=3,p=4$CWdVI3PYdaucEGYUAtd2Jw$EXZj/XIIlmKMjaLIoZwn5bvScKrYH7Gf9D+noUdG4XY"
"""Checked where there is no account, so that it takes as long; whatever comes of it, the answer is no."""


def hashed(password: str, email: str, pointer: str = "/password") -> str:
    """Raises InvalidInput for a password that is guessed at once, and Unavailable."""
    fault = _fault(password, email)
    if fault is not None:
        raise InvalidInput("This can't be a password.", (Fault(pointer, fault),))
    with _turn():
        return HASHER.hash(password)


def matches(password_hash: str | None, password: str) -> bool:
    """Takes as long where there is no password (None), and says no. Raises Unavailable."""
    with _turn():
        try:
            HASHER.verify(password_hash or _OF_NOBODY, password)
        except (VerificationError, InvalidHashError):
            return False
    return password_hash is not None


def rehashed(password_hash: str, password: str) -> str | None:
    """With today's parameters; None where it was made with them. Raises Unavailable."""
    if not HASHER.check_needs_rehash(password_hash):
        return None
    with _turn():
        return HASHER.hash(password)


def _fault(password: str, email: str) -> str | None:
    if len(password) < SHORTEST:
        return f"shorter than {SHORTEST} characters"
    if len(set(password.lower())) < _FEWEST_DIFFERENT:
        return "fewer than five different characters"
    if email in password.lower():
        return "holds the e-mail address"
    return None


@contextmanager
def _turn() -> Iterator[None]:
    if not _AT_ONCE.acquire(timeout=_PATIENCE_S):
        raise Unavailable("Too many people sign in just now.", 5)
    try:
        yield
    finally:
        _AT_ONCE.release()
