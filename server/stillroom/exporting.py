"""`stillroom export`: a version of a map as a file, asked of a service."""

import re
from collections.abc import Callable

import httpx2

from stillroom.uploading import UploadFailed, explain, send


def export_version(
    client: httpx2.Client, path: str, token: str, version: int | None, kind: str, told: Callable[[str], None]
) -> tuple[str, bytes]:
    """The name that the service gives the file, and its content; `path` is the map's URL. Raises UploadFailed."""

    def get(url: str, **query: str) -> httpx2.Response:
        request = client.build_request("GET", url, params=query, headers={"Authorization": f"Bearer {token}"})
        response = send(client, request, told)
        if response.status_code != 200:
            raise UploadFailed(explain(response))
        return response

    number = get(path).json()["version"] if version is None else version
    answer = get(f"{path}/versions/{number}/export", format=kind)
    named = re.search(r'filename="([A-Za-z0-9._-]+)"', answer.headers.get("Content-Disposition", ""))
    return (named[1] if named else f"map-{kind}"), answer.content
