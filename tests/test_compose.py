"""docker-compose.yml, with processes in the place of containers: the same commands, the same environment, other addresses."""

import json
import os
import re
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx2
import psycopg
import pytest
import yaml

from tests import object_store, postgresql
from tests.homes import ORIGIN, RESOLUTION, home, png
from tests.ports import free_ports

ROOT = Path(__file__).parents[1]
PINNED = re.compile(r"[a-z0-9./-]+:\d+\.\d+[a-z0-9.-]*")
OURS = {"POSTGRES_PASSWORD": "secret", "STORE_SECRET": "secret-of-the-store", "STILLROOM_ADMIN_TOKEN": "operator"}
PATIENCE_S = 180.0


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
    return found


def test_images_are_pinned_and_what_runs_is_watched_and_keeps_its_data(compose: dict[str, Any]) -> None:
    services, jobs = compose["services"], {"bucket", "migrate"}
    assert all(PINNED.fullmatch(service["image"]) for service in services.values())
    assert {name for name, one in services.items() if one["restart"] == "unless-stopped"} == services.keys() - jobs
    for name in services.keys() - jobs:
        is_ours = services[name]["image"].startswith("stillroom:")  # the image's own health check
        assert is_ours or "healthcheck" in services[name], name
    assert "HEALTHCHECK" in (dockerfile := (ROOT / "Dockerfile").read_text())
    assert dockerfile.index("USER stillroom") < dockerfile.index("CMD [")
    assert all(services[name]["cap_drop"] == ["ALL"] for name in ("server1", "server2", "migrate", "proxy"))
    named = {volume.partition(":")[0] for name in ("db", "store") for volume in services[name]["volumes"]}
    assert named == compose["volumes"].keys()
    assert [name for name, one in services.items() if "ports" in one] == ["proxy"]


@pytest.mark.parametrize("image", ["python", "node"])
def test_the_base_images_are_pinned(image: str) -> None:
    (tag,) = re.findall(rf"^FROM {image}:(\S+)", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert re.match(r"\d+\.\d+", tag)


def test_the_whole_stack_serves_a_mission_through_the_proxy(compose: dict[str, Any], tmp_path_factory: Any) -> None:
    services, folder = compose["services"], Path(tmp_path_factory.mktemp("compose"))
    (port, *ports) = free_ports(12)
    proxy, server1, server2, s3 = ports[:4]
    addresses = {"server1:8000": f"127.0.0.1:{server1}", "server2:8000": f"127.0.0.1:{server2}", ":8080": f":{proxy}"}
    addresses |= {
        "store:8333": f"127.0.0.1:{s3}",
        "store:9333": f"127.0.0.1:{ports[4]}",
        "@db:5432": f"@127.0.0.1:{port}",
    }
    names = ("volume.port", "filer.port", "master.port.grpc", "volume.port.grpc", "filer.port.grpc", "s3.port.grpc")
    seaweed = [
        "-ip=127.0.0.1",
        "-s3.port.iceberg=0",
        "-s3.port.lance=0",
        f"-master.port={ports[4]}",
        *(f"-{n}={p}" for n, p in zip(names, ports[5:], strict=True)),
    ]

    def environment(service: str) -> dict[str, str]:
        given = {name: _filled(str(value)) for name, value in services[service].get("environment", {}).items()}
        return {name: _moved(value, addresses) for name, value in given.items()}

    def command(service: str, own_port: int) -> list[str]:
        words = [_moved(word.replace("0.0.0.0", "127.0.0.1"), addresses) for word in services[service]["command"]]
        return [str(own_port) if word == "8000" else word for word in words]

    with ExitStack() as stack:
        lasting = (
            Path(tempfile.gettempdir()) / f"stillroom-{secrets.token_hex(4)}.postgresql"
        )  # it runs as somebody else
        _database(stack, lasting, port, services["db"])
        store = folder / "store"
        store.mkdir()
        words = [word.replace("-dir=/data", f"-dir={store}").replace("8333", str(s3)) for word in command("store", s3)]
        weed = [object_store.program(), *words, *seaweed, "-volume.max=20", "-master.volumeSizeLimitMB=100"]
        stack.enter_context(_running(weed, environment("store"), folder / "store.log"))
        _wait(f"http://127.0.0.1:{s3}/healthz")
        (_, _, shell) = services["bucket"]["entrypoint"]
        shell = _moved(
            shell.replace("weed ", f"{object_store.program()} "),
            addresses | {f":{ports[4]}": f":{ports[4]}.{ports[7]}"},
        )
        assert subprocess.run(["sh", "-c", shell], capture_output=True, timeout=PATIENCE_S, check=False).returncode == 0
        migrate = _ours(services["migrate"]["command"])
        subprocess.run(migrate, env=_environment(environment("migrate")), check=True, timeout=PATIENCE_S)
        for name, own in (("server1", server1), ("server2", server2)):
            serve = [*_ours(command(name, own)), "--workers", "1"]  # else one a core, as the whole machine has
            stack.enter_context(_running(serve, environment(name), folder / f"{name}.log"))
        caddy = [word.replace("/etc/caddy", str(ROOT / "deploy" / "compose")) for word in command("proxy", proxy)]
        caddy[0] = str(Path(sys.executable).with_name("caddy"))
        stack.enter_context(_running(caddy, environment("proxy"), folder / "proxy.log"))
        for own in (server1, server2, proxy):
            _wait(f"http://127.0.0.1:{own}/readyz")
        _upload(f"http://127.0.0.1:{proxy}")


def _upload(url: str) -> None:
    """Missions of a robot through the proxy, while a person's browser hears of them."""
    with httpx2.Client(base_url=url, timeout=PATIENCE_S) as http, ThreadPoolExecutor(1) as pool:
        operator = {"Authorization": f"Bearer {OURS['STILLROOM_ADMIN_TOKEN']}"}
        token = http.post("/api/v1/robots", headers=operator, json={"id": "RB-1", "name": "One"}).json()["token"]
        heard = pool.submit(_first_event, url, operator)
        for number in range(4):
            meta = {"sequence": number, "resolution": RESOLUTION, "origin": ORIGIN}
            answer = http.put(
                f"/api/v1/robots/RB-1/maps/ground/missions/{number}",
                headers={"Authorization": f"Bearer {token}", "Prefer": "wait=60", "Connection": "close"},
                files={"meta": ("m", json.dumps(meta), "application/json"), "grid": ("g", png(home()), "image/png")},
            )
            assert (answer.status_code, answer.json()["version"]) == (201, number + 1), answer.text
        assert heard.result(PATIENCE_S) == "event: version"


def _first_event(url: str, headers: Mapping[str, str]) -> str:
    headers = {**headers, "Last-Event-ID": "0"}
    with httpx2.stream("GET", f"{url}/api/v1/events", headers=headers, timeout=PATIENCE_S) as stream:
        return next(line for line in stream.iter_lines() if line.startswith("event: "))


def _database(stack: ExitStack, folder: Path, port: int, service: dict[str, Any]) -> None:
    """With the settings of the service's command."""
    given = [word for word in service["command"] if "=" in word]
    server = postgresql.Server(folder, (*given, f"port={port}", "listen_addresses=127.0.0.1", "fsync=off"))
    stack.callback(server.stop)
    with server.started():
        own = service["environment"]
        admin = f"{server.url('postgres')}&port={port}"
        with psycopg.connect(admin, autocommit=True) as connection:
            connection.execute(f"CREATE ROLE {own['POSTGRES_USER']} LOGIN PASSWORD '{OURS['POSTGRES_PASSWORD']}'")
            connection.execute(f"CREATE DATABASE {own['POSTGRES_DB']} OWNER {own['POSTGRES_USER']}")


def _filled(text: str) -> str:
    """With the variables of the file's reader, as docker compose does it."""
    return re.sub(
        r"\$\{(\w+)(?::([?+-])([^}]*))?\}",
        lambda found: OURS.get(found[1]) or (found[3] if found[2] == "-" else ""),
        text,
    )


def _moved(text: str, addresses: Mapping[str, str]) -> str:
    for before, after in addresses.items():
        text = text.replace(before, after)
    return text


def _ours(command: list[str]) -> list[str]:
    assert command[0] == "stillroom"
    return [sys.executable, "-m", *command]


def _environment(given: Mapping[str, str]) -> dict[str, str]:
    """Of a container: nothing of ours but where programs are."""
    kept = ("PATH", "PYTHONPATH", "HOME", "LANG", "VIRTUAL_ENV")
    return {name: os.environ[name] for name in kept if name in os.environ} | dict(given)


@contextmanager
def _running(command: list[str], given: Mapping[str, str], log: Path) -> Iterator[None]:
    assert shutil.which(command[0]), command[0]
    with log.open("w") as output:
        process = subprocess.Popen(command, env=_environment(given), stdout=output, stderr=output, cwd=log.parent)
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _wait(url: str) -> None:
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            if httpx2.get(url, timeout=5).status_code == 200:
                return
        except httpx2.TransportError:
            pass
        assert time.monotonic() < until, f"{url} does not answer"
        time.sleep(0.1)
