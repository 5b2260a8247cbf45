"""What a mission goes through, as OpenTelemetry and the log have it."""

import json
from collections.abc import Iterator

import pytest
from opentelemetry import trace
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

from stillroom import tracing
from tests.conflicts import Core
from tests.conftest import RobotCaller, Service
from tests.homes import home


@pytest.fixture
def spans(monkeypatch: pytest.MonkeyPatch) -> Iterator[InMemorySpanExporter]:
    exporter, provider = InMemorySpanExporter(), TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(exporter))
    monkeypatch.setattr(trace, "get_tracer", provider.get_tracer)
    monkeypatch.setattr(tracing, "trace", trace)
    yield exporter
    provider.shutdown()


def test_the_stages_of_a_mission_are_one_trace(
    service: Service, mapped: RobotCaller, spans: InMemorySpanExporter
) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    service.worker.settle()
    found = {span.name: span for span in spans.get_finished_spans()}
    whole = found["mission"]
    assert dict(whole.attributes or {}) == {
        "stillroom.robot": mapped.id, "stillroom.map": "ground", "stillroom.mission": "1",
    }  # fmt: skip
    assert {"total", "decode", "align", "transfer"} <= found.keys()
    assert {trace_of(span) for span in found.values()} == {trace_of(whole)}
    of_mission, of_total = whole.get_span_context(), found["total"].parent
    assert of_mission is not None
    assert of_total is not None
    assert of_total.span_id == of_mission.span_id


def trace_of(span: ReadableSpan) -> int:
    context = span.get_span_context()
    assert context is not None
    return context.trace_id


def test_what_went_wrong_is_marked_and_not_told_as_it_may_be_of_a_home(
    service: Service, mapped: RobotCaller, core: Core, spans: InMemorySpanExporter, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_asked: object) -> object:
        raise RuntimeError("the cellar of Ann")

    core.planned["1"] = broken  # type: ignore[assignment]
    mapped.upload("1", home(shift=(1, 0)))
    service.worker.settle()
    total = next(span for span in spans.get_finished_spans() if span.name == "total")
    assert (total.status.status_code, total.status.description) == (trace.StatusCode.ERROR, "RuntimeError")
    assert "cellar" not in str([span.to_json() for span in spans.get_finished_spans()])
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    (failed,) = (line for line in lines if line["event"] == "a mission could not be processed")
    assert (failed["robot"], failed["map"], failed["mission"], failed["level"]) == (mapped.id, "ground", "1", "error")


def test_requests_and_missions_are_logged_with_their_ids(
    service: Service, mapped: RobotCaller, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = mapped.get(mapped.path(), {"X-Request-Id": "from-the-robot.17"})
    assert answer.headers["X-Request-Id"] == "from-the-robot.17"
    made_up = service.stranger.get("/login?token=a-secret", {"X-Request-Id": "no id, but\ttext"}).headers[
        "X-Request-Id"
    ]
    assert len(made_up) == 16
    mapped.upload("1", home(shift=(1, 0)))
    service.worker.settle()
    service.http.get("/healthz")
    said = capsys.readouterr().err
    assert "a-secret" not in said
    lines = [json.loads(line) for line in said.splitlines()]
    first, second, *rest = [line for line in lines if line["event"] == "request"]
    assert (first["request"], first["method"], first["path"], first["status"]) == (
        "from-the-robot.17", "GET", mapped.path(), 200,
    )  # fmt: skip
    assert (second["request"], second["path"], second["status"]) == (made_up, "/login", 401)
    assert [line["path"] for line in rest] == [f"{mapped.path()}/missions/1"]
    # The first mission's line comes after its answer, so perhaps only now.
    (mission,) = (line for line in lines if line["event"] == "mission" and line["mission"] != "0")
    assert (mission["mission"], mission["outcome"], mission["version"]) == ("1", "updated", 2)
    assert "request" not in mission  # it is processed elsewhere, and later


def test_without_opentelemetry_nothing_is_traced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tracing, "trace", None)
    tracing.configure()
    with tracing.span("mission", robot="RB-1"):
        pass
