"""The whole API, asked by every kind of caller what its OpenAPI document lets one ask, and what it does not."""

import os
from collections import Counter
from contextlib import suppress
from time import monotonic
from typing import Any

import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable
from schemathesis import APIOperation, Case, GenerationMode
from schemathesis.core.failures import FailureGroup
from schemathesis.core.result import Ok
from schemathesis.python.asgi import ASGIClient, get_client
from schemathesis.specs.openapi import checks

from tests.conftest import Service
from tests.fuzz.neighbourhood import PRIVATE, Neighbourhood, settle, sign_in_again

SECONDS = float(os.environ.get("STILLROOM_FUZZ_S", "0"))
"""So long at least; everything is asked once in any case."""
EXAMPLES = 2 if SECONDS else 1
CHECKS = [
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_headers_conformance,
    checks.response_schema_conformance,
]
AnyCase = Case[Any]
Operation = APIOperation[Any, Any, Any, Any]
ENDS = (
    "POST /api/v1/robots/{robot}/token",
    "DELETE /api/v1/robots/{robot}/token",
    "POST /api/v1/robots/{robot}/release",
    "DELETE /api/v1/robots/{robot}/maps",
    "DELETE /api/v1/home",
    "PUT /api/v1/account/password",
    "DELETE /api/v1/account/sessions",
    "DELETE /api/v1/session",
)
"""Asked last, and once: afterwards there is less to ask for."""


@schemathesis.serializer("application/zip")
def as_it_is(_context: schemathesis.SerializationContext, value: Any) -> bytes:
    return value if isinstance(value, bytes) else str(value).encode()


schemathesis.openapi.media_type("application/zip", st.binary(max_size=200).map(b"PK\x03\x04".__add__))


def test_every_answer_is_documented_and_tells_nobody_about_another_home(service: Service) -> None:
    neighbours = settle(service)
    service.http.app.state.parts.signals.close()  # type: ignore[attr-defined]  # event streams end, nobody waits for missions
    fuzzer = Fuzzer(service, neighbours)
    fuzzer.run(SECONDS)
    assert not fuzzer.found, "\n".join(fuzzer.found.values())
    understood = {operation for operation, status in fuzzer.answers if status < 400}
    asked = {operation for operation, _ in fuzzer.answers}
    assert len(understood) > len(asked) / 2, "most requests should mean something"


class Fuzzer:
    def __init__(self, service: Service, neighbours: Neighbourhood) -> None:
        self.found: dict[tuple[str, str], str] = {}
        """By operation and kind of failure: how to get it again."""
        self.answers: Counter[tuple[str, int]] = Counter()
        self._service, self._neighbours = service, neighbours
        schema = schemathesis.openapi.from_dict(service.http.app.openapi())  # type: ignore[attr-defined]
        schema.app = service.http.app
        found = (result.ok() for result in schema.get_all_operations() if isinstance(result, Ok))
        operations = sorted(found, key=_ends)
        self._asked = [(operation, mode) for operation in operations for mode in GenerationMode]

    def run(self, seconds: float) -> None:
        until, turn = monotonic() + seconds, 0
        with get_client(self._service.http.app) as session:  # type: ignore[arg-type]
            while turn == 0 or monotonic() < until:
                for operation, mode in self._asked:
                    if turn == 0 or (monotonic() < until and not _ends(operation)):
                        self._ask(session, operation, mode, turn)
                self._neighbours = sign_in_again(self._service, self._neighbours)
                turn += 1

    def _ask(self, session: ASGIClient, operation: Operation, mode: GenerationMode, turn: int) -> None:
        @seed(turn)
        @settings(
            max_examples=EXAMPLES, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
        )
        @given(case=operation.as_strategy(generation_mode=mode), data=st.data())
        def ask(case: AnyCase, data: st.DataObject) -> None:
            home = data.draw(st.sampled_from([None, *self._neighbours.homes]))
            for name in case.path_parameters or {}:
                if home is not None and name in home.names:
                    case.path_parameters[name] = data.draw(st.sampled_from(home.names[name]))
            for who, caller in self._neighbours.callers.items():
                self._judge(session, case, who, dict(caller.headers))

        with suppress(Unsatisfiable):  # nothing can be wrong with a request that has no parameters
            ask()

    def _judge(self, session: ASGIClient, case: AnyCase, who: str, headers: dict[str, str]) -> None:
        label = case.operation.label
        try:
            response = case.call(session=session, headers=headers)
        except Exception as error:  # what the application raises, after it has answered with 500
            self._note(case, who, "raised", repr(error))
            return
        self.answers[label, response.status_code] += 1
        if PRIVATE.encode() in response.content and who not in self._neighbours.bobs:
            self._note(case, who, "told about another home", repr(response.content[:500]))
        try:
            case.validate_response(response, checks=CHECKS)
        except FailureGroup as failures:
            for failure in failures.exceptions:
                self._note(case, who, type(failure).__name__, str(failure)[:500])

    def _note(self, case: AnyCase, who: str, what: str, detail: str) -> None:
        again = f"{case.operation.label} by {who}: {what}\n  {case.as_curl_command()[:1000]}\n  {detail}"
        self.found.setdefault((case.operation.label, what), again)


def _ends(operation: Operation) -> bool:
    return operation.label in ENDS
