"""Programs' webhooks and browsers' push services: one POST each, and what its answer means."""

import json
import ssl
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from email.utils import parsedate_to_datetime
from hashlib import sha256
from urllib.parse import urlsplit

import http_ece
import httpcore2
from cryptography.hazmat.primitives.asymmetric import ec
from py_vapid import Vapid02
from standardwebhooks import Webhook

from stillroom.service.messages.attempts import Attempt
from stillroom.service.messages.keys import VapidKey, decode_base64url, encode_base64url
from stillroom.service.messages.outbound import TOTAL_S, Forbidden, Resolve, post, resolve
from stillroom.service.messages.topics import Topic
from stillroom.service.messages.words import Words
from stillroom.service.webhooks import valid_secrets
from stillroom.settings import Outbound
from stillroom.store.rows import DeliveryRow, Json, ReceiverRow

PUSH_LIFE = timedelta(days=7)
"""So long a push service keeps a message for a browser that is not running: as long as a question waits."""
_MOST_TEXT = 600
"""Of a message's text: all of it must fit the 4096 bytes that push services take."""
_MOST_ACTIONS = 2
"""So many buttons do browsers show."""
_LONGEST_WAIT_S = 24 * 3600.0


def send_webhook(
    to: ReceiverRow, delivery: DeliveryRow, outbound: Outbound, resolve: Resolve = resolve, total_s: float = TOTAL_S
) -> Attempt:
    """By the Standard Webhooks specification."""
    now = datetime.now(UTC)
    body = json.dumps(delivery.content, ensure_ascii=False, separators=(",", ":"))
    signatures = [Webhook(secret).sign(delivery.key, now, body) for secret in valid_secrets(to, now)]
    headers = {
        "Content-Type": "application/json",
        "User-Agent": "stillroom",
        "webhook-id": delivery.key,
        "webhook-timestamp": str(int(now.timestamp())),
        "webhook-signature": " ".join(signatures),
    }
    return _posted(to.address, headers, body.encode(), outbound, resolve, total_s, gone=(410,))


def send_push(
    to: ReceiverRow,
    about: Sequence[Topic],
    words: Words,
    key: VapidKey,
    subject: str,
    outbound: Outbound,
    resolve: Resolve = resolve,
    total_s: float = TOTAL_S,
) -> Attempt:
    """Encrypted for the browser alone (RFC 8291), signed by the service (RFC 8292). `subject`: who runs it, as a URL."""
    told = notification(about, words)
    claims = {"aud": _origin(to.address), "sub": subject}
    headers: dict[str, str] = {
        **Vapid02(key.private, {"no-strict": True}).sign(claims),
        "Content-Encoding": "aes128gcm",
        "Content-Type": "application/octet-stream",
        "TTL": str(int(PUSH_LIFE.total_seconds())),
        "Urgency": "normal",
        # a newer message about the same takes the place of one that a browser has not fetched yet
        "Topic": encode_base64url(sha256(str(told["tag"]).encode()).digest())[:32],
    }
    body = http_ece.encrypt(
        json.dumps(told, ensure_ascii=False).encode(),
        private_key=ec.generate_private_key(ec.SECP256R1()),
        dh=decode_base64url(to.keys["p256dh"]),
        auth_secret=decode_base64url(to.keys["auth"]),
        version="aes128gcm",
    )
    return _posted(to.address, headers, body, outbound, resolve, total_s, gone=(404, 410), never=(400, 413))


def notification(about: Sequence[Topic], words: Words) -> Json:
    """What a service worker is given to show."""
    if len(about) > 1:
        first = about[0].delivery
        text = "; ".join(topic.title for topic in about)
        return {
            "kind": "digest",
            "title": words.many.format(n=len(about)),
            "body": text[:_MOST_TEXT],
            "url": "/questions",
            "tag": f"digest/{first.receiver_id}",
            "count": len(about),
        }
    topic = about[0]
    content = topic.delivery.content
    return {
        "kind": topic.delivery.kind,
        "title": topic.title[:200],
        "body": topic.text[:_MOST_TEXT],
        "url": urlsplit(topic.url).path or "/",
        "tag": f"{content.get('robot', '')}/{content.get('map', '')}",
        "count": 1,
        "actions": [{"title": said[:60], "url": _path(url)} for said, url in topic.answers[:_MOST_ACTIONS]],
    }


def _path(url: str) -> str:
    parts = urlsplit(url)
    return f"{parts.path}?{parts.query}"


def _posted(
    url: str,
    headers: Mapping[str, str],
    body: bytes,
    outbound: Outbound,
    resolve: Resolve,
    total_s: float,
    gone: Sequence[int],
    never: Sequence[int] = (),
) -> Attempt:
    try:
        answer = post(url, headers, body, outbound, resolve, total_s)
    except Forbidden as error:
        return Attempt("failed", str(error))
    except httpcore2.TimeoutException:
        return Attempt("failed", f"It did not answer within {total_s:.0f} seconds.")
    except (httpcore2.NetworkError, httpcore2.ProtocolError, ssl.SSLError, OSError) as error:
        return Attempt("failed", f"It could not be reached: {str(error) or type(error).__name__}"[:500])
    if 200 <= answer.status < 300:
        return Attempt("delivered", status_code=answer.status)
    if answer.status in gone:
        return Attempt("gone", f"It answered {answer.status}: there is nobody any more.", answer.status)
    if answer.status in never:
        return Attempt("refused", f"It answered {answer.status}.", answer.status)
    also = " Redirects are not followed." if 300 <= answer.status < 400 else ""
    wait = _retry_after(answer.headers.get("retry-after"))
    return Attempt("failed", f"It answered {answer.status}.{also}", answer.status, wait)


def _retry_after(value: str | None) -> float | None:
    """Seconds, at most a day; None where there is nothing that could be understood."""
    if value is None:
        return None
    if value.isdecimal():
        return min(float(value[:9]), _LONGEST_WAIT_S)
    try:
        seconds = (parsedate_to_datetime(value) - datetime.now(UTC)).total_seconds()
    except (ValueError, TypeError):
        return None
    return min(max(seconds, 0.0), _LONGEST_WAIT_S)


def _origin(url: str) -> str:
    parts = urlsplit(url)
    return f"{parts.scheme}://{parts.netloc}"
