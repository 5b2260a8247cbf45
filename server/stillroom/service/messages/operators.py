"""Those who run the service are told of rates and rollouts: their programs, and they themselves by e-mail and in browsers."""

from stillroom.documents.notifications import WebhookType
from stillroom.service.access import told_about
from stillroom.service.messages.announcing import GATHER, webhook_body
from stillroom.store import clock, deliveries, receivers
from stillroom.store.database import Transaction
from stillroom.store.deliveries import NewDelivery
from stillroom.store.rows import Json


def tell_operators(tx: Transaction, kind: WebhookType, data: Json, page: str) -> None:
    """`page`: of the web app, where it can be looked at. Once the transaction is committed."""
    now = clock.now(tx)
    new = []
    for row in receivers.listening(tx, *told_about(tx, None)):
        if row.channel != "webhook":
            new.append(NewDelivery(row.id, kind, data | {"page": page}, now + GATHER[row.channel]))
        elif row.fleet and (row.kinds is None or kind in row.kinds):
            new.append(NewDelivery(row.id, kind, webhook_body(kind, now, data), now))
    deliveries.add(tx, new, now)
