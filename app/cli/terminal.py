"""What all commands share: the terminal, the settings and the database. Heavy imports stay inside."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

if TYPE_CHECKING:
    from app.config import Settings
    from app.storage.database import Database

console = Console(highlight=False, soft_wrap=True, markup=False)  # names may look like markup
errors = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)


def read_settings(**given: object) -> "Settings":
    """The settings, some of them given on the command line."""
    from pydantic import ValidationError

    from app.config import Settings

    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    except ValidationError as error:
        first = error.errors()[0]
        name = str(first["loc"][0])
        fail(f"setting {name} (SNAP6D_{name.upper()}) is {first['input']!r}: {first['msg']}")


def open_database(settings: "Settings") -> "Database":
    """The database, whatever its version."""
    from app.storage.database import Database

    settings.state_dir.mkdir(parents=True, exist_ok=True)
    return Database(settings.resolved_database_url)


def checked_database(settings: "Settings") -> "Database":
    """The database, which has to be of this version."""
    database = open_database(settings)
    database.check_version()
    return database


@contextmanager
def progress(what: str) -> Iterator[Callable[[float, str], None]]:
    """A bar that fills as it is told the share that is done and what is done now."""
    with progress_bar() as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share, now: bar.update(task, completed=share, description=now)


def progress_bar() -> Progress:
    """A bar on the terminal; nothing where there is none."""
    columns = (TextColumn("{task.description}", markup=False), BarColumn())
    return Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal)


def fail(message: str) -> NoReturn:
    """End with one sentence."""
    errors.print(f"snap6d: {message}")
    raise SystemExit(1)
