"""One more format is one more file: here a dataset whose depth is NumPy arrays in metres."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.datasets.formats import registry
from app.datasets.formats.registry import ImportFormat, as_bop, formats
from app.datasets.importing import import_dataset
from registration_core.bop.dataset import read_dataset


def has_arrays(folder: Path) -> bool:
    return any(folder.glob("test/*/depth/*.npy"))


def with_pictures(folder: Path, work: Path) -> Path:
    """The same with 16-bit PNGs of millimetres."""
    root = work / folder.name
    shutil.copytree(folder, root)
    for path in root.glob("test/*/depth/*.npy"):
        Image.fromarray(np.round(np.load(path) * 1000.0).astype(np.uint16)).save(path.with_suffix(".png"))
        path.unlink()
    return root


@pytest.fixture
def arrays(demo_copy: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The small dataset with arrays for depth, and the format that knows them."""
    for path in demo_copy.glob("test/*/scene_camera.json"):
        cameras = json.loads(path.read_text())
        for image_id, camera in cameras.items():
            picture = path.parent / "depth" / f"{int(image_id):06d}.png"
            np.save(
                picture.with_suffix(".npy"), np.asarray(Image.open(picture)) * camera["depth_scale"] / 1000.0
            )
            picture.unlink()
            camera["depth_scale"] = 1.0
        path.write_text(json.dumps(cameras))
    known = (ImportFormat("npy", has_arrays, with_pictures), *formats())
    monkeypatch.setattr(registry, "formats", lambda: known)
    return demo_copy


def test_bop_is_asked_last():
    assert [one.name for one in formats()].index("bop") == len(formats()) - 1


def test_what_another_format_recognises_comes_in_as_bop(arrays, database, files):
    summary = import_dataset(database, files, arrays)
    assert summary.name == arrays.name and summary.frames > 0
    assert not [path for path in files.root.iterdir() if path.name.startswith(".unfinished")]


def test_what_none_recognises_is_said_as_for_bop(tmp_path):
    (tmp_path / "notes.txt").touch()
    with pytest.raises(ValueError, match="models"):
        read_dataset(as_bop(tmp_path, tmp_path / "work"))
