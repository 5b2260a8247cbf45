"""Receivers of messages for tests: real servers on this machine, and names that lead to them."""

import json
import socket
import ssl
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from ipaddress import ip_network
from typing import Any

import sqlalchemy as sa

from stillroom.service.accounts import new_login_link, sign_in
from stillroom.service.messages.messenger import Messenger
from stillroom.settings import Messaging, Outbound
from stillroom.store.tables import delivery, receiver
from tests.conftest import Caller, Service

PUBLIC_URL = "https://maps.example.org"
HERE = Outbound((ip_network("127.0.0.1/32"),), insecure_http=True)
"""What the tests' own servers need: an address that nobody else may have messages sent to."""
Json = dict[str, Any]


@dataclass(frozen=True)
class Request:
    path: str
    headers: Mapping[str, str]
    """Names in lower case."""
    body: bytes

    @property
    def json(self) -> Json:
        found: Json = json.loads(self.body)
        return found


Behaviour = Callable[[BaseHTTPRequestHandler], None]
"""How a receiver answers; the request's body has been read."""


def answering(status: int, headers: Mapping[str, str] | None = None, body: bytes = b"") -> Behaviour:
    def answer(request: BaseHTTPRequestHandler) -> None:
        request.send_response(status)
        for name, value in (headers or {}).items():
            request.send_header(name, value)
        request.send_header("Content-Length", str(len(body)))
        request.end_headers()
        request.wfile.write(body)

    return answer


@dataclass
class Receiver:
    port: int
    behaviour: Behaviour = field(default_factory=lambda: answering(204))
    requests: list[Request] = field(default_factory=list)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/hook"


@contextmanager
def receiving(tls: ssl.SSLContext | None = None) -> Iterator[Receiver]:
    """An HTTP server that keeps what it is sent."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            headers = {name.lower(): value for name, value in self.headers.items()}
            there.requests.append(Request(self.path, headers, body))
            with suppress(OSError):  # who is served may have gone
                there.behaviour(self)

        def do_GET(self) -> None:
            there.requests.append(Request(self.path, {}, b""))
            answering(200)(self)

        def log_message(self, *_: object) -> None:
            pass

    class Server(ThreadingHTTPServer):
        daemon_threads = True
        block_on_close = False

        def get_request(self) -> tuple[socket.socket, Any]:
            connection, address = super().get_request()
            return (connection if tls is None else tls.wrap_socket(connection, True)), address

        def handle_error(self, *_: object) -> None:  # who is served may have gone
            pass

    server = Server(("127.0.0.1", 0), Handler)
    there = Receiver(server.server_address[1])
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    try:
        yield there
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def silent() -> Iterator[int]:
    """Takes connections and says nothing."""
    with socket.create_server(("127.0.0.1", 0)) as there:
        port: int = there.getsockname()[1]
        yield port


@dataclass
class Names:
    """Stands for the DNS: what each name resolves to, one answer after the other; the last stays."""

    answers: dict[str, list[Sequence[str]]] = field(default_factory=dict)
    asked: list[str] = field(default_factory=list)

    def __call__(self, name: str, _port: int) -> list[str]:
        self.asked.append(name)
        if name not in self.answers:
            return [name]
        left = self.answers[name]
        return list(left.pop(0) if len(left) > 1 else left[0])


def owner(service: Service, email: str) -> Caller:
    """Somebody who signed in with a browser."""
    cookie = sign_in(service.database, new_login_link(service.database, email))
    return Caller(service.http, {"Cookie": f"stillroom_session={cookie}", "Sec-Fetch-Site": "same-origin"})


def allow(service: Service, **changes: Any) -> Messaging:
    """Settings under which messages may go to this machine, for the API and for a messenger."""
    messaging = replace(Messaging(PUBLIC_URL, None, HERE), **changes)
    object.__setattr__(service.http.app.state.parts, "messaging", messaging)  # type: ignore[attr-defined]
    return messaging


@contextmanager
def delivering(
    service: Service, messaging: Messaging, names: Names | None = None, total_s: float = 5.0
) -> Iterator[Messenger]:
    messenger = Messenger(service.database, service.grids, messaging, names or Names(), total_s)
    try:
        yield messenger
    finally:
        messenger.close()


def until(messenger: Messenger, holds: Callable[[], bool]) -> None:
    """Lets it work until something holds that does."""
    for _ in range(600):
        messenger.step()
        if holds():
            return
        threading.Event().wait(0.05)
    raise AssertionError("it did not come true")


def hasten(service: Service) -> None:
    """As if all waits were over: of messages to be tried again, of people to be left in peace. Leases run on."""
    past = datetime.now(UTC) - timedelta(seconds=1)
    with service.database.write() as tx:
        waits = delivery.c.state == "waiting", delivery.c.claim.is_(None)
        tx.execute(sa.update(delivery).where(*waits).values(due_at=past))
        tx.execute(sa.update(receiver).values(resume_at=None))


def expire_leases(service: Service) -> None:
    past = datetime.now(UTC) - timedelta(seconds=1)
    with service.database.write() as tx:
        tx.execute(sa.update(delivery).where(delivery.c.claim.is_not(None)).values(due_at=past))
        tx.execute(sa.update(receiver).values(resume_at=None))


def add_webhook(caller: Caller, url: str, **more: Any) -> Json:
    made = caller.request("POST", "/api/v1/webhooks", json={"url": url} | more)
    assert made.status_code == 201, made.text
    found: Json = made.json()
    return found


def deliveries_of(caller: Caller, webhook: Json) -> list[Json]:
    """The oldest first."""
    answer = caller.get(f"/api/v1/webhooks/{webhook['id']}/deliveries")
    assert answer.status_code == 200, answer.text
    items: list[Json] = answer.json()["items"]
    return items[::-1]
