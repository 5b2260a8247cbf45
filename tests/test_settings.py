"""What the environment decides."""

from pathlib import Path

import pytest

from stillroom.__main__ import main
from stillroom.pipeline.update import RESOLVERS
from stillroom.settings import InvalidSetting, Settings


@pytest.mark.parametrize(
    ("said", "resolvers"),
    [
        (None, RESOLVERS),
        ("", RESOLVERS),
        ("none", ()),
        ("meta_occupancy", RESOLVERS[:1]),
        ("meta_occupancy,meta_dividers", RESOLVERS),
    ],
)
def test_the_rows_of_the_ablation_are_switched_by_the_environment(said: str | None, resolvers: tuple[str, ...]) -> None:
    environment = {} if said is None else {"STILLROOM_RESOLVERS": said}
    assert Settings.from_environment(environment).resolvers == resolvers


@pytest.mark.parametrize("said", ["meta_dividers", "meta_dividers,meta_occupancy", "all", "NONE", "meta_occupancy,"])
def test_any_other_row_is_refused_with_those_that_there_are(said: str) -> None:
    with pytest.raises(InvalidSetting, match="'none', 'meta_occupancy', 'meta_occupancy,meta_dividers'"):
        Settings.from_environment({"STILLROOM_RESOLVERS": said})


def test_a_service_with_a_wrong_setting_does_not_start_and_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STILLROOM_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setenv("STILLROOM_RESOLVERS", "everything")
    assert main(["serve", "--port", "0"]) == 1
    assert "STILLROOM_RESOLVERS is 'everything'" in capsys.readouterr().err
    assert not (tmp_path / "data").exists()
