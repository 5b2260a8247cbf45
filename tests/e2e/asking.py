"""Missions that ask something, as a robot sends them, and what the service says about it."""

from typing import Any

import numpy as np

from tests.e2e import calling
from tests.e2e.conftest import ADMIN_TOKEN, Robot
from tests.homes import FREE, OCCUPIED, Image, home

Json = dict[str, Any]
OWNER = {"Authorization": f"Bearer {ADMIN_TOKEN}"}
OPEN_PLAN = home(wall_between=False)
"""The wall between Kitchen and Bedroom is gone."""


def shut() -> Image:
    """The doorway between Kitchen and Bedroom is closed."""
    image = home()
    image[50:68, 99:101] = OCCUPIED
    return image


def annex() -> Image:
    """A room more, behind the upper wall of the Kitchen."""
    image = home()
    image[100:102, 50:60] = image[102:116, 20:90] = FREE
    image[116:118, 18:92] = image[102:118, 18:20] = image[102:118, 90:92] = OCCUPIED
    return image


def read(robot: Robot, path: str = "") -> Any:
    answer = calling.get(f"{robot.path}{path}", headers=OWNER)
    assert answer.status_code == 200, answer.text
    return answer.json()


def settings(robot: Robot, **wanted: str) -> None:
    assert calling.patch(robot.path, headers=OWNER, json=wanted).status_code == 200


def send(robot: Robot, mission: str, image: Image | None = None) -> Json:
    """The robot tracked that nothing moved since the version in force."""
    still = {"base_version": read(robot)["version"], "tracking": {"transform": [0.0, 0.0, 0.0]}}
    return robot.upload(mission, home() if image is None else np.asarray(image), **still)


def questions(robot: Robot, state: str = "open") -> list[Json]:
    found: list[Json] = read(robot, f"/conflicts?state={state}")["items"]
    return found


def question(robot: Robot, state: str = "open") -> str:
    """Where the app shows the one that there is."""
    (found,) = questions(robot, state)
    return f"{robot.page}/conflicts/{found['id']}"


def causes(robot: Robot) -> list[str]:
    """Of all versions, the newest first."""
    return [version["cause"] for version in read(robot, "/versions")["items"]]


def rooms(robot: Robot) -> set[str]:
    return {f["properties"]["name"] for f in read(robot)["features"] if f["properties"]["semantic"] == "room"}
