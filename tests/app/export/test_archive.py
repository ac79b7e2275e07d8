"""Zips of one content are equal, byte by byte."""

import os
import zipfile
from pathlib import Path

from app.export.archive import pack

FILES = {"camera.json": b'{"a": 1}' * 100, "test/000001/depth/000000.png": b"pixels" * 100, "b/c.ply": b""}


def folder_of(parent: Path, names: list[str], when: float) -> Path:
    folder = parent / "data"
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(FILES[name])
        path.chmod(0o600 if when else 0o644)
        os.utime(path, (when, when))
    return folder


def test_order_of_writing_times_and_permissions_do_not_matter(tmp_path: Path) -> None:
    first = folder_of(tmp_path / "1", sorted(FILES), 1e9)
    second = folder_of(tmp_path / "2", sorted(FILES, reverse=True), 0.0)
    pack(first, tmp_path / "1.zip", lambda share: None)
    pack(second, tmp_path / "2.zip", lambda share: None)
    assert (tmp_path / "1.zip").read_bytes() == (tmp_path / "2.zip").read_bytes()


def test_names_are_sorted_under_the_folder_and_pictures_are_stored(tmp_path: Path) -> None:
    shares: list[float] = []
    pack(folder_of(tmp_path, list(FILES), 1e9), tmp_path / "x.zip", shares.append)
    with zipfile.ZipFile(tmp_path / "x.zip") as zipped:
        assert zipped.namelist() == [f"data/{name}" for name in sorted(FILES)]
        assert {name: zipped.read(f"data/{name}") for name in FILES} == FILES
        kinds = {entry.filename: entry.compress_type for entry in zipped.infolist()}
    assert kinds["data/test/000001/depth/000000.png"] == zipfile.ZIP_STORED
    assert kinds["data/camera.json"] == zipfile.ZIP_DEFLATED
    assert shares[-1] == 1.0 and shares == sorted(shares)
