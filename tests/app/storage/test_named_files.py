"""What damaged files are to people: their owner by name, and how they are mended."""

from pathlib import Path

import pytest
from sqlalchemy import select

from app.datasets.importing import import_dataset
from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.storage.files import DamagedFileError, FileStore
from app.storage.named_files import named_files, open_store
from app.storage.tables import Export, Frame, Object, User


@pytest.fixture
def store(database: Database, files: FileStore, demo: Path) -> FileStore:
    """That of the small dataset."""
    import_dataset(database, files, demo)
    return open_store(files.root, database)


def damage(files: FileStore, digest: str) -> None:
    path = files.path(digest)
    content = bytearray(path.read_bytes())
    content[-20] ^= 255
    path.write_bytes(content)


def test_all_files_of_a_dataset_are_named(store, database):
    with database.read() as session:
        named = list(named_files(session))
    on_disk = {path.name for path in store.root.rglob("*") if path.is_file()}
    assert {file.digest for file in named} == on_disk and len(named) == 2 + 2 * 3


def test_a_damaged_file_is_told_by_its_owner_and_mended_by_another_import(store, database, demo):
    with database.read() as session:
        frame = session.scalars(select(Frame).order_by(Frame.id)).first()
        item = session.scalars(select(Object).order_by(Object.id)).first()
    for digest in (frame.depth_hash, frame.color_hash, item.mesh_hash):
        damage(store, digest)
    data = SceneData(store)
    again = "import dataset 'tools' again, which puts it back"
    image = f"image {frame.image_id} in scene 1 of dataset 'tools'"
    for reads, what in (
        (lambda: data.depth(frame), f"the depth image of {image}"),
        (lambda: data.color(frame), f"the colour image of {image}"),
        (lambda: data.model(item), f"the mesh of object {item.name!r} of dataset 'tools'"),
    ):
        with pytest.raises(DamagedFileError) as raised:
            reads()
        message = str(raised.value)
        assert message.startswith(f"{what} is damaged on the disk (file ") and message.endswith(again)
    summary = import_dataset(database, store, demo)
    assert (summary.objects, summary.frames) == (0, 0)
    color = data.color(frame)
    assert color is not None and color.any()
    assert data.depth(frame).any() and len(data.model(item).faces) > 0


def test_the_archive_of_an_export_is_made_again(store, database):
    digest = store.put_bytes(b"zip")
    with database.write() as session:
        session.add(User(name="ann", role="admin"))
        session.flush()
        session.add(Export(dataset_id=1, format="bop", user_id=1, state="done", file_hash=digest))
    store.path(digest).unlink()
    for reader in (store.path, store.size):
        with pytest.raises(DamagedFileError) as raised:
            reader(digest)
        assert str(raised.value) == (
            f"the archive of export 1 is missing on the disk (file {digest[:12]});"
            " export dataset 'tools' again"
        )
