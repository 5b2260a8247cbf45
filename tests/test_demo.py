"""`stillroom demo`: the service with simulated homes beside it."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

from stillroom.__main__ import main
from stillroom.demo import simulation
from stillroom.settings import Settings


def settings_in(folder: Path) -> Settings:
    return Settings.from_environment({"STILLROOM_DATA_DIR": str(folder), "STILLROOM_ADMIN_TOKEN": "operator"})


def test_the_simulation_ends_with_the_service_however_it_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[bytes]] = []

    class Child(subprocess.Popen[bytes]):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            started.append(self)

    monkeypatch.setattr("stillroom.demo.subprocess.Popen", Child)

    def serve_and_fail() -> None:
        with simulation(settings_in(tmp_path), "http://127.0.0.1:9", 1, 5.0):
            assert started[0].poll() is None
            raise RuntimeError

    with pytest.raises(RuntimeError):
        serve_and_fail()
    (child,) = started
    assert child.poll() is not None


def test_the_simulation_gets_the_operators_token_where_nobody_reads_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[list[str], dict[str, str]]] = []

    class Child:
        def __init__(self, command: list[str], env: dict[str, str], **_: Any) -> None:
            calls.append((command, env))

        def terminate(self) -> None:
            pass

        def wait(self, _timeout: float) -> int:
            return 0

    monkeypatch.setattr("stillroom.demo.subprocess.Popen", Child)
    with simulation(settings_in(tmp_path), "http://127.0.0.1:8123", 2, 3.0):
        ((command, environment),) = calls
    assert command[1:] == [
        "-m",
        "stillroom",
        "simulate",
        "--quiet",
        "--url",
        "http://127.0.0.1:8123",
        "--homes",
        "2",
        "--every",
        "3.0",
    ]
    assert environment["STILLROOM_ADMIN_TOKEN"] == "operator"
    assert environment["STILLROOM_DATA_DIR"] == str(tmp_path)


@pytest.mark.parametrize("given", ["chosen", None])
def test_demo_tells_an_operator_token_where_the_environment_gives_none(
    given: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    served: list[Settings] = []
    monkeypatch.setenv("STILLROOM_DATA_DIR", str(tmp_path))
    monkeypatch.delenv("STILLROOM_ADMIN_TOKEN", raising=False)
    if given:
        monkeypatch.setenv("STILLROOM_ADMIN_TOKEN", given)
    monkeypatch.setattr("stillroom.demo.demo", lambda settings, *_: served.append(settings))
    assert main(["demo"]) == 0
    token = served[0].admin_token
    assert token
    assert (token == given) == (given is not None)
    assert (token in capsys.readouterr().out) == (given is None)
