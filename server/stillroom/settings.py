"""What the environment decides. Nothing else in stillroom reads environment variables."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Settings:
    data_dir: Path
    database_url: str
    """SQLAlchemy URL."""
    grid_store_url: str
    """A folder or an object store's URL."""
    admin_token: str | None
    """Bearer token of an operator."""

    @staticmethod
    def from_environment(environment: Mapping[str, str] = os.environ) -> "Settings":
        data_dir = Path(environment.get("STILLROOM_DATA_DIR") or "data").absolute()
        return Settings(
            data_dir=data_dir,
            database_url=environment.get("STILLROOM_DATABASE_URL") or f"sqlite:///{data_dir / 'stillroom.sqlite'}",
            grid_store_url=environment.get("STILLROOM_GRID_STORE_URL") or str(data_dir / "grids"),
            admin_token=environment.get("STILLROOM_ADMIN_TOKEN") or None,
        )
