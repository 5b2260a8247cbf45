"""What those who run the service look at."""

import json
import re
import shutil
from pathlib import Path

import pytest
import sqlalchemy as sa
import yaml
from alembic.script import ScriptDirectory
from prometheus_client.parser import text_string_to_metric_families
from starlette.testclient import TestClient

from stillroom.app import create_app
from stillroom.settings import Messaging, Settings
from stillroom.store.database import Database
from stillroom.store.migrate import config, migrate
from tests.conftest import RobotCaller, Service
from tests.homes import home
from tests.telling import Names, add_webhook, delivering


def test_a_service_that_can_work_says_so(service: Service) -> None:
    assert service.stranger.get("/healthz").json() == {"status": "ok"}
    assert service.stranger.get("/readyz").json() == {"status": "ok"}


def test_a_database_that_was_not_migrated_is_not_ready(tmp_path: Path, settings: Settings) -> None:
    empty = Settings(tmp_path, f"sqlite:///{tmp_path / 'empty.sqlite'}", settings.grid_store_url, None)
    with TestClient(create_app(empty), raise_server_exceptions=False) as http:
        answer = http.get("/readyz")
        assert (answer.status_code, answer.headers["Retry-After"]) == (503, "5")
        assert "stillroom migrate" in answer.json()["detail"]
        database = Database(empty.database_url)
        migrate(database)
        database.dispose()
        assert http.get("/readyz").status_code == 200
        http.app.state.parts.database.dispose()  # type: ignore[attr-defined]


def test_a_database_that_a_newer_program_has_migrated_is_ready_and_left_alone(service: Service) -> None:
    with service.database.write() as tx:
        tx.execute(sa.text("UPDATE alembic_version SET version_num = '9999'"))
    assert service.stranger.get("/readyz").status_code == 200
    migrate(service.database)
    with service.database.write() as tx:
        assert tx.execute(sa.text("SELECT version_num FROM alembic_version")).scalar_one() == "9999"
        tx.execute(sa.text("UPDATE alembic_version SET version_num = '0001'"))
    try:
        assert service.stranger.get("/readyz").status_code == 503
    finally:
        with service.database.write() as tx:
            tx.execute(sa.text("UPDATE alembic_version SET version_num = :newest"), {"newest": newest()})


def newest() -> str:
    found = ScriptDirectory.from_config(config()).get_current_head()
    assert found is not None
    return found


@pytest.mark.parametrize("engine", ["sqlite"])
def test_a_folder_of_grids_that_is_gone_is_not_ready(service: Service) -> None:
    assert service.stranger.get("/readyz").status_code == 200
    shutil.rmtree(service.settings.grid_store_url)
    assert service.stranger.get("/readyz").status_code == 503


def values(service: Service) -> dict[tuple[str, str | None], float]:
    answer = service.stranger.get("/metrics")
    assert answer.headers["Content-Type"].startswith("text/plain")
    return {
        (sample.name, sample.labels.get("outcome")): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def test_the_metrics_count_missions_by_outcome_and_those_that_wait(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("5", home(shift=(1, 0)))
    mapped.upload("3", home(shift=(1, 0)))
    service.worker.paused = True
    mapped.upload("6", wait=None)
    found = values(service)
    counted = {outcome: n for (name, outcome), n in found.items() if name == "stillroom_missions"}
    assert counted == {"created": 1, "updated": 1, "superseded": 1}
    assert found["stillroom_missions_waiting", None] == 1
    assert found["stillroom_oldest_waiting_seconds", None] >= 0


def test_the_metrics_hold_what_failure_rates_are_made_of(service: Service, mapped: RobotCaller) -> None:
    mapped.upload("5", home(shift=(1, 0)))
    assert values(service)["stillroom_missions_uncounted", None] == 2
    service.operator.get("/api/v1/fleet/failure-rates")
    found = values(service)
    assert (found["stillroom_missions_judged", None], found["stillroom_missions_uncounted", None]) == (1, 0)
    assert found["stillroom_missions_escaped", None] == found["stillroom_missions_unprocessed", None] == 0
    text = service.stranger.get("/metrics").text
    assert 'stillroom_missions_failed{row="transfer"} 0.0' in text


def test_dashboard_and_alerts_ask_for_metrics_that_there_are(service: Service, mapped: RobotCaller) -> None:
    add_webhook(service.operator, "https://hooks.example.org/")
    mapped.upload("5", home(shift=(1, 0)))
    with delivering(service, Messaging("https://maps.example.org"), Names({"hooks.example.org": [["10.0.0.1"]]})) as m:
        m.settle()
    there = {
        sample.name
        for family in text_string_to_metric_families(service.stranger.get("/metrics").text)
        for sample in family.samples
    }
    folder = Path(__file__).parents[2] / "deploy" / "grafana"
    dashboard = json.loads((folder / "stillroom.json").read_text())
    shown = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    rules = [rule for group in yaml.safe_load((folder / "alerts.yml").read_text())["groups"] for rule in group["rules"]]
    asked = {
        name for expr in [*shown, *(rule["expr"] for rule in rules)] for name in re.findall(r"stillroom_\w+", expr)
    }
    assert len(shown) >= 7
    assert asked <= there
    assert all(rule["for"] and rule["keep_firing_for"] for rule in rules)  # each fires late and ends late


@pytest.mark.parametrize("path", ["/", "/robots/RB-1/maps/ground", "/healthz", "/api/v1/nothing", "/openapi.json"])
def test_every_answer_carries_the_headers_that_keep_browsers_safe(service: Service, path: str) -> None:
    headers = service.stranger.get(path).headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "unsafe-eval" not in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] in ("same-origin", "no-referrer")


def test_the_metrics_count_messages_that_wait(service: Service, robot: RobotCaller) -> None:
    add_webhook(service.operator, "https://hooks.example.org/")
    robot.upload("0")
    with delivering(
        service, Messaging("https://maps.example.org"), Names({"hooks.example.org": [["10.0.0.1"]]})
    ) as messenger:
        messenger.settle()
    text = service.stranger.get("/metrics").text
    assert 'stillroom_messages{channel="webhook",state="waiting"} 1.0' in text


NUMBERS = {"outcome", "row", "channel", "state"}
"""Labels whose values are few, whatever the fleet: no metric names a robot, a home or a person."""


@pytest.mark.parametrize("engine", ["sqlite"])
def test_the_dashboard_and_the_alerts_ask_for_metrics_that_there_are_and_none_names_anybody(
    service: Service, mapped: RobotCaller
) -> None:
    mapped.upload("1", home(shift=(1, 0)))
    text = service.stranger.get("/metrics").text
    families = list(text_string_to_metric_families(text))
    assert {label for family in families for sample in family.samples for label in sample.labels} <= NUMBERS
    assert mapped.id not in text
    known = {family.name for family in families}
    asked = "".join(file.read_text() for file in (Path(__file__).parents[2] / "deploy/grafana").iterdir())
    named = set(re.findall(r"\bstillroom_\w+", asked))
    assert len(named) > 5
    assert named <= known
    # each of them can fall: what is deleted, or run again, is not there any more
    assert {family.type for family in families} == {"gauge"}
    assert "increase(" not in asked
    assert "rate(" not in asked
