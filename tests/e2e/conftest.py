"""The real service as a process, a real browser, and robots that upload to it. Screenshots are left in test-results/."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, StorageState, expect, sync_playwright

from stillroom.app import STATIC
from tests.e2e import calling
from tests.e2e.looking import PATIENCE_MS
from tests.homes import ORIGIN, RESOLUTION, Image, home, png
from tests.ports import free_port

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "test-results"
ADMIN_TOKEN = "operator-of-the-browser-tests"
START_S = 120
NO_FEATURES = [
    # a page of its own for suggestions under the address bar, in each window, although nobody sees one: a second of CPU for each test
    "WebUIOmniboxPopup",
    "WebUIOmniboxAimPopup",
    "WebUIOmniboxFullPopup",
    # what Playwright switches off: the last list on the command line counts
    "AvoidCorsURLLoaderRestartOnRedirect",
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose",
    "HttpsFirstBalancedModeAutoEnable",
    "HttpsUpgrades",
    "LensOverlay",
    "MediaRouter",
    "NetworkTimeServiceQuerying",
    "OptimizationHints",
    "PaintHolding",
    "PreconnectToSearch",
    "ThirdPartyStoragePartitioning",
]
BROWSER_OPTIONS = [
    f"--disable-features={','.join(NO_FEATURES)}",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]

expect.set_options(timeout=PATIENCE_MS)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Browser tests on two workers, every other file each: those of a worker share a service and a browser."""
    mine = [item for item in items if item.path.is_relative_to(Path(__file__).parent)]
    files = sorted({item.path for item in mine})
    for item in mine:
        item.add_marker(pytest.mark.xdist_group(f"browser {files.index(item.path) % 2}"))


@dataclass
class Running:
    """`stillroom serve` on a port of its own; can be stopped and started again."""

    data_dir: Path
    port: int
    process: "subprocess.Popen[str] | None" = None
    link: str = ""
    """Signs one browser in, once."""

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "stillroom", "serve", "--port", str(self.port), "--workers", "1"],
            env=os.environ
            | {"STILLROOM_DATA_DIR": str(self.data_dir), "STILLROOM_ADMIN_TOKEN": ADMIN_TOKEN, "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if "/login?" in line:
                self.link = line.split()[-1]
                break
        else:
            pytest.fail(f"stillroom serve ended with {self.process.wait()} and printed no sign-in link")
        self._wait_until_ready()

    def stop(self) -> None:
        if self.process is not None:
            self.process.terminate()
            self.process.communicate(timeout=START_S)
            self.process = None

    def login_link(self) -> str:
        command = [sys.executable, "-m", "stillroom", "login-link", "--url", self.url]
        environment = os.environ | {"STILLROOM_DATA_DIR": str(self.data_dir)}
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()[-1]

    def add_robot(self, robot_id: str, name: str) -> "Robot":
        answer = calling.post(
            f"{self.url}/api/v1/robots",
            headers={"Authorization": f"Bearer {ADMIN_TOKEN}"},
            json={"id": robot_id, "name": name, "owner": None},
        )
        assert answer.status_code == 201, answer.text
        return Robot(self, robot_id, answer.json()["token"])

    def _wait_until_ready(self) -> None:
        deadline = time.monotonic() + START_S
        while time.monotonic() < deadline:
            try:
                if httpx2.get(f"{self.url}/readyz").status_code == 200:
                    return
            except httpx2.TransportError:
                pass
            time.sleep(0.05)
        pytest.fail(f"the service was not ready within {START_S} s")


@dataclass
class Robot:
    service: Running
    id: str
    token: str

    @property
    def page(self) -> str:
        return f"/robots/{self.id}/maps/ground"

    @property
    def path(self) -> str:
        return f"{self.service.url}/api/v1{self.page}"

    def upload(self, mission: str, image: Image | None = None, **meta: Any) -> dict[str, Any]:
        sequence = int(mission) if mission.isdecimal() else 0
        document = {"sequence": sequence, "resolution": RESOLUTION, "origin": ORIGIN} | meta
        answer = calling.put(
            f"{self.path}/missions/{mission}",
            headers={"Authorization": f"Bearer {self.token}", "Prefer": "wait=30"},
            files={
                "meta": ("meta.json", json.dumps(document), "application/json"),
                "grid": ("grid.png", png(home() if image is None else image), "image/png"),
            },
        )
        assert answer.status_code in (200, 201), answer.text
        found: dict[str, Any] = answer.json()
        return found

    def edit(self, version: int, *operations: dict[str, Any]) -> None:
        """As its owner would."""
        answer = calling.post(
            f"{self.path}/edits",
            headers={"Authorization": f"Bearer {ADMIN_TOKEN}", "If-Match": f'"v{version}"'},
            json={"operations": list(operations)},
        )
        assert answer.status_code == 200, answer.text


def running(data_dir: Path) -> Running:
    if not (STATIC / "index.html").is_file():
        pytest.fail("the web app is not built: run `make setup`")
    return Running(data_dir, free_port())


# The browser's driver keeps an event loop of this thread running, which tests elsewhere would stumble over:
# so nothing here lives longer than this package's tests.


@pytest.fixture(scope="package")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    service = running(tmp_path_factory.mktemp("served"))
    service.start()
    yield service
    service.stop()


@pytest.fixture(scope="package")
def chromium() -> Iterator[Browser]:
    executable = shutil.which("chromium")
    if executable is None:
        pytest.fail("chromium is not installed: run `make browser`")
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=executable, args=BROWSER_OPTIONS)
        yield launched
        launched.close()


@pytest.fixture(scope="package")
def signed_in(served: Running, chromium: Browser) -> StorageState:
    """What a browser keeps after it opened the link that `stillroom serve` printed."""
    context = chromium.new_context()
    context.new_page().goto(served.link)
    state = context.storage_state()
    context.close()
    return state


OpenPage = Callable[..., Page]


@pytest.fixture
def open_page(served: Running, chromium: Browser, signed_in: StorageState) -> Iterator[OpenPage]:
    """Opens a page of the app; anything that the browser logs as an error fails the test."""
    contexts: list[BrowserContext] = []
    complaints: list[str] = []

    def listen(message: ConsoleMessage) -> None:
        # A 404 or 401 that a test asks for is logged, too; the page's own words about it are what tests look at.
        if message.type == "error" and "Failed to load resource" not in message.text:
            complaints.append(message.text)

    def opened(path: str, *, width: int = 1440, height: int = 900, **options: Any) -> Page:
        options = {"storage_state": signed_in, "base_url": served.url, "reduced_motion": "reduce"} | options
        context = chromium.new_context(viewport={"width": width, "height": height}, **options)
        context.set_default_timeout(PATIENCE_MS)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", listen)
        page.goto(path)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert complaints == []


_numbers = count(1)


@pytest.fixture
def robot(served: Running) -> Robot:
    """One of its own for every test, so that tests don't see each other's maps."""
    number = next(_numbers)
    return served.add_robot(f"RB-{number}", f"Robin {number}")


@pytest.fixture
def mapped(robot: Robot) -> Robot:
    """With a map of two rooms, Kitchen on the left and Bedroom on the right."""
    robot.upload("0")
    document = calling.get(robot.path, headers={"Authorization": f"Bearer {robot.token}"}).json()
    rooms = [feature for feature in document["features"] if feature["properties"]["semantic"] == "room"]
    left, right = sorted(rooms, key=lambda room: min(x for x, _ in room["geometry"]["coordinates"][0]))
    robot.edit(
        document["version"],
        {"op": "rename_room", "id": left["id"], "name": "Kitchen"},
        {"op": "rename_room", "id": right["id"], "name": "Bedroom"},
    )
    return robot


@pytest.fixture
def keep() -> Callable[[Page, str], None]:
    """Leaves a screenshot in test-results/."""

    def kept(page: Page, name: str) -> None:
        RESULTS.mkdir(exist_ok=True)
        page.screenshot(path=RESULTS / f"{name}.png", full_page=True)

    return kept
