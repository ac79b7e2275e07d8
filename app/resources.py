"""Where what comes with the application lies: its pages, the database's migrations, the demo scenes."""

from importlib.resources import files
from pathlib import Path

_PACKAGE = Path(str(files("app")))
CHECKOUT = None if (_PACKAGE / "migrations").is_dir() else _PACKAGE.parent
"""None where it is an installed wheel that runs, which carries the three folders inside `app`."""
_FOLDER = CHECKOUT or _PACKAGE

STATIC = _FOLDER / "static"
MIGRATIONS = _FOLDER / "migrations"
DEMO_SCENES = _FOLDER / "scenes" / "demo"
