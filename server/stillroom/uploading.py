"""`stillroom upload`: a robot's maps from files, as a robot would send them."""

import json
import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2

from stillroom.documents.files import MapFile, in_words, open_map
from stillroom.errors import InvalidInput

ATTEMPTS = 6
WAIT_S = 60


class UploadFailed(Exception):
    """In words for the one who called."""


@dataclass(frozen=True)
class Upload:
    url: str
    token: str
    robot: str
    map_name: str
    meta: dict[str, Any]
    """Fields of `meta` that were given; what they leave open comes from the file or the YAML file beside it."""


def upload_file(
    upload: Upload, file: Path, sequence: int, client: httpx2.Client, told: Callable[[str], None]
) -> dict[str, Any]:
    """The mission as the service answered. Raises UploadFailed."""
    sent, meta = read_mission(file, sequence, upload.meta)
    mission = _mission_id(sent.path)
    target = f"{upload.url}/api/v1/robots/{upload.robot}/maps/{upload.map_name}/missions/{mission}"
    request = client.build_request(
        "PUT",
        target,
        headers={"Authorization": f"Bearer {upload.token}", "Prefer": f"wait={WAIT_S}"},
        files={
            "meta": ("meta.json", json.dumps(meta), "application/json"),
            "grid": (sent.path.name, sent.content, sent.media_type),
        },
    )
    response = send(client, request, told)
    if response.status_code not in (200, 201, 202):
        raise UploadFailed(f"{file}: {explain(response)}")
    answer: dict[str, Any] = response.json()
    if not sent.is_image and answer["outcome"] not in (None, "created"):
        told("the map has rooms and restrictions of its own; those in the file were not taken")
    return answer


def read_mission(file: Path, sequence: int, given: dict[str, Any]) -> tuple[MapFile, dict[str, Any]]:
    """The grid, and its meta: what was given wins over the file. Raises UploadFailed."""
    try:
        opened = open_map(file)
    except InvalidInput as error:
        raise UploadFailed(f"{file}: {in_words(error)}") from None
    meta = {"sequence": sequence} | opened.meta | given
    missing = [name for name in ("resolution", "origin") if opened.is_image and name not in meta]
    if missing:
        raise UploadFailed(f"{file}: give --{' and --'.join(missing)}, or put a map_server YAML file beside it")
    return opened, meta


def _mission_id(image: Path) -> str:
    """The file's name as a mission's id, so that the same file again is the same mission."""
    allowed = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in image.stem)
    return allowed[:64]


def send(client: httpx2.Client, request: httpx2.Request, told: Callable[[str], None]) -> httpx2.Response:
    """Again, after a growing pause, where the service does not answer or says that it is busy. Raises UploadFailed."""
    for attempt in range(1, ATTEMPTS + 1):
        try:
            response = client.send(request)
        except httpx2.TransportError as error:
            problem, pause = str(error) or type(error).__name__, _pause(attempt)
        else:
            if response.status_code not in (429, 503):
                return response
            problem, pause = explain(response), _retry_after(response) or _pause(attempt)
        if attempt < ATTEMPTS:
            told(f"{problem}; trying again in {pause:.0f} s")
            time.sleep(pause)
    raise UploadFailed(f"{problem}; gave up after {ATTEMPTS} attempts")


def _pause(attempt: int) -> float:
    return min(2.0**attempt, 30.0) * random.uniform(0.5, 1.0)


def _retry_after(response: httpx2.Response) -> float | None:
    said = response.headers.get("Retry-After", "")
    return min(float(said), 60.0) if said.isdecimal() else None


def explain(response: httpx2.Response) -> str:
    """What a refusal says."""
    try:
        problem = response.json()
        faults = "".join(f"\n  {fault['pointer']}: {fault['detail']}" for fault in problem.get("errors", []))
        return f"{problem['title']}: {problem['detail']}{faults}"
    except (ValueError, KeyError, TypeError, AttributeError):
        return f"the service answered {response.status_code}"
