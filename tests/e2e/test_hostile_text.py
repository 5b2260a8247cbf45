"""Whatever people and robots write, browsers show it as text: every text field of the API holds a script, and every page is opened."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Request, expect

from stillroom.app import create_app
from stillroom.settings import Settings
from tests.e2e import calling
from tests.e2e.conftest import ADMIN_TOKEN, Robot, Running, running
from tests.e2e.looking import GLANCE_MS, PATIENCE_MS
from tests.homes import home

Json = dict[str, Any]
HIT = "document.title='hit'"
TEXT = f'<img src=x onerror="{HIT}">'
TIGHT = f"<img/src=x/onerror={HIT}>"
"""Without spaces and quotes."""
EMAIL = "<svg/onload=document.title=1>@example.org"
URL = f"https://hooks.example.org/?q={TIGHT}"
OPERATOR = {"Authorization": f"Bearer {ADMIN_TOKEN}"}
BROWSER = {"Sec-Fetch-Site": "same-origin"}
STILL: Json = {"tracking": {"transform": [0.0, 0.0, 0.0]}, "firmware": TEXT, "model": TEXT}
SHOWN_NOWHERE = {
    "PUT /account/password /current",
    "PUT /account/password /new",
    "POST /fleet/replays /robots/-",
    "POST /claims /claim_code",
    "POST /links/use /password",
    "POST /session /password",
    "POST /robots/{robot}/maps/{map}/edits /operations/-/id",
    "POST /robots/{robot}/maps/{map}/edits /operations/-/ids/-",
}
"""Secrets, and names of what is there already, or of nothing."""
WATCH = """
    window.violations = [];
    addEventListener("securitypolicyviolation", (event) => violations.push(event.violatedDirective + " " + event.blockedURI));
"""


class Writer:
    """Fills fields, and remembers which."""

    def __init__(self, service: Running) -> None:
        self._url, self.filled = service.url + "/api/v1", set[str]()

    def write(self, method: str, path: str, body: Json, as_: dict[str, str] = OPERATOR, **names: Any) -> Any:
        sent = calling.request(method, self._url + path.format(**names), headers=as_, json=body)
        assert sent.is_success or sent.status_code == 503, (method, path, sent.text)  # 503: this service sends no mail
        self.filled |= {f"{method} {path} {at}" for at in places(body) if at}
        return sent.json() if sent.content else None


def places(value: Any, at: str = "") -> Iterator[str]:
    """Where a script was put."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from places(inner, f"{at}/{name}")
    elif isinstance(value, list):
        for inner in value:
            yield from places(inner, f"{at}/-")
    elif isinstance(value, str) and "<" in value:
        yield at


def fields_that_take_scripts(tmp_path: Path) -> set[str]:
    """Of all documents that the API takes, the text fields that would take one of the scripts."""
    spec = create_app(Settings(tmp_path, "sqlite://", str(tmp_path), None)).openapi()

    def walk(schema: Json, at: str, above: tuple[str, ...] = ()) -> Iterator[str]:
        name = str(schema.get("$ref", "")).rpartition("/")[2]
        if name:
            if name not in above:
                yield from walk(spec["components"]["schemas"][name], at, (*above, name))
            return
        for kind in ("anyOf", "oneOf", "allOf"):
            for one in schema.get(kind, []):
                yield from walk(one, at, above)
        if schema.get("type") == "string" and not {"enum", "const", "format"} & schema.keys():
            longest = schema.get("maxLength", 10_000)
            if any(len(s) <= longest and re.search(schema.get("pattern", ""), s) for s in (TEXT, TIGHT, EMAIL, URL)):
                yield at
        for inner, of in schema.get("properties", {}).items():
            yield from walk(of, f"{at}/{inner}", above)
        if "items" in schema:
            yield from walk(schema["items"], at + "/-", above)

    return {
        f"{method.upper()} {path.removeprefix('/api/v1')} {at}"
        for path, operations in spec["paths"].items()
        for method, operation in operations.items()
        for content in operation.get("requestBody", {}).get("content", {}).values()
        for at in walk(content["schema"], "")
    }


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[Running]:
    service = running(tmp_path / "data")
    service.start()
    yield service
    service.stop()


def test_no_script_that_anybody_writes_anywhere_ever_runs(alone: Running, chromium: Browser, tmp_path: Path) -> None:
    writer = Writer(alone)
    pages = fill(alone, writer)
    assert fields_that_take_scripts(tmp_path) - SHOWN_NOWHERE - writer.filled == set(), (
        "fields that this test does not know"
    )
    shown = 0
    for link, paths in pages:
        context = chromium.new_context(base_url=alone.url, reduced_motion="reduce")
        context.add_init_script(WATCH)
        page = context.new_page()
        pending = Pending(page)
        page.on("dialog", lambda dialog: pytest.fail(dialog.message))
        page.goto(link)
        for path in paths:
            shown += look(page, pending, path)
        context.close()
    assert shown > 12, "pages on which a script stands as text"


class Pending:
    """What a page has asked for and not got yet; but for events, which never end."""

    def __init__(self, page: Page) -> None:
        self._page, self._asked = page, set[Request]()
        page.on("request", lambda request: self._asked.add(request))
        page.on("requestfinished", lambda request: self._asked.discard(request))
        page.on("requestfailed", lambda request: self._asked.discard(request))

    def forget(self) -> None:
        """What the page before still waited for."""
        self._asked.clear()

    def wait(self) -> None:
        """Until there was nothing for a while: what comes in may make the page ask for more."""
        quiet = 0
        for _ in range(PATIENCE_MS // GLANCE_MS):
            self._page.wait_for_timeout(GLANCE_MS)
            quiet = 0 if any("/api/v1/events" not in request.url for request in self._asked) else quiet + 1
            if quiet == 3:
                return
        raise AssertionError(f"these are not answered: {[request.url for request in self._asked]}")


def look(page: Page, pending: Pending, path: str) -> bool:
    """Opens a page, and all that unfolds on it. Whether a script is to be read there."""
    pending.forget()
    page.goto(path)
    expect(page.get_by_role("main")).to_be_visible()
    pending.wait()
    for button in page.get_by_role("button", expanded=False).all():
        if button.is_visible() and button.is_enabled():
            button.click()
    pending.wait()
    assert page.title() not in ("hit", "1"), path
    assert page.evaluate("violations") == [], path
    assert page.locator("img[src=x], svg[onload]").count() == 0, path
    return "onerror=" in page.locator("body").inner_text() or "onload=" in page.locator("body").inner_text()


def link_of(service: Running, email: str) -> str:
    command = [sys.executable, "-m", "stillroom", "login-link", "--url", service.url, "--owner", email]
    return subprocess.run(command, env=environment(service), capture_output=True, text=True, check=True).stdout.split()[
        -1
    ]


def environment(service: Running) -> dict[str, str]:
    return os.environ | {"STILLROOM_DATA_DIR": str(service.data_dir)}


def fill(service: Running, writer: Writer) -> list[tuple[str, list[str]]]:
    """Sign-in links, and the pages that are opened with each."""
    own = writer.write("POST", "/robots", {"id": "RB-1", "name": TEXT, "owner": None})
    theirs = writer.write("POST", "/robots", {"id": "RB-2", "name": TEXT, "owner": EMAIL})
    for made in (own, theirs):
        robot = Robot(service, made["id"], made["token"])
        robot.upload("0", **STILL)
        robot.upload("1", home(wall_between=False), base_version=1, **STILL)
        writer.filled |= {
            f"PUT /robots/{{robot}}/maps/{{map}}/missions/{{mission}} /meta/{name}" for name in ("firmware", "model")
        }
    owner, owners = link_of(service, EMAIL), Person(link_of(service, EMAIL))
    paths = {"operator": write_maps(writer, OPERATOR, "RB-1"), "owner": write_maps(writer, owners.headers, "RB-2")}
    write_messages(writer)
    write_people(writer, owners.headers)
    more = write_fleet(writer)
    inspector = "/fleet/robots/RB-1/maps/ground/missions/1"
    fleet = ["/fleet", "/fleet/causes", "/fleet/rollouts", "/fleet/operations", inspector, *more]
    return [
        (service.login_link(), ["/", "/questions", "/settings", "/operator", *paths["operator"], *fleet]),
        (owner, ["/", "/questions", "/settings", "/account", "/home", *paths["owner"]]),
    ]


class Person:
    """Who opened a sign-in link."""

    def __init__(self, link: str) -> None:
        answer = calling.get(link, follow_redirects=False)
        cookie = answer.headers["Set-Cookie"].partition(";")[0]
        self.headers = BROWSER | {"Cookie": cookie}


def write_maps(writer: Writer, as_: dict[str, str], robot: str) -> list[str]:
    """Pages of a robot's map."""
    names, map_ = {"robot": robot, "map": "ground"}, "/robots/{robot}/maps/{map}"
    found = calling.get(f"{writer._url}{map_.format(**names)}", headers=as_).json()
    room = next(one["id"] for one in found["features"] if one["properties"]["semantic"] == "room")
    rename = {"operations": [{"op": "rename_room", "id": room, "name": TEXT}]}
    writer.write("POST", map_ + "/edits", rename, as_ | {"If-Match": f'"v{found["version"]}"'}, **names)
    writer.write("PATCH", map_, {"name": TEXT}, as_, **names)
    writer.write("PATCH", map_ + "/versions/{version}", {"name": TEXT}, as_, version=1, **names)
    writer.write("PATCH", "/robots/{robot}", {"name": TEXT}, as_, **names)
    conflicts = calling.get(f"{writer._url}{map_.format(**names)}/conflicts", headers=as_).json()["items"]
    answers: Json = {"response": "temporary", "note": TEXT}
    if robot == "RB-1":
        writer.write(
            "POST", map_ + "/conflicts/{conflict}/decision", answers, as_, conflict=conflicts[0]["id"], **names
        )
    else:
        writer.write("POST", map_ + "/conflicts/decision", answers, as_, **names)
    page = f"/robots/{robot}/maps/ground"
    return [page, f"{page}?version=1", *(f"{page}/conflicts/{one['id']}" for one in conflicts)]


def write_messages(writer: Writer) -> None:
    hook = writer.write("POST", "/webhooks", {"url": URL, "label": TEXT})["id"]
    writer.write("PATCH", "/webhooks/{webhook}", {"url": URL, "label": TEXT}, webhook=hook)
    writer.write("POST", "/webhooks/{webhook}/test", {}, webhook=hook)
    keys = {
        "p256dh": "BCVxsr7N_eNgVRqvHtD0zTZsEc6-VV-JvLexhqUzORcxaOzi6-AYWXvTBHm4bjyPjs7Vd8pZGH6SRpkNtoIAiw4",
        "auth": "BTBZMqHH6r4Tts7J_aSIgg",
    }
    push = {"endpoint": f"https://push.example.org/{TIGHT}", "keys": keys, "label": TEXT}
    writer.write("POST", "/notifications/push/subscriptions", push)


def write_people(writer: Writer, owner: dict[str, str]) -> None:
    writer.write("POST", "/account/tokens", {"name": TEXT, "scopes": ["maps:read"]}, owner)
    writer.write("POST", "/household/invitations", {"email": EMAIL.replace("svg", "img"), "role": "viewer"}, owner)
    writer.write("POST", "/accounts/invitations", {"email": EMAIL.replace("svg", "img")})
    writer.write("POST", "/password-resets", {"email": EMAIL}, BROWSER)
    writer.filled.add("POST /session /email")


def write_fleet(writer: Writer) -> list[str]:
    """More pages."""
    writer.write("POST", "/fleet/grants", {"robot": "RB-2", "reason": TEXT, "hours": 1})
    rule = {
        "name": "doors",
        "measure": "transfer",
        "above": 0.5,
        "below": 0.4,
        "firmware": [TEXT],
        "model": [TEXT],
        "algorithm": [TEXT],
    }
    writer.write("POST", "/fleet/alerts", rule)
    gate = {"measure": "transfer", "margin": 0.01}
    rollout = {"name": "bare", "resolvers": [], "gates": [gate]}
    writer.write("POST", "/fleet/rollouts", rollout)
    writer.write("POST", "/fleet/rollouts/{rollout}/end", {"reason": TEXT}, rollout="bare")
    causes = calling.get(f"{writer._url}/fleet/causes", headers=OPERATOR).json()["items"]
    for cause in causes[:1]:
        writer.write("PUT", "/fleet/causes/{cause}/mute", {"note": TEXT}, cause=cause["id"])
    return ["/fleet/rollouts/bare", *(f"/fleet/causes/{cause['id']}" for cause in causes)]
