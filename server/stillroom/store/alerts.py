"""When those who run the service are told of a rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction, insert_unless_there
from stillroom.store.fleet_tables import alert_rule
from stillroom.store.rows import Json, as_row, columns


@dataclass(frozen=True)
class NewAlertRule:
    name: str
    measure: str
    selection: Json
    days: int
    minimum_n: int
    above: float
    below: float
    created_at: datetime
    created_by: str


@dataclass(frozen=True)
class AlertRule(NewAlertRule):
    id: int
    looked_at: datetime | None
    raised_at: datetime | None
    figures: Json | None


_RULE = sa.select(*columns(alert_rule, AlertRule))


def add(tx: Transaction, new: NewAlertRule) -> bool:
    """False where there is one of that name."""
    return insert_unless_there(tx, alert_rule, vars(new))


def every(tx: Transaction) -> Sequence[AlertRule]:
    """In order of their names."""
    return [as_row(AlertRule, row) for row in tx.execute(_RULE.order_by(alert_rule.c.name))]


def by_name(tx: Transaction, name: str) -> AlertRule | None:
    row = tx.execute(_RULE.where(alert_rule.c.name == name)).first()
    return None if row is None else as_row(AlertRule, row)


def due(tx: Transaction, before: datetime) -> Sequence[AlertRule]:
    """Those that nobody has looked at since then."""
    waits = sa.or_(alert_rule.c.looked_at.is_(None), alert_rule.c.looked_at < before)
    return [as_row(AlertRule, row) for row in tx.execute(_RULE.where(waits).order_by(alert_rule.c.id))]


def look(tx: Transaction, rule: AlertRule, values: Mapping[str, Any]) -> bool:
    """Keeps what was seen; False where somebody else has looked meanwhile."""
    same = alert_rule.c.id == rule.id, alert_rule.c.looked_at.is_not_distinct_from(rule.looked_at)
    return tx.execute(sa.update(alert_rule).where(*same).values(**values)).rowcount > 0


def remove(tx: Transaction, name: str) -> bool:
    return tx.execute(sa.delete(alert_rule).where(alert_rule.c.name == name)).rowcount > 0
