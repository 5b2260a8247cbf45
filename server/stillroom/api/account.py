"""One's own account. Only who is signed in may change it: no token may."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Request
from starlette.responses import Response

from stillroom.api.context import SESSION_COOKIE, HumanCaller, Service, browser_of, document, may
from stillroom.api.signing_in import set_cookies
from stillroom.documents.api import Page
from stillroom.documents.people import (
    CreatedToken,
    NewToken,
    OneTimeLink,
    OwnAccount,
    PasswordChange,
    SessionDocument,
    TokenDocument,
)
from stillroom.service.people import links, own_account

router = APIRouter(prefix="/api/v1/account", dependencies=[Depends(may("account"))])
SessionId = Annotated[str, Path(alias="session", pattern=r"^session_[A-Za-z0-9_-]{1,32}$")]
TokenId = Annotated[str, Path(alias="token", pattern=r"^token_[A-Za-z0-9_-]{1,32}$")]
_NO_STORE = {"Cache-Control": "no-store"}


@router.get("", response_model=OwnAccount)
def show(service: Service, who: HumanCaller) -> Response:
    return document(own_account.account(service.database, who))


@router.put("/password", status_code=204)
def set_password(request: Request, service: Service, who: HumanCaller, given: PasswordChange) -> Response:
    """Signs all other browsers out."""
    made = own_account.set_password(service.database, who, given.current, given.new, browser_of(request))
    response = Response(status_code=204)
    set_cookies(response, made, request, service.messaging.public_url)
    return response


@router.post("/login-links", status_code=201, response_model=OneTimeLink)
def add_link(service: Service, who: HumanCaller) -> Response:
    """Signs one other browser in, once, within ten minutes."""
    return document(links.for_another_browser(service.database, who, service.messaging), 201, _NO_STORE)


@router.get("/sessions", response_model=Page[SessionDocument])
def list_sessions(request: Request, service: Service, who: HumanCaller) -> Response:
    """Browsers that are signed in, the newest first."""
    found = own_account.list_sessions(service.database, who, request.cookies.get(SESSION_COOKIE))
    return document(Page[SessionDocument](items=found, next=None))


@router.delete("/sessions", status_code=204)
def end_others(request: Request, service: Service, who: HumanCaller) -> Response:
    """All but this one."""
    own_account.end_others(service.database, who, request.cookies.get(SESSION_COOKIE))
    return Response(status_code=204)


@router.delete("/sessions/{session}", status_code=204)
def end_session(service: Service, who: HumanCaller, key: SessionId) -> Response:
    own_account.end_session(service.database, who, key)
    return Response(status_code=204)


@router.get("/tokens", response_model=Page[TokenDocument])
def list_tokens(service: Service, who: HumanCaller) -> Response:
    """For one's programs, the newest first."""
    return document(Page[TokenDocument](items=own_account.list_tokens(service.database, who), next=None))


@router.post("/tokens", status_code=201, response_model=CreatedToken)
def add_token(service: Service, who: HumanCaller, new: NewToken) -> Response:
    """May do what its scopes say, as long as its person may; shown this once."""
    return document(own_account.add_token(service.database, who, new), 201, _NO_STORE)


@router.delete("/tokens/{token}", status_code=204)
def end_token(service: Service, who: HumanCaller, key: TokenId) -> Response:
    own_account.end_token(service.database, who, key)
    return Response(status_code=204)
