"""A dataset folder that went all the way: imported, labelled with its own poses, exported."""

from pathlib import Path

from sqlalchemy import select

from app.datasets.importing import import_dataset
from app.export.job import export_dataset
from app.storage.files import FileStore
from app.storage.tables import Registration, Task, User
from tests.app.empty_database import new_empty_database
from tests.app.export.site import START, ignore_progress


def labelled_export(source: Path, folder: Path) -> Path:
    """Import a dataset, submit every known pose, export it."""
    database, files = new_empty_database(folder), FileStore(folder / "files")
    dataset_id = import_dataset(database, files, source).dataset_id
    with database.write() as session:
        user = User(name="Ada Lovelace", role="operator")
        session.add(user)
        session.flush()
        for task in session.scalars(select(Task)):
            session.add(
                Registration(
                    task_id=task.id,
                    user_id=user.id,
                    state="submitted",
                    T_world_object=task.T_world_object_reference,
                    submitted_at=START,
                )
            )
    export_dataset(database, files, dataset_id, folder / "export", ignore_progress)
    database.close()
    return folder / "export"
