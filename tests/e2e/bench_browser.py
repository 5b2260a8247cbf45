"""How quick the pages are: the first paint of a home, and frames while a divider is drawn. Printed, not judged: `make bench-browser`."""

import shutil
import statistics
import sys
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Page, sync_playwright

from tests.e2e.conftest import BROWSER_OPTIONS, Robot, Running, running
from tests.homes import FREE, OCCUPIED, UNEXPLORED, Image

CELLS, DOOR, MARGIN = 2000, 18, 40
FRAMES = 180
PAINTED = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"
WATCH = """() => {
  window.frames_ms = []; let last = performance.now();
  const frame = (now) => { window.frames_ms.push(now - last); last = now; requestAnimationFrame(frame); };
  requestAnimationFrame(frame);
}"""


def blocks(columns: int, rows: int, cells: int) -> Image:
    """A home of columns x rows equal rooms with a doorway between neighbours, on a square grid."""
    image = np.full((cells, cells), UNEXPLORED, np.uint8)
    xs = np.linspace(MARGIN, cells - MARGIN, columns + 1).astype(int)
    ys = np.linspace(MARGIN, cells - MARGIN, rows + 1).astype(int)
    image[ys[0] - 2 : ys[-1] + 2, xs[0] - 2 : xs[-1] + 2] = FREE
    for x in xs:
        image[ys[0] - 2 : ys[-1] + 2, x - 2 : x + 2] = OCCUPIED
    for y in ys:
        image[y - 2 : y + 2, xs[0] - 2 : xs[-1] + 2] = OCCUPIED
    for x in xs[1:-1]:
        for a, b in pairwise(ys.tolist()):
            image[(a + b) // 2 - DOOR // 2 : (a + b) // 2 + DOOR // 2, x - 2 : x + 2] = FREE
    for y in ys[1:-1]:
        image[y - 2 : y + 2, (xs[0] + xs[1]) // 2 - DOOR // 2 : (xs[0] + xs[1]) // 2 + DOOR // 2] = FREE
    return image


def made(service: Running, name: str, image: Image) -> Robot:
    robot = service.add_robot(name, name)
    mission: dict[str, Any] = robot.upload("0", image, resolution=0.05, origin=[0.0, 0.0, 0.0])
    sys.stdout.write(f"{name}: {mission['reason']}\n")
    return robot


def first_paint(page: Page, robot: Robot) -> None:
    times = []
    for _ in range(5):
        page.goto(robot.page)
        page.get_by_role("tab", name="Rooms").wait_for()
        times.append(page.evaluate("performance.now()"))
    painted = page.evaluate(PAINTED)
    sys.stdout.write(
        f"{robot.id}: first paint {painted:.0f} ms, rooms listed after {statistics.median(times):.0f} ms\n"
    )


def drawing(page: Page, robot: Robot) -> None:
    page.goto(f"{robot.page}?edit")
    page.get_by_role("button", name="Divide").first.click()
    page.wait_for_timeout(2000)
    page.mouse.click(300, 250)
    page.evaluate(WATCH)
    for step in range(FRAMES):
        page.mouse.move(300 + step * 2.5, 260 + 200 * (step % 60) / 60)
    frames = sorted(page.evaluate("window.frames_ms")[5:])
    share = [frames[int(len(frames) * q)] for q in (0.5, 0.95)]
    sys.stdout.write(
        f"{robot.id}: a frame takes {share[0]:.1f} ms (p50), {share[1]:.1f} ms (p95) while drawing, of {len(frames)}\n"
    )


def main() -> None:
    executable = shutil.which("chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        service = running(Path(folder))
        service.start()
        browser = playwright.chromium.launch(executable_path=executable, args=BROWSER_OPTIONS)
        try:
            ten, forty = (
                made(service, "ten-rooms", blocks(5, 2, 300)),
                made(service, "forty-rooms", blocks(8, 5, CELLS)),
            )
            page = browser.new_context(base_url=service.url, viewport={"width": 1440, "height": 900}).new_page()
            page.goto(service.link)
            first_paint(page, ten)
            drawing(page, forty)
        finally:
            browser.close()
            service.stop()


if __name__ == "__main__":
    main()
