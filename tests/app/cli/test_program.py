"""The program without what its commands need."""

import subprocess
import sys

WITHOUT = """
import sys
sys.modules[{missing!r}] = None  # as if it were not installed
from app.cli.program import main
main()
"""


def run_without(missing: str) -> subprocess.CompletedProcess[str]:
    """Run `snap6d` where a module cannot be imported."""
    code = WITHOUT.format(missing=missing)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_where_only_the_core_is_installed_it_says_what_to_install():
    done = run_without("typer")
    assert done.returncode == 1
    assert done.stderr == (
        "snap6d: the application is not installed, only registration_core is (typer is missing);"
        " install it with: pip install 'snap6d[app]'\n"
    )


def test_a_fault_of_ours_is_not_hidden():
    assert "Traceback" in run_without("app.cli.terminal").stderr
