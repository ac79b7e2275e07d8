"""Settings: a default for everything, changed by environment variables, an env file or the command line."""

from pathlib import Path
from typing import Annotated

from platformdirs import user_data_path
from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from app.resources import CHECKOUT

RISK = 0.05
"""Share of wrong poses among those that the machine may accept by their confidence; certificates are asked
for besides. The calibration that comes with the package bears out no less; one of a dataset's own may."""
LEAST_RISK = 0.0001
"""The least that can be asked for: one in ten thousand."""


def usual_state_dir() -> Path:
    """`state` in a checkout; for an installed Snap6D, a folder of whoever runs it."""
    return CHECKOUT / "state" if CHECKOUT else user_data_path("snap6d", appauthor=False)


class Settings(BaseSettings):
    """What one running Snap6D needs to know; each field is an environment variable `SNAP6D_<FIELD>`."""

    model_config = SettingsConfigDict(env_prefix="SNAP6D_", env_file=".env", extra="ignore")

    host: str = "127.0.0.1"
    """Address that the one public port listens on."""
    port: Annotated[int, Field(ge=0, le=65535)] = 8000
    """The public port; 0 takes a free one."""
    state_dir: Path = Field(default_factory=usual_state_dir)
    """Database, stored files and exports."""
    database_url: str = ""
    """SQLAlchemy address of another database; empty: SQLite in `state_dir`."""
    scheduler_address: str = ""
    """Dask scheduler of a cluster; empty: worker processes on this machine."""
    workers: Annotated[int, Field(ge=1, le=256)] = 2
    """Worker processes to start on this machine."""
    risk: Annotated[float, Field(ge=LEAST_RISK, lt=1)] = RISK
    """Share of wrong poses among those that the machine may accept, where a dataset says nothing else."""
    max_upload_mb: Annotated[int, Field(ge=1)] = 4096
    """Largest dataset that may be uploaded, megabytes, packed and unpacked."""
    public_url: str = ""
    """Address under which browsers reach the app, where a reverse proxy stands in front."""

    host_names: str = ""
    """Further names of the machine under which browsers reach the app, separated by commas."""
    trusted_proxies: str = ""
    """Addresses or networks of reverse proxies, separated by commas: they say for whom they ask."""

    @property
    def resolved_database_url(self) -> str:
        """`database_url`, or SQLite in the state directory."""
        return self.database_url or f"sqlite:///{self.state_dir.resolve() / 'snap6d.sqlite'}"

    @property
    def files_dir(self) -> Path:
        """Where the file store keeps its content."""
        return self.state_dir / "files"

    @property
    def throttle_file(self) -> Path:
        """Where wrong passwords are counted."""
        return self.state_dir / "throttle.sqlite"

    @property
    def prepared_dir(self) -> Path:
        """Where what workers built of objects is kept."""
        return self.state_dir / "prepared"
