"""What is known of a home beside its robots: its people, what it keeps, what its owner is told. No secret is among it."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store import people, receivers, retaining
from stillroom.store.database import Transaction
from stillroom.store.tables import receiver


def everything(tx: Transaction, owner: str, now: datetime) -> dict[str, Any]:
    """To be read by people and programs; `owner`: an e-mail address."""
    account, kept = people.find(tx, owner), retaining.of_home(tx, owner)
    return {
        "owner": owner,
        "since": None if account is None else account.created_at,
        "people": [{"email": row.email, "role": row.role, "since": row.since} for row in people.members_of(tx, owner)],
        "invited": [
            {"email": row.email, "role": row.role, "until": row.expires_at}
            for row in people.invitations(tx, owner, now)
        ],
        "retention": None
        if kept is None
        else {"days": kept.days, "chosen_by": kept.changed_by, "chosen_at": kept.changed_at},
        "messages": _messages(tx, f"user:{owner}"),
    }


def _messages(tx: Transaction, person: str) -> dict[str, Any]:
    said = ("channel", "address", "label", "kinds", "created_at", "confirmed_at", "delivered_at", "ended_at")
    query = sa.select(*(receiver.c[name] for name in said)).where(receiver.c.person == person).order_by(receiver.c.id)
    to = [dict(row._mapping) for row in tx.execute(query)]
    for one in to:
        if one["channel"] == "push":  # whoever knows where a browser listens can send it something
            del one["address"]
    return {"language": receivers.language(tx, person), "kinds": dict(receivers.preferences(tx, person)), "to": to}
