"""What people are told: each chooses what, by e-mail to an address that was confirmed, or in their browsers."""

from datetime import datetime, timedelta
from typing import get_args

from cryptography.hazmat.primitives.asymmetric import ec

from stillroom.documents.notifications import (
    EmailDocument,
    MessageKind,
    NewEmail,
    NewPushSubscription,
    NotificationChoice,
    NotificationSettings,
    PushDocument,
    PushKeys,
    PushSubscriptionDocument,
)
from stillroom.errors import Fault, InvalidInput, NotFound, TooMany, Unavailable
from stillroom.service.access import Person, Principal
from stillroom.service.messages.keys import VapidKey, decode_base64url, link_key, vapid_key
from stillroom.service.messages.links import read
from stillroom.service.messages.outbound import check_url
from stillroom.service.webhooks import owner_of
from stillroom.settings import Messaging
from stillroom.store import clock, deliveries, receivers
from stillroom.store.database import Database, Transaction
from stillroom.store.deliveries import NewDelivery
from stillroom.store.receivers import FRESH, NewReceiver
from stillroom.store.rows import ReceiverRow

KINDS: tuple[MessageKind, ...] = get_args(MessageKind)
MOST_BROWSERS = 20
CONFIRMATIONS_A_DAY = 5
"""So often may somebody have a link sent to an address that may not be theirs."""


def settings_of(database: Database, caller: Principal, messaging: Messaging) -> NotificationSettings:
    person, key = owner_of(caller), vapid_key(database)
    with database.read() as tx:
        return _settings(tx, caller, person, key, messaging)


def choose(
    database: Database, caller: Principal, choice: NotificationChoice, messaging: Messaging
) -> NotificationSettings:
    person, key = owner_of(caller), vapid_key(database)
    wanted = {
        channel: kinds for channel, kinds in (("email", choice.email), ("push", choice.push)) if kinds is not None
    }
    with database.write() as tx:
        if choice.language is not None:
            receivers.speak(tx, person, choice.language)
        receivers.prefer(
            tx, person, {channel: sorted(set(kinds), key=KINDS.index) for channel, kinds in wanted.items()}
        )
        return _settings(tx, caller, person, key, messaging)


# -- e-mail --------------------------------------------------------------------------------------------------------


def set_email(database: Database, caller: Principal, new: NewEmail, messaging: Messaging) -> NotificationSettings:
    """A link is sent there; nothing else is, before it was opened. The same again sends another link.

    Raises Unavailable where the service sends no e-mail, and TooMany.
    """
    if messaging.mail is None:
        raise Unavailable("This service sends no e-mail: its operator has not said by which server.", 3600)
    person, key, address = owner_of(caller), vapid_key(database), new.address
    with database.write() as tx:
        now = clock.now(tx)
        if new.language is not None:
            receivers.speak(tx, person, new.language, again=False)
        if deliveries.count_since(tx, person, "confirm", now - timedelta(days=1)) >= CONFIRMATIONS_A_DAY:
            raise TooMany(f"{CONFIRMATIONS_A_DAY} links were sent today; try again tomorrow.", 3600)
        receivers.add(tx, NewReceiver("email", person, address, None), now)  # unless there is one
        (row,) = receivers.of_person(tx, person, "email")
        if row.address != address:
            deliveries.give_up(tx, row.id, "Another address was chosen.", now)
            receivers.change(tx, row.id, {"address": address, "confirmed_at": None, "delivered_at": None, **FRESH})
        if row.address != address or row.confirmed_at is None:
            deliveries.add(tx, [NewDelivery(row.id, "confirm", {"address": address}, now)], now)
        return _settings(tx, caller, person, key, messaging)


def remove_email(database: Database, caller: Principal) -> None:
    person = owner_of(caller)
    with database.write() as tx:
        for row in receivers.of_person(tx, person, "email"):
            receivers.remove(tx, row.id)


def confirm_email(database: Database, token: str) -> str:
    """The address, which messages go to from now on. Raises InvalidInput."""
    link = read(token, "confirm", link_key(database))
    with database.write() as tx:
        row = _linked(tx, link.receiver, link.address)
        if row is None:
            raise InvalidInput("Another address was chosen since: open the newer link.")
        if row.confirmed_at is None:
            receivers.change(tx, row.id, {"confirmed_at": clock.now(tx)})
    return link.address


def stop_email(database: Database, token: str) -> str:
    """The address, which no message goes to any more. Raises InvalidInput."""
    link = read(token, "stop", link_key(database))
    with database.write() as tx:
        row = _linked(tx, link.receiver, link.address)
        if row is not None:
            receivers.remove(tx, row.id)
    return link.address


def _linked(tx: Transaction, key: str, address: str) -> ReceiverRow | None:
    found = (row for row in receivers.by_address(tx, "email", address) if row.key == key)
    return next(found, None)


# -- browsers ------------------------------------------------------------------------------------------------------


def subscribe(
    database: Database, caller: Principal, new: NewPushSubscription, messaging: Messaging
) -> PushSubscriptionDocument:
    """The same browser again is the same subscription, whoever signed in with it before. Raises InvalidInput."""
    person = owner_of(caller)
    check_url(new.endpoint, messaging.outbound, "/endpoint")
    _check_keys(new.keys)
    with database.write() as tx:
        now = clock.now(tx)
        if new.language is not None:
            receivers.speak(tx, person, new.language, again=False)
        mine = None
        for row in receivers.by_address(tx, "push", new.endpoint):
            if row.person == person:
                mine = row
            else:
                receivers.remove(tx, row.id)
        keys, label = new.keys.model_dump(), new.label.strip()
        if mine is None:
            mine = _add_browser(tx, NewReceiver("push", person, new.endpoint, now, label=label, keys=keys), now)
        else:
            receivers.change(tx, mine.id, {"keys": keys, "label": label or mine.label, **FRESH})
        made = receivers.get(tx, mine.id)
    assert made is not None
    return _subscription(made)


def _add_browser(tx: Transaction, new: NewReceiver, now: datetime) -> ReceiverRow:
    if len(receivers.of_person(tx, new.person, "push", limit=MOST_BROWSERS)) >= MOST_BROWSERS:
        raise InvalidInput(f"There are {MOST_BROWSERS} browsers already; remove one first.")
    made = receivers.add(tx, new, now)
    if made is None:
        raise Unavailable("Another request subscribes the same browser just now.", 1)
    return made


def unsubscribe(database: Database, caller: Principal, key: str) -> None:
    """Raises NotFound."""
    with database.write() as tx:
        receivers.remove(tx, _browser(tx, caller, key).id)


def send_test(database: Database, caller: Principal, key: str) -> None:
    """A message to one browser. Raises NotFound."""
    with database.write() as tx:
        row, now = _browser(tx, caller, key), clock.now(tx)
        deliveries.add(tx, [NewDelivery(row.id, "test", {}, now)], now)
        receivers.change(tx, row.id, {"resume_at": None})


def _browser(tx: Transaction, caller: Principal, key: str) -> ReceiverRow:
    row = receivers.by_key(tx, owner_of(caller), key)
    if row is None or row.channel != "push":
        raise NotFound(f"There is no subscription {key}.")
    return row


def _check_keys(keys: PushKeys) -> None:
    try:
        ec.EllipticCurvePublicKey.from_encoded_point(ec.SECP256R1(), decode_base64url(keys.p256dh))
    except ValueError as error:
        raise InvalidInput(
            "The keys can't be used.", (Fault("/keys/p256dh", "no point of the curve P-256"),)
        ) from error
    try:
        size = len(decode_base64url(keys.auth))
    except ValueError:
        size = 0
    if size != 16:
        raise InvalidInput("The keys can't be used.", (Fault("/keys/auth", "not 16 bytes"),))


# -- what is shown of it -------------------------------------------------------------------------------------------


def _settings(
    tx: Transaction, caller: Principal, person: str, key: VapidKey, messaging: Messaging
) -> NotificationSettings:
    chosen = receivers.preferences(tx, person)
    address = next(iter(receivers.of_person(tx, person, "email")), None)
    email = EmailDocument.model_validate(
        {
            "available": messaging.mail is not None,
            "address": address and address.address,
            "confirmed": address is not None and address.confirmed_at is not None,
            "suggested": caller.email if isinstance(caller, Person) else None,
            "kinds": chosen.get("email", KINDS),
            "trouble": None if address is None else deliveries.trouble(tx, address.id),
        }
    )
    push = PushDocument.model_validate(
        {
            "public_key": key.public,
            "kinds": chosen.get("push", KINDS),
            "subscriptions": [
                _subscription(row, deliveries.trouble(tx, row.id)) for row in receivers.of_person(tx, person, "push")
            ],
        }
    )
    return NotificationSettings.model_validate(
        {"language": receivers.language(tx, person), "email": email, "push": push}
    )


def _subscription(row: ReceiverRow, trouble: str | None = None) -> PushSubscriptionDocument:
    return PushSubscriptionDocument(
        id=row.key, label=row.label, created_at=row.created_at, delivered_at=row.delivered_at, trouble=trouble
    )
