"""Calls of the API beside the browser, with the patience that a busy machine needs."""

from functools import partial
from typing import Any

import httpx2

PATIENCE_S = 60.0


def request(method: str, url: str, **rest: Any) -> httpx2.Response:
    return httpx2.request(method, url, timeout=PATIENCE_S, **rest)


get, post, put, patch = (partial(request, method) for method in ("GET", "POST", "PUT", "PATCH"))
