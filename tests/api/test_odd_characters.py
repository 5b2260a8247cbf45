"""Characters that no database takes, or that no text may hold, in every text that the API takes: refused or taken, never an error of ours."""

import json
from collections.abc import Iterator
from typing import Any

from stillroom.store import people
from stillroom.store.clock import now
from tests.conftest import Service
from tests.fuzz.neighbourhood import settle

Json = dict[str, Any]
NUL, HALF = "a\0b", "a\ud800b"
"""Half of a pair of UTF-16 is no character."""
ODD = (NUL, HALF)


def calls(text: str, hook: str) -> Iterator[tuple[str, str, Json | None]]:
    """By an operator who has an account."""
    filters = ("from", "to", "firmware", "model", "algorithm")
    figures = ("causes", "failure-rates", "missions", "robots")
    yield from (("GET", f"/api/v1/fleet/{of}?{name}={{}}", None) for of in figures for name in filters)
    lists = ("robots", "registry", "accounts", "grants", "conflicts", "webhooks", "fleet/missions", "fleet/replays")
    yield from (("GET", f"/api/v1/{of}?cursor={{}}", None) for of in lists)
    path = "/api/v1/robots/free/maps/ground"
    yield "PATCH", path, {"name": text}
    yield "PATCH", f"{path}/versions/1", {"name": text}
    yield "PATCH", "/api/v1/robots/free", {"name": text}
    yield "POST", "/api/v1/robots", {"id": text, "name": text, "owner": f"{text}@example.org"}
    yield "POST", "/api/v1/robots", {"id": "RB-new", "name": text}
    yield "POST", f"{path}/edits", {"operations": [{"op": "rename_room", "id": "r1", "name": text}]}
    yield "POST", f"{path}/edits", {"operations": [{"op": "remove_divider", "id": text}]}
    yield "POST", f"{path}/conflicts/decision", {"response": "temporary", "note": text, "proposal": text}
    yield "POST", "/api/v1/session", {"email": f"{text}@example.org", "password": text}
    yield "POST", "/api/v1/password-resets", {"email": f"{text}@example.org"}
    yield "POST", "/api/v1/links/look", {"token": text}
    yield "POST", "/api/v1/links/use", {"token": text, "password": text}
    yield "PUT", "/api/v1/account/password", {"new": f"{text} and much more of it"}
    yield "POST", "/api/v1/account/tokens", {"name": text, "scopes": ["maps:read"]}
    yield "POST", "/api/v1/claims", {"claim_code": text * 4}
    yield "POST", "/api/v1/household/invitations", {"email": f"{text}@example.org", "role": "viewer"}
    yield "POST", "/api/v1/accounts/invitations", {"email": f"{text}@example.org"}
    yield "POST", "/api/v1/webhooks", {"url": f"https://hooks.example.org/{text}", "label": text}
    yield "PATCH", f"/api/v1/webhooks/{hook}", {"label": text}
    yield "PUT", "/api/v1/notifications/email", {"address": f"{text}@example.org"}
    yield "POST", "/api/v1/fleet/grants", {"robot": "anns", "reason": text, "hours": 1}
    yield "POST", "/api/v1/fleet/replays", {"name": "one", "robots": [text]}
    yield "PUT", "/api/v1/fleet/causes/c1/mute", {"note": text}
    rule = {"name": "doors", "measure": "transfer", "above": 0.5, "below": 0.4}
    yield from (("POST", "/api/v1/fleet/alerts", rule | {of: [text]}) for of in ("firmware", "model", "algorithm"))
    rollout = {"name": "bare", "resolvers": [], "gates": [{"measure": "transfer", "margin": 0.01}]}
    yield "POST", "/api/v1/fleet/rollouts", rollout | {"robots": [text]}
    yield "POST", "/api/v1/fleet/rollouts/bare/end", {"reason": text}


def test_no_character_is_too_odd(service: Service) -> None:
    neighbours = settle(service)
    with service.database.write() as tx:
        people.change(tx, "erik@example.org", {"duty": "operator"})
        people.join(tx, "ann@example.org", "erik@example.org", "member", now(tx))
    caller, robot = neighbours.callers["engineer"], service.add_robot("odd")
    hook = caller.request("POST", "/api/v1/webhooks", json={"url": "https://hooks.example.org/", "label": ""}).json()
    version = caller.get("/api/v1/robots/free/maps/ground").headers["ETag"]
    for number, text in enumerate(ODD):
        for method, path, body in calls(text, hook["id"]):
            where = path.replace("{}", "a%00b" if text == NUL else "%ED%A0%80")
            sent: Json = {} if body is None else {"content": json.dumps(body)}
            answer = caller.request(method, where, {"If-Match": version, "Content-Type": "application/json"}, **sent)
            assert answer.status_code < 500 or answer.json()["type"] == "/problems/unavailable", (method, path, body)
            assert text == HALF or answer.status_code >= 400 or path.endswith("/password"), (method, path, body)
        assert robot.upload(f"{number}", firmware=text).status_code == 422
        assert robot.upload(f"{number}", model=text).status_code == 422
