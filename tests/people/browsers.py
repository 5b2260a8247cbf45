"""People of tests: browsers with cookies of their own, accounts, and the links that letters bring them."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any

import sqlalchemy as sa
from httpx2 import Response
from starlette.testclient import TestClient

from stillroom.service.accounts import new_login_link
from stillroom.service.people import passwords
from stillroom.store import people
from stillroom.store.tables import throttle
from tests.conftest import Service
from tests.service.messages.mailbox import MailBox, mail_server, server_of
from tests.telling import allow

ANN, BOB = "ann@example.org", "bob@example.org"
PASSWORD = "a good long passphrase"


@dataclass
class Browser:
    """Keeps cookies as browsers do, and says as they do where a request comes from."""

    service: Service
    source: str = "203.0.113.7"
    cookies: dict[str, str] = field(default_factory=dict)

    def request(self, method: str, path: str, headers: dict[str, str] | None = None, **rest: Any) -> Response:
        app = self.service.http.app
        base = str(self.service.http.base_url)
        http = TestClient(app, base, raise_server_exceptions=False, client=(self.source, 4711))
        cookies = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        sent = {"Sec-Fetch-Site": "same-origin"} | ({"Cookie": cookies} if cookies else {}) | (headers or {})
        answer = http.request(method, path, headers=sent, follow_redirects=False, **rest)
        for said in answer.headers.get_list("Set-Cookie"):
            name, _, value = said.partition(";")[0].partition("=")
            self.cookies[name] = value
        return answer

    def get(self, path: str) -> Response:
        return self.request("GET", path)

    def post(self, path: str, **body: Any) -> Response:
        return self.request("POST", path, json=body)

    def sign_in(self, email: str = ANN, password: str = PASSWORD) -> Response:
        return self.post("/api/v1/session", email=email, password=password)

    @property
    def session(self) -> str:
        return self.cookies["stillroom_session"]

    def is_in(self) -> bool:
        return self.get("/api/v1/session").status_code == 200


def add_account(service: Service, email: str = ANN, duty: str | None = None, password: str | None = PASSWORD) -> None:
    hashed = None if password is None else passwords.hashed(password, email)
    with service.database.write() as tx:
        people.find_or_add(tx, email, datetime.now(UTC))
        people.change(tx, email, {"password_hash": hashed, "duty": duty})


def by_link(service: Service, email: str | None) -> Browser:
    browser = Browser(service)
    assert browser.get(f"/login?token={new_login_link(service.database, email)}").status_code == 303
    return browser


@contextmanager
def posting(service: Service, **how: Any) -> Iterator[MailBox]:
    with mail_server(**how) as box:
        allow(service, mail=server_of(box))
        try:
            yield box
        finally:
            allow(service)


def secret_in(box: MailBox, to: str) -> str:
    """Of the last link that somebody was sent."""
    letter = [message for message in box.messages if message["To"] == to][-1]
    plain = letter.get_body(("plain",))
    assert plain is not None
    found = re.search(r"https://maps\.example\.org/(?:invitation|new-password)#(\S+)", plain.get_content())
    assert found is not None
    return found[1]


def later(service: Service, by: timedelta) -> None:
    """As if so much time had gone by for what was tried too often."""
    with service.database.write() as tx:
        for row in tx.execute(sa.select(throttle)).all():
            values = {"open_at": row.open_at - by, "forget_at": row.forget_at - by}
            tx.execute(sa.update(throttle).where(throttle.c.key == row.key).values(**values))
