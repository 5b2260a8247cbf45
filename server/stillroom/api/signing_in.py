"""How people get in and out."""

import re
from typing import Annotated
from urllib.parse import unquote

from fastapi import APIRouter, Depends, Header, Query, Request
from starlette.background import BackgroundTask
from starlette.responses import RedirectResponse, Response

from stillroom.api.context import (
    DEVICE_COOKIE,
    SESSION_COOKIE,
    Caller,
    Service,
    browser_of,
    document,
    is_from_elsewhere,
    same_origin,
)
from stillroom.api.plain_page import plain_page
from stillroom.documents import api
from stillroom.documents.people import (
    LinkDocument,
    LinkToken,
    LinkUse,
    LinkUsed,
    PasswordSignIn,
    ResetRequest,
    Ways,
)
from stillroom.errors import Unauthenticated
from stillroom.service import access, accounts
from stillroom.service.messages.words import preferred
from stillroom.service.people import links, sessions, signing_in
from stillroom.service.people.links import Post
from stillroom.service.people.sessions import SignedIn

router = APIRouter()
NEXT_COOKIE = "stillroom_next"
"""The app's page, percent-encoded, that somebody who was signed out wanted to see."""
_OWN_PAGE = re.compile(r"/(?!/)[!-\[\]-~]{0,1000}", re.ASCII)
_A_YEAR_S = 365 * 24 * 3600
_FROM_HERE = [Depends(same_origin)]
"""Nobody is signed in by a form of another site, as somebody else."""
LinkSecret = Annotated[str, Query(alias="token", max_length=200)]
Languages = Annotated[str, Header(alias="Accept-Language")]


@router.get("/api/v1/session", response_model=api.Caller)
def show_caller(who: Caller) -> Response:
    return document(access.who(who))


@router.get("/api/v1/sign-in", response_model=Ways)
def show_ways(service: Service) -> Response:
    """How people can get in, for whoever is not."""
    provider = None if service.provider is None else service.provider.name
    return document(Ways(password=True, provider=provider, mail=service.messaging.mail is not None))


@router.post("/api/v1/session", response_model=LinkUsed, dependencies=_FROM_HERE)
def sign_in_by_password(request: Request, service: Service, given: PasswordSignIn) -> Response:
    made = signing_in.by_password(service.database, given.email, given.password, browser_of(request))
    return _signed_in(made, request, service)


@router.post("/api/v1/password-resets", status_code=202, dependencies=_FROM_HERE)
def ask_reset(request: Request, service: Service, asked: ResetRequest, languages: Languages = "") -> Response:
    """A link to the address, if there is an account; the answer does not tell whether there is."""
    links.ask_reset(service.database, browser_of(request), service.messaging)
    post = Post(service.messaging, preferred(languages))
    return Response(status_code=202, background=BackgroundTask(links.send_reset, service.database, asked.email, post))


@router.post("/api/v1/links/look", response_model=LinkDocument, dependencies=_FROM_HERE)
def look_at_link(request: Request, service: Service, given: LinkToken) -> Response:
    """What a link of an e-mail is for. Its secret stands behind the # of its address, which browsers send to nobody."""
    return document(links.look(service.database, given.token, browser_of(request)))


@router.post("/api/v1/links/use", response_model=LinkUsed, dependencies=_FROM_HERE)
def use_link(request: Request, service: Service, given: LinkUse) -> Response:
    """Once: accepts an invitation, or sets a new password; then somebody is signed in, unless they had an account."""
    made = links.use(service.database, given.token, given.password, browser_of(request))
    return document(LinkUsed(signed_in=False)) if made is None else _signed_in(made, request, service)


def _signed_in(made: SignedIn, request: Request, service: Service) -> Response:
    response = document(LinkUsed(signed_in=True), headers={"Cache-Control": "no-store"})
    set_cookies(response, made, request, service.messaging.public_url)
    return response


@router.delete("/api/v1/session", status_code=204)
def sign_out(request: Request, service: Service, _who: Caller) -> Response:
    cookie = request.cookies.get(SESSION_COOKIE)
    if cookie is not None:
        accounts.sign_out(service.database, cookie)
    response = Response(status_code=204)
    response.delete_cookie(SESSION_COOKIE)
    return response


@router.get("/login", include_in_schema=False)
def open_link(request: Request, service: Service, token: LinkSecret, languages: Languages = "") -> Response:
    """A one-time link's target. Where another site leads here, it asks first: a link could sign somebody in as somebody else."""
    email = accounts.of_link(service.database, token) if is_from_elsewhere(request) else None
    if email is None:
        return sign_in(request, service, token)
    words = preferred(languages)
    return plain_page(words, words.ask_to_sign_in, token=token, address=email)


@router.post("/login", include_in_schema=False, dependencies=_FROM_HERE)
def sign_in(request: Request, service: Service, token: LinkSecret) -> Response:
    """On to the page that was wanted."""
    response = RedirectResponse(page_wanted(request), 303, {"Referrer-Policy": "no-referrer"})
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


def page_wanted(request: Request) -> str:
    """Where to go after signing in: a path of this service, whatever the cookie says: never another site's address (`//other`, `/\\other`)."""
    wanted = unquote(request.cookies.get(NEXT_COOKIE, ""))
    return wanted if _OWN_PAGE.fullmatch(wanted) else "/"
