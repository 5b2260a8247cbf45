"""Server-sent events: people's browsers follow their maps."""

import asyncio
from collections.abc import AsyncIterator, Callable
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import StreamingResponse

from stillroom.api.context import Caller, Parts, Service, caller, may
from stillroom.documents import api
from stillroom.errors import Unauthenticated
from stillroom.service.access import Principal
from stillroom.service.events import events_after, newest_event

KEEP_ALIVE_S = 15.0
NAME = r"^[^\x00-\x1f\x7f]{1,64}$"
router = APIRouter()


@router.get(
    "/api/v1/events",
    response_class=StreamingResponse,
    dependencies=[Depends(may("list"))],
    responses={200: {"content": {"text/event-stream": {"itemSchema": {"$ref": "#/components/schemas/Event"}}}}},
)
async def follow(
    request: Request,
    service: Service,
    who: Caller,
    robot: Annotated[str | None, Query(pattern=NAME)] = None,
    map_name: Annotated[str | None, Query(alias="map", pattern=NAME)] = None,
    last_event_id: Annotated[str | None, Header()] = None,
) -> StreamingResponse:
    """What happens to the maps that the caller may see, from now on or after Last-Event-ID; ends with the credential."""
    if last_event_id is not None and last_event_id.isdecimal() and len(last_event_id) < 19:
        last = int(last_event_id)
    else:
        last = await run_in_threadpool(newest_event, service.database, who)
    stream = _stream(service, who, partial(caller, request), robot, map_name, last)
    return StreamingResponse(stream, media_type="text/event-stream", headers={"Cache-Control": "no-store"})


async def _stream(
    service: Parts,
    who: Principal,
    who_now: Callable[[], Principal],
    robot: str | None,
    map_name: str | None,
    last: int,
) -> AsyncIterator[str]:
    """Nobody is told anything before it was asked again who that is: sessions end, robots change hands, duties are taken back."""
    with service.signals.watch() as watch:
        yield f"id: {last}\nretry: 2000\n\n"
        while not service.signals.closed:
            watch.changed.clear()
            found = await run_in_threadpool(events_after, service.database, who, last, robot, map_name)
            if not found:
                try:
                    await asyncio.wait_for(watch.changed.wait(), KEEP_ALIVE_S)
                    continue
                except TimeoutError:
                    yield ": still here\n\n"
            try:
                before, who = who, await run_in_threadpool(who_now)
            except Unauthenticated:
                return
            if who == before:
                for last, event in found:
                    yield _message(last, event)


def _message(number: int, event: api.Event) -> str:
    return f"id: {number}\nevent: {event.kind}\ndata: {event.model_dump_json()}\n\n"
