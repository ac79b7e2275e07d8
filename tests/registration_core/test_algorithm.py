"""The hash of what computes."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import registration_core
from registration_core import ALGORITHM, SnapConfig, propose, snap, snap_steps, snap_views
from registration_core.algorithm import ENTRIES, algorithm_of, imported, sources_hash
from registration_core.config import AnywhereConfig
from tests.registration_core.simple_scene import standing_tool

FEW = SnapConfig(anywhere=AnywhereConfig(2_000, 500))

SOURCES = {
    "snap.py": "from registration_core.inner import polish\nfrom registration_core import pose\n",
    "pose.py": "EYE = 1.0\n",
    "inner/__init__.py": "",
    "inner/polish.py": 'def step(x):\n    """One step."""\n    return 0.5 * x  # halved\n',
    "unrelated.py": "from registration_core.snap import pose\n\nWIDTH = 640\n",
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of which `snap` uses `pose` and `inner.polish`."""
    for name, text in SOURCES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return tmp_path


def test_a_number_changes_it_wherever_it_stands(package):
    seen = {algorithm_of(package)}
    for name, before, after in (
        ("inner/polish.py", "0.5", "0.25"),
        ("pose.py", "1.0", "1"),
        ("snap.py", "import pose", "import pose as other"),
        ("inner/__init__.py", "", "STEPS = 3"),
    ):
        path = package / name
        text = path.read_text()
        path.write_text(text.replace(before, after) if before else after)
        seen.add(algorithm_of(package))
    assert len(seen) == 5


def test_comments_docstrings_line_endings_and_other_modules_do_not(package):
    before = algorithm_of(package)
    polish = package / "inner/polish.py"
    polish.write_bytes(
        b'"""Polishes."""\r\n\r\ndef step(x):\r\n\r\n    return (0.5 * x)\r\n\r\n"""Of it."""\r\n'
    )
    (package / "unrelated.py").write_text("WIDTH = 320\n")
    assert algorithm_of(package) == before


def test_fitted_numbers_change_it_and_how_their_file_is_laid_out_does_not(package):
    seen = {algorithm_of(package)}
    fitted = package / "fitted.json"
    for text in ('{"match": 10.0, "ring": [1, 2]}', '{\r\n "ring": [1, 2],\r\n "match": 10.0\r\n}\r\n'):
        fitted.write_text(text)
        seen.add(algorithm_of(package))
    assert len(seen) == 2
    fitted.write_text('{"match": 10.1, "ring": [1, 2]}')
    assert algorithm_of(package) not in seen


def test_a_part_of_the_package_has_a_hash_of_its_own(package):
    polish = sources_hash(package, ("inner.polish",))
    (package / "pose.py").write_text("EYE = 2.0\n")
    assert sources_hash(package, ("inner.polish",)) == polish
    (package / "inner/polish.py").write_text("def step(x):\n    return x\n")
    assert sources_hash(package, ("inner.polish",)) != polish


def test_an_estimate_says_what_made_it():
    scene = standing_tool()
    estimate = snap(scene.model, scene.depth, scene.camera, scene.truth, rng=np.random.default_rng(0))
    assert estimate.algorithm == ALGORITHM == algorithm_of(Path(registration_core.__file__).parent)


def test_it_covers_every_module_that_a_result_runs_through():
    scene = standing_tool()
    view = scene.depth, scene.camera, np.eye(4)
    root, ran = Path(registration_core.__file__).parent, set()
    sys.setprofile(lambda frame, event, arg: ran.add(frame.f_code.co_filename))
    try:
        snap(scene.model, scene.depth, scene.camera, scene.truth, rng=np.random.default_rng(0))
        snap_views(scene.model, [view], scene.truth, rng=np.random.default_rng(0))
        propose(scene.model, scene.depth, scene.camera, config=FEW, rng=np.random.default_rng(0))
        next(snap_steps(scene.model, scene.depth, scene.camera, scene.truth, SnapConfig.paper()))
    finally:
        sys.setprofile(None)
    names = {
        ".".join(Path(file).relative_to(root).with_suffix("").parts)
        for file in ran
        if root in Path(file).parents
    }
    assert "search.polish" in names and names <= imported(root, ENTRIES).keys()


SNAP = """
import numpy as np
from registration_core import snap
from registration_core.geometry import pose
from tests.registration_core.simple_scene import standing_tool
scene = standing_tool()
start = pose.perturbed(scene.truth, 0.03, 0.4, np.random.default_rng(0))
estimate = snap(scene.model, scene.depth, scene.camera, start, rng=np.random.default_rng(1))
print(estimate.T_camera_object.tobytes().hex(), estimate.confidence, estimate.covariance.tobytes().hex())
"""


def test_how_many_threads_there_are_makes_no_difference():
    results = set()
    for threads in ("1", "3"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
        done = subprocess.run(
            [sys.executable, "-c", SNAP],
            cwd=Path(__file__).parents[2],
            env={**os.environ, **dict.fromkeys(names, threads)},
            capture_output=True,
            text=True,
            check=True,
        )
        results.add(done.stdout)
    assert len(results) == 1
