"""The browser's app is served from the package."""

from pathlib import Path

import pytest

from tests.conftest import Service


@pytest.fixture
def built(service: Service) -> Path:
    static = service.settings.data_dir / "static"
    (static / "assets").mkdir(parents=True)
    (static / "index.html").write_text("<p>the app")
    (static / "favicon.svg").write_text("<svg/>")
    (static / "assets" / "index-abc123.js").write_text("1")
    (service.settings.data_dir / "secret.txt").write_text("secret")
    return static


@pytest.mark.usefixtures("built")
@pytest.mark.parametrize("path", ["/", "/robots/RB-1/maps/ground", "/index.html"])
def test_every_path_of_the_app_gives_its_start_page(service: Service, path: str) -> None:
    answer = service.stranger.get(path)
    assert (answer.status_code, answer.text) == (200, "<p>the app")
    assert answer.headers["Cache-Control"] == "no-cache"


@pytest.mark.usefixtures("built")
def test_files_whose_name_changes_with_their_content_are_kept_by_browsers(service: Service) -> None:
    answer = service.stranger.get("/assets/index-abc123.js")
    assert "immutable" in answer.headers["Cache-Control"]
    assert "javascript" in answer.headers["Content-Type"]
    assert service.stranger.get("/favicon.svg").headers["Cache-Control"] == "no-cache"


@pytest.mark.usefixtures("built")
@pytest.mark.parametrize(
    "path", ["/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "/assets/%2e%2e/%2e%2e/secret.txt"]
)
def test_no_path_leads_out_of_the_app(service: Service, path: str) -> None:
    assert "secret" not in service.stranger.get(path).text


def test_a_service_whose_app_was_not_built_says_so(service: Service) -> None:
    answer = service.stranger.get("/")
    assert answer.status_code == 200
    assert "make setup" in answer.text
    assert service.stranger.get("/robots/RB-1").status_code == 503


@pytest.mark.usefixtures("built")
def test_what_is_missing_in_the_api_is_not_the_app(service: Service) -> None:
    assert service.stranger.get("/api/v1/nothing").status_code == 404
