"""For those who run the service. These answer everybody: they hold numbers of the whole service and no one's data."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Literal

from fastapi import APIRouter
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from pydantic import BaseModel
from starlette.responses import Response

from stillroom.api.context import Service
from stillroom.errors import Unavailable
from stillroom.store import deliveries, fleet_figures, migrate, missions
from stillroom.store.missions import Tally

router = APIRouter()


class Health(BaseModel):
    status: Literal["ok"] = "ok"


@router.get("/healthz")
def alive() -> Health:
    """The process answers."""
    return Health()


@router.get("/readyz")
def ready(service: Service) -> Health:
    """Database and grid store answer, and the schema is the newest."""
    with service.database.read() as tx:
        if not migrate.is_current(tx):
            raise Unavailable("The database has not been migrated: run `stillroom migrate`.")
    try:
        service.grids.check()
    except Exception as error:
        raise Unavailable("The grid store does not answer.") from error
    return Health()


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(service: Service) -> Response:
    """For Prometheus. Read from the database, so that every process of the service tells the same."""
    with service.database.read() as tx:
        tally, messages = missions.tally(tx), deliveries.tally(tx)
        fleet, uncounted = fleet_figures.totals(tx), fleet_figures.waiting(tx)
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Missions(tally))
    registry.register(_Messages(messages))
    registry.register(_Fleet(fleet, uncounted))
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)


class _Messages:
    def __init__(self, tally: Sequence[tuple[str, str, int]]) -> None:
        self._tally = tally

    def collect(self) -> Iterator[Metric]:
        name, text = "stillroom_messages", "Messages of the last 30 days, and those that wait"
        family = GaugeMetricFamily(name, text, labels=["channel", "state"])
        for channel, state, count in self._tally:
            family.add_metric([channel, state], count)
        yield family


class _Fleet:
    """What failure rates are made of, so that Prometheus can take them over any time: with `delta()`.

    No counters: a mission that is run again, or a home that is deleted, takes some away, which Prometheus would take for a restart from 0.
    """

    def __init__(self, totals: Mapping[str, int], uncounted: int) -> None:
        self._totals, self._uncounted = totals, uncounted

    def collect(self) -> Iterator[Metric]:
        judged = "Missions that the failure rates are shares of: neither first, late nor parked ones"
        yield GaugeMetricFamily("stillroom_missions_judged", judged, self._totals["missions"])
        name = "stillroom_missions_failed"
        failed = GaugeMetricFamily(name, "Judged missions that fail with so much of the system", labels=["row"])
        for row in ("transfer", "meta_occupancy", "meta_dividers"):
            failed.add_metric([row], self._totals[row])
        yield failed
        escaped = "Missions that were taken by themselves and that people corrected within a week"
        yield GaugeMetricFamily("stillroom_missions_escaped", escaped, self._totals["escapes"])
        text = "Missions that were processed and are not in the failure rates yet"
        yield GaugeMetricFamily("stillroom_missions_uncounted", text, self._uncounted)


class _Missions:
    def __init__(self, tally: Tally) -> None:
        self._tally = tally

    def collect(self) -> Iterator[Metric]:
        done = GaugeMetricFamily("stillroom_missions", "Missions processed", labels=["outcome"])
        for outcome, count in sorted(self._tally.by_outcome.items()):
            done.add_metric([outcome], count)
        yield done
        yield GaugeMetricFamily("stillroom_missions_waiting", "Missions queued or in processing", self._tally.waiting)
        text = "Missions that could not be processed"
        yield GaugeMetricFamily("stillroom_missions_unprocessed", text, self._tally.unprocessed)
        since = self._tally.oldest_waiting_since
        age = 0.0 if since is None else max((datetime.now(UTC) - since).total_seconds(), 0.0)
        yield GaugeMetricFamily("stillroom_oldest_waiting_seconds", "Age of the mission that waits longest", age)
