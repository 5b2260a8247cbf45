"""Every error as application/problem+json (RFC 9457)."""

from collections.abc import Iterator, Mapping
from html import escape
from http import HTTPStatus

import structlog
from fastapi import APIRouter, FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import HTMLResponse, Response
from starlette.routing import compile_path

from stillroom import errors
from stillroom.documents.api import FaultDocument, Problem
from stillroom.documents.missions import pointer
from stillroom.errors import Fault, StillroomError

STATUS_CODES: dict[type[StillroomError], int] = {
    errors.InvalidInput: 422,
    errors.TooLarge: 413,
    errors.UnsupportedFormat: 415,
    errors.NotFound: 404,
    errors.AlreadyExists: 409,
    errors.MissionConflict: 409,
    errors.AlreadyDecided: 409,
    errors.ProposalOutdated: 409,
    errors.NotParked: 409,
    errors.NotUnprocessed: 409,
    errors.NotRunning: 409,
    errors.GateNotPassed: 409,
    errors.ChangedSince: 409,
    errors.PreconditionRequired: 428,
    errors.StaleVersion: 412,
    errors.Unauthenticated: 401,
    errors.Forbidden: 403,
    errors.TooMany: 429,
    errors.Unavailable: 503,
}
MEDIA_TYPE = "application/problem+json"
log = structlog.get_logger()
router = APIRouter()


def install(app: FastAPI) -> None:
    app.add_exception_handler(StillroomError, _domain_error)
    app.add_exception_handler(RequestValidationError, _validation_error)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(Exception, _unexpected_error)


def problem_of(error: StillroomError) -> Response:
    headers = {}
    if isinstance(error, errors.Unauthenticated):
        headers["WWW-Authenticate"] = 'Bearer realm="stillroom"'
    if isinstance(error, errors.Unavailable):
        headers["Retry-After"] = str(error.retry_after_s)
    return _problem(
        status=next(STATUS_CODES[kind] for kind in type(error).__mro__ if kind in STATUS_CODES),
        slug=error.slug,
        title=error.title,
        detail=error.detail,
        faults=error.faults,
        retryable=error.retryable,
        headers=headers,
        extra=error.extra,
    )


def _problem(
    *,
    status: int,
    slug: str,
    title: str,
    detail: str,
    faults: tuple[Fault, ...] = (),
    retryable: bool = False,
    headers: Mapping[str, str] | None = None,
    extra: Mapping[str, object] | None = None,
) -> Response:
    body = Problem(
        type=f"/problems/{slug}",
        title=title,
        status=status,
        detail=detail,
        errors=[FaultDocument(pointer=fault.pointer, detail=fault.detail) for fault in faults],
        retryable=retryable,
        **(extra or {}),
    )
    return Response(body.model_dump_json(), status, headers, MEDIA_TYPE)


async def _domain_error(_request: Request, error: Exception) -> Response:
    assert isinstance(error, StillroomError)
    if isinstance(error, errors.Unavailable):
        log.warning("the service could not answer", detail=error.detail, cause=repr(error.__cause__))
    return problem_of(error)


async def _validation_error(_request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    faults = tuple(Fault(_location(entry["loc"], error.body), str(entry["msg"])) for entry in error.errors())
    return problem_of(errors.InvalidInput("The request can't be used.", faults))


def _location(location: tuple[int | str, ...], body: object) -> str:
    """A pointer into the body; for what is elsewhere, the parameter's name.

    pydantic also names the alternative that it tried, which is no part of the input.
    """
    *path, last = location[1:] or ("",)
    if location[0] != "body" or location == ("body",):
        return pointer(location[1:])
    real: list[int | str] = []
    for part in path:
        if (isinstance(body, dict) and part in body) or (isinstance(body, list) and isinstance(part, int)):
            body = body[part]  # type: ignore[index]
            real.append(part)
    return pointer((*real, last))


async def _http_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if error.status_code == 413:
        return problem_of(errors.TooLarge(str(error.detail)))
    if error.status_code == 400:  # bytes that are no UTF-8, or nesting without end
        return problem_of(errors.InvalidInput("The body can't be read.", (Fault("", "no JSON that can be read"),)))
    if error.status_code == 405:
        error = _wrong_method(request)
    phrase = HTTPStatus(error.status_code).phrase
    return _problem(
        status=error.status_code,
        slug=phrase.lower().replace(" ", "-"),
        title=phrase,
        detail=str(error.detail),
        retryable=error.status_code in (408, 429, 503),
        headers=error.headers,
    )


def _wrong_method(request: Request) -> HTTPException:
    """405 with the methods of all routes of this path (the router knows but the first), or 404 where there are none."""
    paths: dict[str, dict[str, object]] = request.app.openapi()["paths"]
    methods = {
        method.upper()
        for template, operations in paths.items()
        if compile_path(template)[0].match(request.url.path)
        for method in operations
    }
    if not methods:
        return HTTPException(404, "There is no such resource.")
    allow = ", ".join(sorted(methods))
    return HTTPException(405, f"This resource knows {allow}.", {"Allow": allow})


async def _unexpected_error(request: Request, error: Exception) -> Response:
    log.error("a request failed", path=request.url.path, exc_info=error)
    return _problem(
        status=500, slug="internal", title="An error of the service", detail="It was logged.", retryable=True
    )


def _kinds(of: type[StillroomError] = StillroomError) -> Iterator[type[StillroomError]]:
    for kind in of.__subclasses__():
        yield kind
        yield from _kinds(kind)


@router.get("/problems/{slug}", include_in_schema=False)
def explain(slug: str) -> HTMLResponse:
    """A page for the one who follows a problem's `type`."""
    kind = next((kind for kind in _kinds() if kind.slug == slug), None)
    if kind is None:
        raise HTTPException(404, "There is no such kind of problem.")
    text = " ".join((kind.__doc__ or "").split())
    again = "Sending the same again later may succeed." if kind.retryable else "Sending the same again gives the same."
    return HTMLResponse(
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(kind.title)}</title>"
        f"<h1>{escape(kind.title)}</h1><p><code>{escape(slug)}</code></p><p>{escape(text)}</p><p>{again}</p></html>"
    )
