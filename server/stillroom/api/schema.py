"""The OpenAPI document: what FastAPI finds in the routes, and the models that routes only refer to."""

from typing import Any

from fastapi import FastAPI
from pydantic.json_schema import models_json_schema

from stillroom.documents.api import Event, Problem, RefusedEdit, StaleEdit
from stillroom.documents.missions import MissionMeta


def install(app: FastAPI) -> None:
    of_routes = app.openapi

    def whole() -> dict[str, Any]:
        document = of_routes()
        document["components"]["schemas"] |= _REFERRED
        return document

    app.openapi = whole  # type: ignore[method-assign]  # FastAPI's own way of extending it


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
