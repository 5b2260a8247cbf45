"""What every answer says to browsers, and limits of what one caller may ask."""

import asyncio
from typing import Any

import pytest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from stillroom.api import body_limit
from stillroom.api.body_limit import BodyLimit
from stillroom.api.problems import install
from stillroom.api.protection import HEADERS, FairShare
from stillroom.logs import _visible
from tests.conftest import Caller, RobotCaller, Service

CALLER = [(b"authorization", b"Bearer one")]


@pytest.mark.parametrize("path", ["/", "/healthz", "/api/v1/robots", "/assets/none.js", "/problems/not-found", "/openapi.json", "/%00"])  # fmt: skip
def test_every_answer_tells_browsers_to_trust_nothing_else(service: Service, path: str) -> None:
    for caller in (service.operator, service.stranger):
        said = caller.get(path).headers
        assert (
            HEADERS.items() <= dict(said).items()
            or {k.lower(): v for k, v in HEADERS.items()}.items() <= dict(said).items()
        )
        assert "'unsafe-inline'" not in said["Content-Security-Policy"].split("script-src")[1].split(";")[0]
        assert "Strict-Transport-Security" not in said
    secure = service.http.get(f"https://stillroom.test{path}")
    assert "Strict-Transport-Security" in secure.headers


def test_what_is_somebodys_stays_in_no_cache(service: Service, mapped: RobotCaller) -> None:
    assert mapped.get("/api/v1/robots").headers["Cache-Control"] == "no-store"
    version = f"{mapped.path()}/versions/1"
    for path in (mapped.path(), version, f"{version}/export?format=geojson"):
        assert mapped.get(path).headers["Cache-Control"] == "no-store", path
    for path in (f"{version}/grid.png", f"{version}/cells.png", f"{mapped.path()}/missions/0/grid.png"):
        said = mapped.get(path).headers
        assert said["Cache-Control"] == "private, no-cache", path
        again = mapped.get(path, {"If-None-Match": said["ETag"]})
        assert (again.status_code, again.content) == (304, b""), path
    assert service.stranger.get("/api/v1/robots").headers["Cache-Control"] == "no-store"


class Waiting:
    """An application that answers when it is let."""

    def __init__(self) -> None:
        self.go = asyncio.Event()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["path"] == "/body":
            while (await receive()).get("more_body"):
                pass
        await self.go.wait()
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})


async def ask(
    app: ASGIApp, headers: list[tuple[bytes, bytes]], path: str = "/", pieces: tuple[bytes, ...] = ()
) -> tuple[int, dict[str, str]]:
    """Status and headers. What follows the pieces never comes."""
    left, answer = list(pieces), dict[str, Any]()

    async def receive() -> Message:
        if left:
            return {"type": "http.request", "body": left.pop(0), "more_body": True}
        await asyncio.sleep(3600)
        raise AssertionError

    async def send(message: Message) -> None:
        answer.update(message)

    scope = {
        "type": "http",
        "method": "PUT",
        "path": path,
        "headers": headers,
        "query_string": b"",
        "client": ("192.0.2.1", 1),
    }
    await app(scope, receive, send)
    return answer["status"], {name.decode(): value.decode() for name, value in answer.get("headers", [])}


def test_one_caller_cannot_take_the_share_of_others() -> None:
    async def scenario() -> None:
        inner = Waiting()
        app = FairShare(inner, most_of_one=2, most_of_all=4)
        first = [asyncio.ensure_future(ask(app, CALLER)) for _ in range(2)]
        await asyncio.sleep(0)
        status, headers = await ask(app, CALLER)
        assert (status, headers["retry-after"]) == (429, "1")
        others = [asyncio.ensure_future(ask(app, [(b"cookie", b"other")])), asyncio.ensure_future(ask(app, []))]
        await asyncio.sleep(0)
        status, headers = await ask(app, [(b"cookie", b"third")])
        assert (status, headers["retry-after"]) == (503, "1")
        inner.go.set()
        assert [answer[0] for answer in await asyncio.gather(*first, *others)] == [200] * 4
        assert (await ask(app, CALLER))[0] == 200, "nothing is left over"
        assert not app._asking
        assert app._all == 0

    asyncio.run(scenario())


def test_a_body_that_stops_coming_and_one_that_finds_no_room_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from fastapi import FastAPI, Request

    monkeypatch.setattr(body_limit, "MAX_DOCUMENT", 100)
    app = FastAPI()

    @app.put("/body")
    async def read(request: Request) -> int:
        return len(await request.body())

    install(app)
    app.add_middleware(BodyLimit, max_held=80, patience_s=0.01)

    async def scenario() -> None:
        assert (await ask(app, [], "/body", (b"a",)))[0] == 408
        status, headers = await ask(app, [], "/body", (b"a" * 81,))
        assert (status, headers["retry-after"]) == (503, "2")
        assert (await ask(app, [], "/body", (b"a" * 50, b"a" * 51)))[0] in (413, 503)
        assert (await ask(app, [(b"content-length", b"101")], "/body", (b"a",)))[0] == 413
        assert (await ask(app, [], "/body", (b"a" * 80,)))[0] == 408, "what was held before is held no more"

    asyncio.run(scenario())


def test_every_route_has_a_limit_of_its_body(service: Service, robot: RobotCaller) -> None:
    large = b'"' + b"a" * body_limit.MAX_DOCUMENT + b'"'
    json = {"Content-Type": "application/json"}
    for caller, method, path in (
        (service.operator, "POST", "/api/v1/robots"),
        (service.operator, "POST", f"{robot.path()}/edits"),
        (service.operator, "PATCH", robot.path()),
        (service.operator, "POST", "/api/v1/webhooks"),
    ):
        assert Caller.request(caller, method, path, json, content=large).status_code == 413, path


def test_what_strangers_write_cannot_move_a_terminals_cursor() -> None:
    said = _visible(None, "info", {"event": "request", "path": '/a\x1b[2J\n{"event": "lie"}', "status": 404})
    assert said["path"] == '/a\\x1b[2J\\n{"event": "lie"}'
    assert said["status"] == 404
