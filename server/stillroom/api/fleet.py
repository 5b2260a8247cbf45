"""For fleet engineers: how often updates fail, by what, and since when."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request
from starlette.responses import Response

from stillroom.api.context import (
    AnyMissionId,
    Caller,
    Limit,
    MapName,
    NumberCursor,
    RobotId,
    Service,
    document,
    may,
    page,
)
from stillroom.documents import fleet, tables
from stillroom.documents.api import Page
from stillroom.documents.replays import Cell, Measure, NewReplay, ReplayDocument, ReplayedMission, ReplayResults
from stillroom.service.fleet import causes, rates, replays, unprocessed
from stillroom.service.fleet.selecting import Asked

PARQUET = "application/vnd.apache.parquet"
router = APIRouter(prefix="/api/v1/fleet", dependencies=[Depends(may("figures"))])
_TRIAGE = [Depends(may("triage"))]
Day = Annotated[str | None, Query(max_length=40, description="YYYY-MM-DD or RFC 3339; its day in UTC counts")]
Values = Annotated[list[Annotated[str, Query(max_length=100)]], Query(max_length=50)]
Sizes = Annotated[list[fleet.Size], Query(max_length=5)]
CauseId = Annotated[str, Path(alias="cause", pattern=r"^[0-9a-f]{16}$")]


def asked(
    first: Annotated[Day, Query(alias="from")] = None,
    last: Annotated[Day, Query(alias="to")] = None,
    firmware: Values = [],  # noqa: B006  # FastAPI copies it
    model: Values = [],  # noqa: B006
    algorithm: Values = [],  # noqa: B006
    size: Sizes = [],  # noqa: B006
) -> Asked:
    """Both days count; the last 30 where none is given. A filter may be given several times: any of its values."""
    return Asked(first, last, tuple(firmware), tuple(model), tuple(algorithm), tuple(size))


Which = Annotated[Asked, Depends(asked)]


@router.get("/failure-rates", response_model=fleet.RatesDocument)
def show_rates(
    service: Service,
    which: Which,
    group_by: Annotated[fleet.GroupBy | None, Query()] = None,
    interval: Annotated[fleet.Interval, Query()] = "wilson",
) -> Response:
    """Shares of missions with their 95 % intervals, which take into account that missions of one robot are alike.

    `interval=bootstrap` draws robots anew, a thousand times: exact where there are many robots, and slow.
    """
    return document(rates.rates(service.database, which, group_by, interval))


@router.get(
    "/failure-rates.csv",
    response_class=Response,
    responses={200: {"content": {"text/csv": {"schema": {"type": "string"}}}}},
)
def export_rates(
    service: Service,
    which: Which,
    group_by: Annotated[fleet.GroupBy | None, Query()] = None,
    interval: Annotated[fleet.Interval, Query()] = "wilson",
) -> Response:
    """The same as a table: one line for each row, one for all."""
    found = rates.rates(service.database, which, group_by, interval)
    return _file(tables.as_csv(found).encode(), f"failure-rates-{found.first}-{found.last}.csv", "text/csv")


@router.get(
    "/failure-rates.parquet",
    response_class=Response,
    responses={200: {"content": {PARQUET: {"schema": {"type": "string", "format": "binary"}}}}},
)
def export_rates_as_parquet(
    service: Service,
    which: Which,
    group_by: Annotated[fleet.GroupBy | None, Query()] = None,
    interval: Annotated[fleet.Interval, Query()] = "wilson",
) -> Response:
    """The same with typed columns. Where the service was installed without it, 503."""
    found = rates.rates(service.database, which, group_by, interval)
    return _file(tables.as_parquet(found), f"failure-rates-{found.first}-{found.last}.parquet", PARQUET)


def _file(content: bytes, name: str, media_type: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(content, headers=headers, media_type=media_type)


@router.get("/filters", response_model=fleet.FiltersDocument)
def show_filters(service: Service) -> Response:
    """What can be selected by."""
    return document(rates.filters(service.database))


@router.get("/robots", response_model=Page[fleet.RobotRow])
def list_robots(
    service: Service,
    which: Which,
    sort: Annotated[fleet.RobotOrder, Query()] = "-failure_rate",
    at_least: Annotated[int, Query(ge=1, le=10_000)] = 1,
    limit: Limit = 20,
) -> Response:
    """The worst. `-lower_bound` puts those first that surely fail often, not those that failed once in one mission."""
    return document(Page(items=rates.robots(service.database, which, sort, at_least, limit), next=None))


@router.get("/causes", response_model=fleet.CausesDocument)
def list_causes(
    service: Service, which: Which, state: Annotated[fleet.CauseState | None, Query()] = None, limit: Limit = 100
) -> Response:
    """What missions failed by, the most frequent first."""
    return document(causes.causes(service.database, which, state, limit))


@router.get("/causes/{cause}", response_model=fleet.CauseDocument)
def show_cause(service: Service, which: Which, key: CauseId) -> Response:
    return document(causes.cause(service.database, which, key))


@router.put("/causes/{cause}/mute", response_model=fleet.CauseDocument, dependencies=_TRIAGE)
def mute(service: Service, who: Caller, key: CauseId, how: fleet.Mute) -> Response:
    return document(causes.mute(service.database, who, key, how))


@router.delete("/causes/{cause}/mute", response_model=fleet.CauseDocument, dependencies=_TRIAGE)
def unmute(service: Service, key: CauseId) -> Response:
    return document(causes.unmute(service.database, key))


@router.get("/missions", response_model=Page[fleet.FleetMissionItem])
def list_missions(
    request: Request,
    service: Service,
    which: Which,
    cursor: NumberCursor,
    cause: Annotated[str | None, Query(pattern=r"^[0-9a-f]{16}$")] = None,
    escaped: bool = False,
    limit: Limit = 100,
) -> Response:
    """Those that failed, by one cause or by any, or those that escaped; the newest arrivals first."""
    return page(request, causes.missions(service.database, which, cause, escaped, cursor, limit))


@router.get("/unprocessed", response_model=Page[fleet.UnprocessedMission])
def list_unprocessed(request: Request, service: Service, cursor: NumberCursor, limit: Limit = 100) -> Response:
    """Missions that could not be processed, with the error; the newest arrivals first."""
    return page(request, unprocessed.list_unprocessed(service.database, cursor, limit))


@router.post(
    "/robots/{robot}/maps/{map}/missions/{mission}/run", status_code=202, response_class=Response, dependencies=_TRIAGE
)
def run_again(service: Service, robot: RobotId, map_name: MapName, key: AnyMissionId) -> Response:
    """Queues a mission again that could not be processed. Where newer missions were processed since, it is late."""
    unprocessed.run_again(service.database, robot, map_name, key)
    where = f"/api/v1/fleet/robots/{robot}/maps/{map_name}/missions/{key}"
    return Response(status_code=202, headers={"Location": where})


ReplayName = Annotated[str, Path(alias="replay", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]


@router.get("/replays", response_model=Page[ReplayDocument])
def list_replays(request: Request, service: Service, cursor: NumberCursor, limit: Limit = 100) -> Response:
    """Stored missions run again, the newest first."""
    return page(request, replays.list_replays(service.database, cursor, limit))


@router.post("/replays", status_code=201, response_model=ReplayResults, dependencies=_TRIAGE)
def begin_replay(service: Service, new: NewReplay) -> Response:
    """Runs stored missions again, when nothing else waits; no map is touched."""
    made = replays.begin(service.database, new)
    return document(made, 201, {"Location": f"/api/v1/fleet/replays/{made.name}"})


@router.get("/replays/{replay}", response_model=ReplayResults)
def show_replay(service: Service, name: ReplayName) -> Response:
    """Its paired tables, so far as it has been run."""
    return document(replays.results(service.database, name))


@router.get("/replays/{replay}/missions", response_model=Page[ReplayedMission])
def list_replayed(
    request: Request,
    service: Service,
    name: ReplayName,
    cursor: NumberCursor,
    measure: Annotated[Measure, Query()] = "taken",
    cell: Annotated[Cell, Query()] = "only_old",
    limit: Limit = 100,
) -> Response:
    """The missions of one cell of a table, the newest arrivals first."""
    return page(request, replays.missions(service.database, name, measure, cell, cursor, limit))
