"""Robots and who calls."""

import re
from typing import Annotated
from urllib.parse import unquote

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import RedirectResponse, Response

from stillroom.api.context import SESSION_COOKIE, Caller, Limit, Service, document, operator_only, page
from stillroom.documents import api
from stillroom.errors import Unauthenticated
from stillroom.service import accounts, maps

router = APIRouter()
NEXT_COOKIE = "stillroom_next"
"""The app's page, percent-encoded, that somebody who was signed out wanted to see."""
_OWN_PAGE = re.compile(r"/(?!/)[!-\[\]-~]{0,1000}", re.ASCII)


@router.post("/api/v1/robots", status_code=201, response_model=api.CreatedRobot, dependencies=[Depends(operator_only)])
def add_robot(service: Service, new: api.NewRobot) -> Response:
    return document(accounts.add_robot(service.database, new), 201, {"Location": "/api/v1/robots"})


@router.get("/api/v1/robots", response_model=api.Page[api.RobotSummary])
def list_robots(
    request: Request,
    service: Service,
    who: Caller,
    cursor: Annotated[str, Query(max_length=64)] = "",
    limit: Limit = 100,
) -> Response:
    return page(request, maps.list_robots(service.database, who, cursor, limit))


@router.get("/api/v1/session", response_model=api.Caller)
def show_caller(who: Caller) -> Response:
    return document(accounts.who(who))


@router.delete("/api/v1/session", status_code=204)
def sign_out(request: Request, service: Service, _who: Caller) -> Response:
    cookie = request.cookies.get(SESSION_COOKIE)
    if cookie is not None:
        accounts.sign_out(service.database, cookie)
    response = Response(status_code=204)
    response.delete_cookie(SESSION_COOKIE)
    return response


@router.get("/login", include_in_schema=False)
def sign_in(request: Request, service: Service, token: Annotated[str, Query(max_length=200)]) -> Response:
    """A one-time link's target: on to the page that was wanted."""
    response = RedirectResponse(_page_wanted(request), 303, {"Referrer-Policy": "no-referrer"})
    if NEXT_COOKIE in request.cookies:
        response.delete_cookie(NEXT_COOKIE, "/login")
    try:
        cookie = accounts.sign_in(service.database, token)
    except Unauthenticated:
        if "text/html" in request.headers.get("Accept", ""):
            return response  # the app greets those who are signed in already, and tells others how to get a link
        raise
    response.set_cookie(
        SESSION_COOKIE,
        cookie,
        max_age=int(accounts.SESSION_LIFE.total_seconds()),
        httponly=True,
        samesite="lax",
        secure=request.url.scheme == "https",
    )
    return response


def _page_wanted(request: Request) -> str:
    """A path of this service, whatever the cookie says: never another site's address (`//other`, `/\\other`)."""
    wanted = unquote(request.cookies.get(NEXT_COOKIE, ""))
    return wanted if _OWN_PAGE.fullmatch(wanted) else "/"
