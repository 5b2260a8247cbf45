"""Signing in with an identity provider: a real one, in a process of its own."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from urllib.parse import urlsplit

import httpx2
import pytest

from stillroom.settings import Messaging, Provider
from stillroom.store import people
from tests.conftest import Service
from tests.people.browsers import ANN, Browser, add_account, by_link
from tests.ports import free_port

HERE = "http://stillroom.test"
START_S = 60.0
USERS = {
    "olga-1": {"email": "olga@example.org", "email_verified": True},
    "olga-2": {"email": "olga@example.org", "email_verified": True},
    "ann-1": {"email": ANN, "email_verified": False},
}


def _answers(url: str) -> bool:
    with suppress(httpx2.TransportError):
        return httpx2.get(f"{url}/.well-known/openid-configuration").is_success
    return False


@contextmanager
def running_provider() -> Iterator[str]:
    port = free_port()
    users = [word for sub, said in USERS.items() for word in ("--user-claims", json.dumps({"sub": sub} | said))]
    process = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-m", "oidc_provider_mock", "--port", str(port), *users],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    url = f"http://127.0.0.1:{port}"
    try:
        until = time.monotonic() + START_S
        while not _answers(url):
            assert process.poll() is None, "the provider does not run"
            assert time.monotonic() < until, "the provider does not answer"
            time.sleep(0.05)
        yield url
    finally:
        process.terminate()
        process.wait()


@pytest.fixture(scope="module")
def provider_url() -> Iterator[str]:
    with running_provider() as url:
        yield url


@pytest.fixture
def provided(service: Service, provider_url: str) -> Service:
    parts = service.http.app.state.parts  # type: ignore[attr-defined]
    provider = Provider(provider_url, "stillroom", "a secret of the tests", "The Company")
    for name, value in (("provider", provider), ("messaging", replace(Messaging(), public_url=HERE))):
        object.__setattr__(parts, name, value)
    return service


def vouched(browser: Browser, who: str) -> str:
    """Where somebody comes back to from the provider."""
    away = browser.get("/login/oidc")
    assert away.status_code == 302, away.text
    back = httpx2.post(away.headers["Location"], data={"sub": who}, follow_redirects=False, timeout=START_S)
    assert back.status_code == 302, back.text
    return back.headers["Location"].removeprefix(HERE)


def test_an_operator_who_was_invited_signs_in_by_the_provider(provided: Service) -> None:
    assert Browser(provided).get("/api/v1/sign-in").json()["provider"] == "The Company"
    operator = by_link(provided, None)
    made = operator.post("/api/v1/accounts/invitations", email="olga@example.org", duty="operator")
    assert made.status_code == 201, made.text
    olga = Browser(provided, cookies={"stillroom_session": "planted", "stillroom_next": "%2Foperator"})
    answer = olga.get(vouched(olga, "olga-1"))
    assert (answer.status_code, answer.headers["Location"]) == (303, "/operator")
    assert olga.get("/api/v1/session").json()["kind"] == "operator"
    assert operator.get("/api/v1/accounts/invitations").json()["items"] == []
    # the address alone is worth nothing any more: whoever is given it later is somebody else
    other = Browser(provided)
    assert other.get(vouched(other, "olga-2")).headers["Location"] == "/?uninvited"
    assert not other.is_in()
    again = Browser(provided)
    assert again.get(vouched(again, "olga-1")).status_code == 303
    assert again.is_in()


def test_nobody_comes_in_who_was_not_invited_or_whose_address_is_not_verified(provided: Service) -> None:
    add_account(provided)
    for who in ("olga-1", "ann-1"):
        browser = Browser(provided)
        assert browser.get(vouched(browser, who)).headers["Location"] == "/?uninvited"
        assert not browser.is_in()
    with provided.database.read() as tx:
        assert people.find(tx, "olga@example.org") is None


def test_an_answer_of_the_provider_is_good_for_the_browser_that_asked_and_once(provided: Service) -> None:
    by_link(provided, None).post("/api/v1/accounts/invitations", email="olga@example.org", duty=None)
    mine, victim = Browser(provided), Browser(provided)
    back = vouched(mine, "olga-1")
    assert victim.get(back).headers["Location"] == "/?unsure"  # signed in as somebody else by a link of theirs
    forged = Browser(provided, cookies={"stillroom_oidc": "e30=.0000"})
    assert forged.get(back).headers["Location"] == "/?unsure"
    assert mine.get(back).headers["Location"] == "/"
    assert mine.is_in()
    assert Browser(provided, cookies=dict(mine.cookies)).get(back).headers["Location"] == "/?unsure"
    assert not victim.is_in()
    assert mine.get("/login/oidc/callback?error=access_denied&state=x").headers["Location"] == "/?unsure"


def test_the_provider_is_asked_with_a_challenge_and_a_nonce(provided: Service) -> None:
    asked = urlsplit(Browser(provided).get("/login/oidc").headers["Location"]).query
    assert "code_challenge_method=S256" in asked
    assert "nonce=" in asked
    assert "state=" in asked


def test_without_a_provider_there_is_no_way_by_one(service: Service) -> None:
    assert service.http.get("/login/oidc", follow_redirects=False).status_code == 404
    assert service.http.get("/login/oidc/callback", follow_redirects=False).status_code == 404
