"""The OpenAPI document: what FastAPI finds in the routes, the models that routes only refer to, and every status of an answer."""

from collections.abc import Iterator
from typing import Any

from fastapi import FastAPI
from pydantic.json_schema import models_json_schema

from stillroom.api.problems import MEDIA_TYPE
from stillroom.documents.api import Event, Problem, RefusedEdit, StaleEdit
from stillroom.documents.missions import MissionMeta

_TO_CALLERS = (401, 403, 404, 422, 429, 503)
"""What any route of the API may answer, beside what it is for."""
_TO_SENDERS = (408, 413)
_TO_ALL = {"/healthz": (), "/readyz": (503,), "/metrics": (503,)}
"""Routes that ask nobody who they are."""
_MAP = "/api/v1/robots/{robot}/maps/{map}"
_BESIDE: dict[tuple[str, str], tuple[int, ...]] = {
    ("get", _MAP): (304,),
    ("get", _MAP + "/versions/{version}"): (304,),
    ("put", _MAP + "/missions/{mission}"): (409, 415),
    ("post", _MAP + "/missions/{mission}/placement"): (409,),
    ("post", _MAP + "/edits"): (412, 428),
    ("post", _MAP + "/versions/{version}/restore"): (409, 412),
    ("post", _MAP + "/versions/{version}/undo"): (409, 412),
    ("put", _MAP + "/pin"): (409, 412),
    ("post", _MAP + "/conflicts/{conflict}/decision"): (409, 412),
    ("post", _MAP + "/conflicts/decision"): (409, 412),
    ("post", "/api/v1/robots"): (409,),
    ("post", "/api/v1/robots/{robot}/claim-code"): (409,),
    ("post", "/api/v1/robots/{robot}/release"): (409,),
    ("post", "/api/v1/robots/{robot}/token"): (409,),
    ("delete", "/api/v1/robots/{robot}/token"): (409,),
    ("post", "/api/v1/household/invitations"): (409,),
    ("post", "/api/v1/accounts/invitations"): (409,),
    ("post", "/api/v1/fleet/alerts"): (409,),
    ("post", "/api/v1/robots/{robot}/archive"): (409, 415),
    ("post", "/api/v1/home/archive"): (409, 415),
    ("post", "/api/v1/fleet/grants"): (409,),
    ("post", "/api/v1/grants/{grant}/answer"): (409,),
    ("post", "/api/v1/fleet/robots/{robot}/maps/{map}/missions/{mission}/run"): (409,),
    ("post", "/api/v1/fleet/replays"): (409,),
    ("post", "/api/v1/fleet/rollouts"): (409,),
    ("post", "/api/v1/fleet/rollouts/{rollout}/advance"): (409,),
    ("post", "/api/v1/fleet/rollouts/{rollout}/end"): (409,),
    ("post", "/api/v1/fleet/rollouts/{rollout}/revert"): (409,),
}
"""What single routes may answer more."""
_WORDS = {
    304: "The caller has this version already",
    401: "No valid credential",
    403: "Not allowed for this caller",
    404: "There is no such thing",
    408: "The rest of the body did not come",
    409: "It is there already, or was decided otherwise",
    412: "The map has a newer version",
    413: "Larger than the limit",
    415: "A format that is not read here",
    422: "The input can't be used",
    428: "If-Match is required",
    429: "Asked too often; Retry-After says when to ask again",
    503: "Not available now; Retry-After says when to ask again",
}


def install(app: FastAPI) -> None:
    of_routes = app.openapi

    def whole() -> dict[str, Any]:
        document = of_routes()
        document["components"]["schemas"] |= _REFERRED
        for path, method, operation in _operations(document):
            for status in _statuses(path, method, operation):
                answers = operation["responses"]
                if str(status) not in answers or "HTTPValidationError" in str(answers[str(status)]):
                    answers[str(status)] = _answer(status)
            operation["responses"] = dict(sorted(operation["responses"].items()))
        for unused in ("HTTPValidationError", "ValidationError"):  # FastAPI's own shape of an error is answered nowhere
            document["components"]["schemas"].pop(unused, None)
        return document

    app.openapi = whole  # type: ignore[method-assign]  # FastAPI's own way of extending it


def _operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            yield path, method, operation


def _statuses(path: str, method: str, operation: dict[str, Any]) -> tuple[int, ...]:
    if path in _TO_ALL:
        return _TO_ALL[path]
    sent = _TO_SENDERS if "requestBody" in operation else ()
    return (*_TO_CALLERS, *sent, *_BESIDE.get((method, path), ()))


def _answer(status: int) -> dict[str, Any]:
    words = {"description": _WORDS[status]}
    problem = {"content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}}
    return words if status < 400 else words | problem


_, _definitions = models_json_schema(
    [
        (Problem, "serialization"),
        (StaleEdit, "serialization"),
        (RefusedEdit, "serialization"),
        (Event, "serialization"),
        (MissionMeta, "validation"),
    ],
    ref_template="#/components/schemas/{model}",
)
_REFERRED: dict[str, Any] = _definitions["$defs"]
