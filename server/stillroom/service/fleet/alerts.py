"""Those who run the service are told where a rate is too high, once, and once when it is over.

It is raised where the whole interval of the rate is above one value, so that few missions raise nothing, and ended where the rate is
below another, lower one: a rate at its edge tells nobody twice.
"""

from datetime import UTC, datetime, timedelta

from stillroom.documents.alerts import AlertDocument, NewAlert
from stillroom.documents.api import Page
from stillroom.documents.fleet import RateRow
from stillroom.documents.notifications import WebhookType
from stillroom.errors import AlreadyExists, Fault, InvalidInput, NotFound
from stillroom.service.access import Principal, signature
from stillroom.service.fleet.rates import rates
from stillroom.service.fleet.selecting import Asked
from stillroom.service.messages.operators import tell_operators
from stillroom.store import alerts, clock
from stillroom.store.alerts import AlertRule, NewAlertRule
from stillroom.store.database import Database, Transaction

EVERY = timedelta(minutes=1)
MOST = 100
SELECTED = ("firmware", "model", "algorithm", "size")


def add_alert(database: Database, caller: Principal, new: NewAlert) -> AlertDocument:
    """Raises InvalidInput, AlreadyExists."""
    if new.below > new.above:
        raise InvalidInput("It has to end lower than it is raised.", (Fault("/below", "higher than above"),))
    with database.write() as tx:
        if len(alerts.every(tx)) >= MOST:
            raise InvalidInput(f"There are {MOST} alerts already; remove one first.")
        same = {name: getattr(new, name) for name in ("name", "measure", "days", "minimum_n", "above", "below")}
        selection = {name: list(getattr(new, name)) for name in SELECTED}
        rule = NewAlertRule(**same, selection=selection, created_at=clock.now(tx), created_by=signature(caller))
        if not alerts.add(tx, rule):
            raise AlreadyExists(f"There is an alert {new.name} already.")
        return _document(_find(tx, new.name))


def list_alerts(database: Database) -> Page[AlertDocument]:
    with database.read() as tx:
        return Page(items=[_document(rule) for rule in alerts.every(tx)], next=None)


def remove_alert(database: Database, name: str) -> None:
    """Raises NotFound."""
    with database.write() as tx:
        if not alerts.remove(tx, name):
            raise NotFound(f"There is no alert {name}.")


def watch(database: Database) -> None:
    """Looks at the rates of all alerts that were not looked at in the last minute."""
    with database.read() as tx:
        now = clock.now(tx)
        due = alerts.due(tx, now - EVERY)
    for rule in due:
        _look(database, rule, now)


def _look(database: Database, rule: AlertRule, now: datetime) -> None:
    today = now.astimezone(UTC).date()
    first = (today - timedelta(days=rule.days - 1)).isoformat()
    which = Asked(first, today.isoformat(), **{name: tuple(rule.selection[name]) for name in SELECTED})
    row = rates(database, which, None, counted=False).total
    share, (low, high) = getattr(row.rates, rule.measure), getattr(row.ci95, rule.measure)
    is_raised = _is_raised(rule, row, share, low)
    figures = None
    if share is not None:
        figures = {"share": share, "ci95": [low, high], "missions": row.missions, "first": first}
    changes = is_raised != (rule.raised_at is not None)
    values = {"looked_at": now, "figures": figures} | ({"raised_at": now if is_raised else None} if changes else {})
    with database.write(durable=False) as tx:
        if not alerts.look(tx, rule, values) or not changes:
            return
        limits = {"above": rule.above, "below": rule.below, "share": share, "low": low, "high": high}
        about = {"alert": rule.name, "measure": rule.measure, "missions": row.missions, "first": first}
        kind: WebhookType = "alert.raised" if is_raised else "alert.ended"
        tell_operators(tx, kind, about | limits | {"selection": rule.selection}, "/fleet")


def _is_raised(rule: AlertRule, row: RateRow, share: float | None, low: float) -> bool:
    if share is None or row.missions < rule.minimum_n:
        return rule.raised_at is not None
    return low > rule.above or (rule.raised_at is not None and share >= rule.below)


def _find(tx: Transaction, name: str) -> AlertRule:
    rule = alerts.by_name(tx, name)
    assert rule is not None
    return rule


def _document(rule: AlertRule) -> AlertDocument:
    return AlertDocument.model_validate(vars(rule) | rule.selection)
