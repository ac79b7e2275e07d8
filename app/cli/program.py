"""The program `snap6d`: its commands, or what to install where the packages that they need are missing."""

import sys


def main() -> None:
    """Run the command that was typed."""
    try:
        from app.cli.commands import main as run
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in {"app", "registration_core"}:
            raise  # a fault of ours
        sys.exit(
            f"snap6d: the application is not installed, only registration_core is ({error.name} is missing);"
            " install it with: pip install 'snap6d[app]'"
        )
    run()
