"""What the environment decides. Nothing else in stillroom reads environment variables."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a command that only prints must not wait for the pipeline's libraries
    from stillroom.pipeline.update import ResolverName

_RESOLVERS: "Mapping[str, tuple[ResolverName, ...]]" = {
    "none": (),
    "meta_occupancy": ("meta_occupancy",),
    "meta_occupancy,meta_dividers": ("meta_occupancy", "meta_dividers"),
}
_ALL_RESOLVERS = "meta_occupancy,meta_dividers"


class InvalidSetting(Exception):
    """The environment asks for what there is not."""


@dataclass(frozen=True)
class Settings:
    data_dir: Path
    database_url: str
    """SQLAlchemy URL."""
    grid_store_url: str
    """A folder or an object store's URL."""
    admin_token: str | None
    """Bearer token of an operator."""
    resolvers: "tuple[ResolverName, ...]" = _RESOLVERS[_ALL_RESOLVERS]
    """How far missions are helped by the meta layer: all of it, or one of the paper's ablation rows."""

    @staticmethod
    def from_environment(environment: Mapping[str, str] = os.environ) -> "Settings":
        """Raises InvalidSetting."""
        data_dir = Path(environment.get("STILLROOM_DATA_DIR") or "data").absolute()
        return Settings(
            data_dir=data_dir,
            database_url=environment.get("STILLROOM_DATABASE_URL") or f"sqlite:///{data_dir / 'stillroom.sqlite'}",
            grid_store_url=environment.get("STILLROOM_GRID_STORE_URL") or str(data_dir / "grids"),
            admin_token=environment.get("STILLROOM_ADMIN_TOKEN") or None,
            resolvers=_resolvers(environment.get("STILLROOM_RESOLVERS") or _ALL_RESOLVERS),
        )


def _resolvers(value: str) -> "tuple[ResolverName, ...]":
    if value not in _RESOLVERS:
        raise InvalidSetting(f"STILLROOM_RESOLVERS is {value!r}; it can be {', '.join(map(repr, _RESOLVERS))}.")
    return _RESOLVERS[value]
