"""The people of one's home."""

from typing import Annotated

from fastapi import APIRouter, Depends, Header, Path
from starlette.responses import Response

from stillroom.api.context import HumanCaller, Service, document, may
from stillroom.documents.people import Household, NewInvitation, RoleChange
from stillroom.service.messages.words import preferred
from stillroom.service.people import homes, links
from stillroom.service.people.links import Post

router = APIRouter(prefix="/api/v1/household", dependencies=[Depends(may("household"))])
MemberId = Annotated[str, Path(alias="member", pattern=r"^member_[A-Za-z0-9_-]{1,32}$")]
InvitationId = Annotated[str, Path(alias="invitation", pattern=r"^link_[A-Za-z0-9_-]{1,32}$")]
Languages = Annotated[str, Header(alias="Accept-Language")]


@router.get("", response_model=Household)
def show(service: Service, who: HumanCaller) -> Response:
    """Of one's own home, and the homes of others that one belongs to."""
    return document(homes.household(service.database, who))


@router.post("/invitations", status_code=201, response_model=Household)
def invite(service: Service, who: HumanCaller, new: NewInvitation, languages: Languages = "") -> Response:
    """By e-mail; a newer invitation takes the place of an older one to the same address."""
    post = Post(service.messaging, preferred(languages))
    links.invite_home(service.database, who, new.email, new.role, post)
    return document(homes.household(service.database, who), 201)


@router.delete("/invitations/{invitation}", status_code=204)
def withdraw(service: Service, who: HumanCaller, key: InvitationId) -> Response:
    homes.withdraw(service.database, who, key)
    return Response(status_code=204)


@router.patch("/people/{member}", response_model=Household)
def change(service: Service, who: HumanCaller, key: MemberId, wanted: RoleChange) -> Response:
    homes.change_role(service.database, who, key, wanted.role)
    return document(homes.household(service.database, who))


@router.delete("/people/{member}", status_code=204)
def part(service: Service, who: HumanCaller, key: MemberId) -> Response:
    """Somebody of one's own home; or oneself, of another's."""
    homes.part(service.database, who, key)
    return Response(status_code=204)
