"""The unit tests of the scripts of the pages, which Node.js runs."""

import subprocess

from tests.conftest import REPOSITORY
from tests.tools.front_end_types import NODE


def test_units_of_the_scripts() -> None:
    command = [str(NODE), "--test", "--test-reporter=tap", "tests/static/**/*.test.js"]
    ran = subprocess.run(command, cwd=REPOSITORY, text=True, capture_output=True, check=False)
    assert ran.returncode == 0, ran.stdout
    assert "\n# pass 0\n" not in ran.stdout  # nothing was found
