"""Datasets in zip files: what is taken in, and what is refused without a trace."""

import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from app.datasets.archives import import_archive
from registration_core.bop.writer import write_json
from tests.app.imports import added, everything
from tests.app.small_dataset import POSED_SCENE

MEGABYTES = 64 * 2**20


def pack(folder: Path, archive: Path, prefix: str = "", compression: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(archive, "w", compression) as target:
        for path in sorted(folder.rglob("*")):
            target.write(path, f"{prefix}{path.relative_to(folder).as_posix()}")
    return archive


@pytest.mark.parametrize(("prefix", "name"), [("", "upload"), ("tools/", "tools")], ids=["top", "folder"])
def test_an_archive_is_taken_in(database, files, demo, tmp_path, prefix, name):
    archive = pack(demo, tmp_path / "x.zip", prefix)
    summary = import_archive(database, files, archive, "upload", MEGABYTES)
    assert (summary.name, *added(summary)) == (name, 2, 2, 3, 4)
    assert [path for path in tmp_path.iterdir() if path.is_dir()] == [files.root]


def test_an_entry_for_the_folder_itself_does_not_matter(database, files, demo, tmp_path):
    archive = pack(demo, tmp_path / "x.zip")
    with_entry("./", b"", stat.S_IFDIR | 0o755)(archive)
    assert added(import_archive(database, files, archive, "upload", MEGABYTES)) == (2, 2, 3, 4)


def test_what_a_mac_adds_does_not_matter(database, files, demo, tmp_path):
    archive = pack(demo, tmp_path / "x.zip", "tools/")
    with zipfile.ZipFile(archive, "a") as target:
        target.writestr("__MACOSX/tools/._models", b"x")
    assert import_archive(database, files, archive, "upload", MEGABYTES).name == "tools"


def with_entry(
    name: str, content: bytes = b"x", mode: int = stat.S_IFREG | 0o644
) -> Callable[[Path], object]:
    def add(archive: Path) -> None:
        entry = zipfile.ZipInfo(name)
        entry.external_attr = mode << 16
        with zipfile.ZipFile(archive, "a") as target:
            target.writestr(entry, content)

    return add


def spoil_bytes(archive: Path) -> None:
    """Damage the packed content of an entry; the list of entries stays sound."""
    with zipfile.ZipFile(archive) as source:
        entry = max(source.infolist(), key=lambda item: item.file_size - item.compress_size)
    content = bytearray(archive.read_bytes())
    begin = entry.header_offset + 30 + len(entry.filename)
    content[begin : begin + entry.compress_size] = b"\xff" * entry.compress_size
    archive.write_bytes(content)


def encrypt_flag(archive: Path) -> None:
    """Say of every entry that it is encrypted."""
    content = archive.read_bytes()
    for signature, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        parts = content.split(signature)
        flagged = [part[: at - 4] + bytes([part[at - 4] | 1]) + part[at - 3 :] for part in parts[1:]]
        content = signature.join([parts[0], *flagged])
    archive.write_bytes(content)


LINK = stat.S_IFLNK | 0o777
BAD_ARCHIVES: dict[str, tuple[Callable[[Path], object], str]] = {
    "no zip": (lambda archive: archive.write_bytes(b"hello " * 100), "no readable zip file"),
    "empty file": (lambda archive: archive.write_bytes(b""), "no readable zip file"),
    "cut off": (lambda archive: archive.write_bytes(archive.read_bytes()[:-200]), "no readable zip file"),
    "damaged": (spoil_bytes, "no readable zip file"),
    "encrypted": (encrypt_flag, "no readable zip file"),
    "climbing": (with_entry("../evil.txt"), "'../evil.txt' leads out of its folder"),
    "climbing inside": (with_entry("test/../../evil.txt"), "leads out of its folder"),
    "climbing backwards": (with_entry("..\\evil.txt"), "leads out of its folder"),
    "absolute": (with_entry("/tmp/evil.txt"), "'/tmp/evil.txt' leads out of its folder"),
    "drive": (with_entry("C:/evil.txt"), "leads out of its folder"),
    "link": (with_entry("test/link", b"/etc/passwd", LINK), "'test/link' leads out of its folder"),
    "file for folder": (with_entry("test/000001"), "'test/000001' cannot be unpacked"),
    "long name": (with_entry("a" * 300), "cannot be unpacked \\(File name too long\\)"),
    "too large": (with_entry("zeros", bytes(70 * 2**20)), "more than 64 MB"),
    "no dataset": (lambda archive: pack(archive.parent / "none", archive), "models has no mesh"),
}


@pytest.mark.parametrize("case", BAD_ARCHIVES)
def test_a_bad_archive_gets_one_sentence_and_leaves_nothing(database, files, demo, tmp_path, case):
    inside = tmp_path / "inside"
    inside.mkdir()
    archive = pack(demo, inside / "x.zip")
    spoil, message = BAD_ARCHIVES[case]
    spoil(archive)
    before = everything(database, files)
    with pytest.raises(ValueError, match=message.replace("/", r"\/")) as caught:
        import_archive(database, files, archive, "upload", MEGABYTES)
    assert "\n" not in str(caught.value)
    assert everything(database, files) == before
    assert [path.name for path in inside.iterdir()] == ["x.zip"]
    assert not list(tmp_path.rglob("evil.txt"))


def test_an_unsound_dataset_in_an_archive_leaves_nothing(database, files, demo_copy, tmp_path):
    write_json(demo_copy / POSED_SCENE / "scene_camera.json", {})
    archive = pack(demo_copy, tmp_path / "x.zip")
    before = everything(database, files)
    with pytest.raises(ValueError, match="names no image"):
        import_archive(database, files, archive, "upload", MEGABYTES)
    assert everything(database, files) == before
