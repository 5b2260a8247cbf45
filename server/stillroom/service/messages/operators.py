"""Those who run the service are told of rates and rollouts: their programs, and they themselves by e-mail and in browsers."""

from stillroom.documents.notifications import WebhookType
from stillroom.service.access import looking_after
from stillroom.service.messages.announcing import GATHER, webhook_body
from stillroom.store import clock, deliveries, people, receivers
from stillroom.store.database import Transaction
from stillroom.store.deliveries import NewDelivery
from stillroom.store.rows import Json


def tell_operators(tx: Transaction, kind: WebhookType, data: Json, page: str) -> None:
    """`page`: of the web app, where it can be looked at. Once the transaction is committed."""
    now = clock.now(tx)
    emails = {email for duty in ("operator", "engineer") for email in people.with_duty(tx, duty)}
    # whoever has an account by that, and whoever has the operator's token
    persons = sorted({looking_after(email) for email in emails} | {looking_after(None)})
    listening = {row.id: row for person in persons for row in receivers.listening(tx, person)}
    new = []
    for row in listening.values():
        if row.channel != "webhook":
            new.append(NewDelivery(row.id, kind, data | {"page": page}, now + GATHER[row.channel]))
        elif row.fleet and (row.kinds is None or kind in row.kinds):
            new.append(NewDelivery(row.id, kind, webhook_body(kind, now, data), now))
    deliveries.add(tx, new, now)
