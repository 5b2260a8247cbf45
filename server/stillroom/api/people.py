"""Accounts, for operators."""

from typing import Annotated

from fastapi import APIRouter, Depends, Header, Path, Query, Request
from starlette.responses import Response

from stillroom.api.context import HumanCaller, Limit, Service, document, may, page
from stillroom.documents.api import Page
from stillroom.documents.people import AccountChange, AccountDocument, InvitationDocument, NewAccount, OneTimeLink
from stillroom.service.messages.words import preferred
from stillroom.service.people import directory, links
from stillroom.service.people.links import Post

router = APIRouter(prefix="/api/v1/accounts", dependencies=[Depends(may("accounts"))])
AccountId = Annotated[str, Path(alias="account", pattern=r"^account_[A-Za-z0-9_-]{1,32}$")]
InvitationId = Annotated[str, Path(alias="invitation", pattern=r"^link_[A-Za-z0-9_-]{1,32}$")]
Languages = Annotated[str, Header(alias="Accept-Language")]
_NO_STORE = {"Cache-Control": "no-store"}


@router.get("", response_model=Page[AccountDocument])
def list_accounts(
    request: Request, service: Service, cursor: Annotated[str, Query(max_length=320)] = "", limit: Limit = 100
) -> Response:
    return page(request, directory.list_accounts(service.database, cursor, limit))


@router.get("/invitations", response_model=Page[InvitationDocument])
def list_invitations(service: Service) -> Response:
    """That nobody has accepted yet; not those to homes."""
    return document(Page[InvitationDocument](items=directory.list_invitations(service.database), next=None))


@router.post("/invitations", status_code=201, response_model=OneTimeLink)
def invite(service: Service, who: HumanCaller, new: NewAccount, languages: Languages = "") -> Response:
    """The link goes by e-mail; where the service sends none, it is shown, this once."""
    post = Post(service.messaging, preferred(languages))
    return document(links.invite_account(service.database, who, new.email, new.duty, post), 201, _NO_STORE)


@router.delete("/invitations/{invitation}", status_code=204)
def withdraw(service: Service, key: InvitationId) -> Response:
    directory.withdraw(service.database, key)
    return Response(status_code=204)


@router.patch("/{account}", response_model=AccountDocument)
def change(service: Service, who: HumanCaller, key: AccountId, wanted: AccountChange) -> Response:
    """Its duty, and whether it works; who is switched off is signed out at once."""
    return document(directory.change(service.database, who, key, wanted))


@router.post("/{account}/password-reset", status_code=201, response_model=OneTimeLink)
def reset(service: Service, who: HumanCaller, key: AccountId, languages: Languages = "") -> Response:
    """For somebody who asked for help: the link goes to them by e-mail; where the service sends none, it is shown, this once."""
    post = Post(service.messaging, preferred(languages))
    return document(links.reset_of(service.database, who, key, post), 201, _NO_STORE)
