"""Signing in with an identity provider: OpenID Connect's code flow with PKCE."""

import base64
import hmac
import json
from functools import lru_cache
from hashlib import sha256
from typing import Any

import structlog
from authlib.integrations.base_client import OAuthError
from authlib.integrations.starlette_client import OAuth
from fastapi import APIRouter, Request
from httpx2 import HTTPError
from joserfc.errors import JoseError
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from stillroom.api.context import Service, browser_of
from stillroom.api.signing_in import NEXT_COOKIE, page_wanted, set_cookies
from stillroom.errors import Forbidden, NotFound, Unavailable
from stillroom.service.people import sessions
from stillroom.service.people.provider import by_provider
from stillroom.settings import Provider

router = APIRouter(include_in_schema=False)
_STATE_COOKIE = "stillroom_oidc"
_STATE_S = 600
_PATH = "/login/oidc"
log = structlog.get_logger()


@router.get(_PATH)
async def start(request: Request, service: Service) -> Response:
    """On to the provider. What its answer has to match is kept in a signed cookie for ten minutes."""
    provider = _provider(service.provider)
    state: dict[str, Any] = {}
    request.scope["session"] = state
    key = await run_in_threadpool(sessions.device_key, service.database)
    try:
        answer: Response = await _client(provider).authorize_redirect(
            request, f"{service.messaging.public_url}{_PATH}/callback"
        )
    except (OAuthError, HTTPError, ValueError, KeyError) as error:
        raise Unavailable("The identity provider can't be reached.", 30) from error
    answer.set_cookie(
        _STATE_COOKIE,
        _signed(state, key),
        max_age=_STATE_S,
        path=_PATH,
        httponly=True,
        samesite="lax",
        secure=request.url.scheme == "https" or service.messaging.public_url.startswith("https:"),
    )
    answer.headers["Cache-Control"] = "no-store"
    return answer


@router.get(_PATH + "/callback")
async def finish(request: Request, service: Service) -> Response:
    provider = _provider(service.provider)
    key = await run_in_threadpool(sessions.device_key, service.database)
    request.scope["session"] = _read(request.cookies.get(_STATE_COOKIE, ""), key)
    try:
        token = await _client(provider).authorize_access_token(request)
        said = token["userinfo"]
        made = await run_in_threadpool(
            by_provider,
            service.database,
            str(said["iss"]),
            str(said["sub"]),
            said.get("email"),
            said.get("email_verified") is True,
            browser_of(request),
        )
    except Forbidden:
        response = RedirectResponse("/?uninvited", 303)
    except (OAuthError, JoseError, HTTPError, KeyError, ValueError) as error:
        log.warning("the identity provider's answer can't be used", error=type(error).__name__)
        response = RedirectResponse("/?unsure", 303)
    else:
        response = RedirectResponse(page_wanted(request), 303, {"Referrer-Policy": "no-referrer"})
        set_cookies(response, made, request, service.messaging.public_url)
        response.delete_cookie(NEXT_COOKIE, "/login")
    response.delete_cookie(_STATE_COOKIE, _PATH)
    return response


def _provider(provider: Provider | None) -> Provider:
    if provider is None:
        raise NotFound("This service knows no identity provider.")
    return provider


@lru_cache(maxsize=4)
def _client(provider: Provider) -> Any:
    """Knows the provider's endpoints and keys once it has asked for them."""
    return OAuth().register(
        "provider",
        client_id=provider.client_id,
        client_secret=provider.client_secret,
        server_metadata_url=f"{provider.issuer.rstrip('/')}/.well-known/openid-configuration",
        client_kwargs={"scope": "openid email", "code_challenge_method": "S256"},
    )


def _signed(state: dict[str, Any], key: bytes) -> str:
    said = base64.urlsafe_b64encode(json.dumps(state).encode()).decode()
    return f"{said}.{_mac(said, key)}"


def _read(cookie: str, key: bytes) -> dict[str, Any]:
    """Empty for what was not made here."""
    said, _, mac = cookie.partition(".")
    if not hmac.compare_digest(_mac(said, key).encode(), mac.encode()):
        return {}
    found: dict[str, Any] = json.loads(base64.urlsafe_b64decode(said))
    return found


def _mac(said: str, key: bytes) -> str:
    return hmac.new(key, f"oidc\n{said}".encode(), sha256).hexdigest()
