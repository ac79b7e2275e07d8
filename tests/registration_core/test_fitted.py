"""The fitted numbers where there are some, and where there are none yet."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from registration_core import fitted
from registration_core.config import ROUNDS
from registration_core.fitted import NOTHING, read_fitted
from registration_core.judge.confidence import FEATURES
from registration_core.judge.pixel_evidence import COUNT

TRIES = """
import registration_core
from registration_core.fitting.trials import scene_trials
from registration_core.config import SnapConfig
assert "{folder}" in registration_core.__file__
assert [one.doubt for one in SnapConfig().rounds] == [1.0] * len(SnapConfig().rounds)
print(len(scene_trials(0, 0)))
"""


def test_there_is_a_number_for_everything_that_asks_for_one() -> None:
    found = read_fitted()
    assert len(found.classes) == COUNT
    assert len(found.confidence) == len(FEATURES)
    assert len(found.doubts) == len(ROUNDS)


def test_without_a_file_nothing_is_fitted(tmp_path: Path) -> None:
    assert read_fitted(tmp_path / "fitted.json") == NOTHING


@pytest.mark.slow
def test_what_is_fitted_to_can_be_made_from_nothing(tmp_path: Path) -> None:
    package = Path(fitted.__file__).parent
    # with the compiled kernels beside their sources, or they would all be compiled anew
    left_out = shutil.ignore_patterns("*.pyc", "fitted.json", "table.npz")
    shutil.copytree(package, tmp_path / "registration_core", ignore=left_out)
    program = TRIES.format(folder=tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 0
