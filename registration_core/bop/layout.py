"""Where things lie in a BOP dataset, and where the dataset lies in what somebody packed."""

from collections.abc import Iterator
from pathlib import Path

from registration_core.bop.fields import BopFormatError, is_id, is_name, name_of

DEEPEST_ROOT = 4
"""Folders in folders that are looked through for a dataset."""
MOST_FOLDERS = 5000
"""That are looked through."""
LONGEST_SPLIT = 50
"""Characters of a split's name."""

SYSTEM_FILES = frozenset({"__macosx", "thumbs.db", "desktop.ini"})
"""What Finder and Explorer leave behind, beside names that begin with a dot."""
PACKED = (".zip", ".tar", ".gz", ".tgz", ".7z", ".rar")
SCENE_PARTS = ("scene_camera*.json", "scene_gt*.json", "depth*", "rgb*", "gray*")
"""One of these makes a numbered folder a scene."""


def find_root(folder: Path) -> Path:
    """The folder of the one dataset in a folder: itself, or one further in.

    Raises:
        BopFormatError: where there is none, saying what was found instead, or more than one.
    """
    if not folder.is_dir():
        raise BopFormatError(f"{folder} is no folder; give the folder of a BOP dataset")
    roots = [found for found in _folders(folder) if is_root(found)]
    roots = [root for root in roots if not any(other in root.parents for other in roots)]
    if len(roots) > 1:
        names = ", ".join(name_of(root, folder) for root in roots[:5])
        raise BopFormatError(f"there are {len(roots)} datasets ({names}); import them one by one")
    return roots[0] if roots else _likely_root(folder)


def is_root(folder: Path) -> bool:
    """Whether a folder holds models and scenes as a dataset does."""
    return any(mesh_files(folder)) and any(scene_folders(folder))


def mesh_files(root: Path) -> Iterator[Path]:
    """The mesh files of a dataset, in order."""
    models = root / "models"
    if models.is_dir():
        yield from (
            path
            for path in sorted(models.iterdir())
            if path.name.startswith("obj_") and path.suffix.lower() == ".ply" and path.is_file()
        )


def scene_folders(root: Path) -> Iterator[Path]:
    """The scenes of every split, in order; other numbered folders are none."""
    for split in _subfolders(root):
        yield from (folder for folder in _subfolders(split) if folder.name.isdigit() and _is_scene(folder))


def find_scene_folders(root: Path) -> list[Path]:
    """The same, checked.

    Raises:
        BopFormatError: where there is none, two are one scene, or a name cannot be kept.
    """
    folders = list(scene_folders(root))
    if not folders:
        raise BopFormatError(f"{root.name} has no scene{_instead_of_scenes(root)}")
    found: dict[tuple[str, int], Path] = {}
    for folder in folders:
        name = name_of(folder, root)
        if not is_id(folder.name):
            raise BopFormatError(f"{name[:80]} must be named by a number of at most 9 digits, as test/000001")
        if not is_name(folder.parent.name, LONGEST_SPLIT):
            raise BopFormatError(
                f"{name[:80]!r}: a split's name must be at most {LONGEST_SPLIT} readable characters"
            )
        other = found.setdefault((folder.parent.name, int(folder.name)), folder)
        if other is not folder:
            raise BopFormatError(f"{name_of(other, root)} and {name} are one scene; keep one of them")
        if not (folder / "scene_camera.json").exists():
            _refuse_other_layout(folder, name)
    return folders


def _is_scene(folder: Path) -> bool:
    return any(next(folder.glob(part), None) is not None for part in SCENE_PARTS)


def _likely_root(folder: Path) -> Path:
    """Where the dataset would be, so that what is missing there can be told."""
    folders = list(_folders(folder))
    with_models = [found for found in folders if any(mesh_files(found))]
    with_scenes = [found for found in folders if any(scene_folders(found))]
    return next(iter(with_models + with_scenes), folder)


def _folders(top: Path) -> Iterator[Path]:
    """A folder and those in it, the outer ones first."""
    level, seen = [top], 0
    for _ in range(DEEPEST_ROOT + 1):
        for folder in level:
            seen += 1
            if seen > MOST_FOLDERS:
                return
            yield folder
        level = [inner for folder in level for inner in _subfolders(folder)]


def _subfolders(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.is_dir() and not is_of_system(path.name))


def is_of_system(name: str) -> bool:
    """Whether a file's or folder's name is one that belongs to no dataset."""
    return name.startswith(".") or name.lower() in SYSTEM_FILES


def instead_of_models(root: Path) -> str:
    """What to say where a dataset has no mesh: what is there instead, and what to do."""
    others = sorted(path.name for path in _subfolders(root) if path.name.startswith("models_"))
    if others:
        return f"; there is {' and '.join(others)}: copy the one to be used to models"
    meshes = sorted(path.name for path in (root / "models").glob("*") if path.is_file())
    if meshes:
        return f" named obj_000001.ply; there is {_some(meshes)}: save meshes so, in millimetres"
    return "; put meshes there as obj_000001.ply, in millimetres"


def _instead_of_scenes(root: Path) -> str:
    """What to say where a dataset has no scene."""
    for split in _subfolders(root):
        shards = sorted(path.name for path in split.glob("*.tar"))
        if shards or (split / "key_to_shard.json").exists():
            return _to_convert(split, f"webdataset shards ({_some(shards)})")
        single = sorted(path.name for path in split.glob("*.camera.json"))
        if single:
            return _to_convert(split, f"single images ({_some(single)})")
    packed = sorted(path.name for path in root.iterdir() if path.suffix.lower() in PACKED)
    if packed:
        return f"; unpack {_some(packed)} first"
    return "; put scenes into numbered folders with a scene_camera.json, as test/000001"


def _to_convert(split: Path, what: str) -> str:
    return f": {split.name} holds {what}, which are not read; convert them to folders as {split.name}/000001"


def _refuse_other_layout(folder: Path, name: str) -> None:
    """Raise where a scene is laid out in a way that is not read."""
    by_camera = sorted(path.stem for path in folder.glob("scene_camera_*.json"))
    if by_camera:
        camera = by_camera[0].removeprefix("scene_camera_")
        raise BopFormatError(
            f"{name} keeps its files by camera ({by_camera[0]}.json), which is not read; make a dataset of"
            f" one camera: rename its files and folders to names without _{camera}"
        )


def _some(names: list[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
