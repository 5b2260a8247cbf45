"""How people get in and out."""

import re
from typing import Annotated
from urllib.parse import unquote

from fastapi import APIRouter, Query, Request
from starlette.responses import RedirectResponse, Response

from stillroom.api.context import DEVICE_COOKIE, SESSION_COOKIE, Caller, Service, browser_of, document
from stillroom.documents import api
from stillroom.errors import Unauthenticated
from stillroom.service import access, accounts
from stillroom.service.people import sessions
from stillroom.service.people.sessions import SignedIn

router = APIRouter()
NEXT_COOKIE = "stillroom_next"
"""The app's page, percent-encoded, that somebody who was signed out wanted to see."""
_OWN_PAGE = re.compile(r"/(?!/)[!-\[\]-~]{0,1000}", re.ASCII)
_A_YEAR_S = 365 * 24 * 3600


@router.get("/api/v1/session", response_model=api.Caller)
def show_caller(who: Caller) -> Response:
    return document(access.who(who))


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
        made = accounts.follow(service.database, token, browser_of(request))
    except Unauthenticated:
        if "text/html" in request.headers.get("Accept", ""):
            return response  # the app greets those who are signed in already, and tells others how to get a link
        raise
    set_cookies(response, made, request, service.messaging.public_url)
    return response


def set_cookies(response: Response, made: SignedIn, request: Request, public_url: str) -> None:
    """Out of reach of scripts, and of other sites' forms; over https alone where the service is reached by it."""
    secure = request.url.scheme == "https" or public_url.startswith("https:")
    life = int(sessions.LIFE.total_seconds())
    cookies = [(SESSION_COOKIE, made.session, life)]
    if made.device is not None:
        cookies.append((DEVICE_COOKIE, made.device, _A_YEAR_S))
    for name, value, seconds in cookies:
        response.set_cookie(name, value, max_age=seconds, httponly=True, samesite="lax", secure=secure)


def _page_wanted(request: Request) -> str:
    """A path of this service, whatever the cookie says: never another site's address (`//other`, `/\\other`)."""
    wanted = unquote(request.cookies.get(NEXT_COOKIE, ""))
    return wanted if _OWN_PAGE.fullmatch(wanted) else "/"
