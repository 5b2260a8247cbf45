"""The HTTP contract as a robot and a person use it: uploads, maps, edits. Tries again where the service is busy."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import httpx2

from stillroom.uploading import UploadFailed, send

Json = dict[str, Any]
WAIT_S = 30
_EDIT_ATTEMPTS = 5


class Refused(Exception):
    """The service won't take a request, in words; `status` is its answer's."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(f"{status}: {text}")
        self.status = status


@dataclass(frozen=True)
class Client:
    """One caller of the API. Raises UploadFailed where the service can't be reached, Refused where it says no."""

    http: httpx2.Client
    token: str
    told: Callable[[str], None]

    def add_robot(self, robot: str, name: str) -> str | None:
        """The new robot's token; None where there is one of this id already."""
        answer = self._send("POST", "/api/v1/robots", json={"id": robot, "name": name, "owner": None})
        if answer.status_code == 409:
            return None
        token: str = _document(answer)["token"]
        return token

    def map_in_force(self, path: str) -> Json | None:
        answer = self._send("GET", path)
        return None if answer.status_code == 404 else _document(answer)

    def upload(self, path: str, mission: str, grid_png: bytes, meta: Json) -> Json:
        """The mission as the service answers, done if that takes no longer than `WAIT_S`."""
        files = {
            "meta": ("meta.json", json.dumps(meta), "application/json"),
            "grid": ("grid.png", grid_png, "image/png"),
        }
        target = f"{path}/missions/{mission}"
        return _document(self._send("PUT", target, files=files, headers={"Prefer": f"wait={WAIT_S}"}))

    def edit(self, path: str, operations_for: Callable[[Json], Sequence[Json]]) -> Json | None:
        """The map after one batch of edits, worked out anew where it changed meanwhile; None where there was nothing to do."""
        for _ in range(_EDIT_ATTEMPTS):
            found = self._send("GET", path)
            document = _document(found)
            operations = list(operations_for(document))
            if not operations:
                return None
            headers = {"If-Match": found.headers["ETag"]}
            answer = self._send("POST", f"{path}/edits", json={"operations": operations}, headers=headers)
            if answer.status_code != 412:
                return _document(answer)
        return None

    def _send(
        self, method: str, path: str, headers: Mapping[str, str] | None = None, **content: Any
    ) -> httpx2.Response:
        signed = {"Authorization": f"Bearer {self.token}"} | dict(headers or {})
        return send(self.http, self.http.build_request(method, path, headers=signed, **content), self.told)


def _document(answer: httpx2.Response) -> Json:
    if not answer.is_success:
        raise Refused(answer.status_code, answer.text[:500])
    document: Json = answer.json()
    return document


__all__ = ["WAIT_S", "Client", "Json", "Refused", "UploadFailed"]
