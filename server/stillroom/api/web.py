"""The browser's app: files that were built into the package, and its start page for every path of its own."""

from pathlib import Path

from fastapi import APIRouter
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, HTMLResponse, Response

from stillroom.api.context import Service

router = APIRouter()
_NOT_BUILT = """<!doctype html><html lang="en"><meta charset="utf-8"><title>stillroom</title>
<h1>The service runs; its web app has not been built</h1>
<p>In a checkout, <code>make setup</code> builds it. The API is at <a href="/openapi.json">/openapi.json</a>.</p></html>
"""


@router.api_route("/{path:path}", methods=["GET", "HEAD"], include_in_schema=False)
def app_file(service: Service, path: str) -> Response:
    if path.startswith("api/"):
        raise HTTPException(404, "There is no such resource.")
    file = _inside(service.static, path)
    if file is not None:
        hashed = path.startswith("assets/")
        lasting = "public, max-age=31536000, immutable" if hashed else "no-cache"
        return FileResponse(file, headers={"Cache-Control": lasting})
    if path.startswith("assets/"):
        raise HTTPException(404, "There is no such file.")
    start = service.static / "index.html"
    if not start.is_file():
        return HTMLResponse(_NOT_BUILT, 503 if path else 200)
    return FileResponse(start, headers={"Cache-Control": "no-cache"})


def _inside(folder: Path, path: str) -> Path | None:
    """The file of that name, unless the name leads out of the folder."""
    if not path or "\x00" in path:
        return None
    file = (folder / path).resolve()
    return file if file.is_relative_to(folder.resolve()) and file.is_file() else None
