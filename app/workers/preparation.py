"""Has the objects of all datasets built before anybody snaps to them, one after another, and suggests the
symmetries of those that an older version imported.
"""

import json
import logging
import threading

from sqlalchemy import select

from app.datasets.scene_data import SceneData
from app.datasets.symmetries import keep_suggestions, never_looked_into, suggest
from app.storage.database import Database
from app.storage.files import DamagedFileError
from app.storage.tables import Object
from app.workers import jobs
from app.workers.pool import Snapper

logger = logging.getLogger(__name__)

KNOWN_AHEAD = jobs.KEPT_OBJECTS // 2
"""The newest objects, which workers know before anybody opens a task; the other half of what they keep is for
those that somebody does open."""

SECONDS_TO_END = 30
"""That its end is waited for, at most; it ends when it is done with the object that it is at."""

Key = tuple[str, str, str]
"""All that what is built of an object depends on, as its row has it."""


class Preparation:
    """Looks for objects that workers have not built yet, and lets them do so; then for symmetries of those
    that an older version imported.

    What is built is kept at once, so a server that is stopped goes on where it was; and what was built by
    another algorithm counts as missing, so an update has all of it built again.

    Args:
        database: With the objects.
        data: Their meshes.
        snapper: With the workers.
    """

    def __init__(self, database: Database, data: SceneData, snapper: Snapper) -> None:
        self._database = database
        self._data = data
        self._snapper = snapper
        self._hashes: dict[Key, str] = {}
        """`ObjectModel.content_hash` of the objects that are prepared."""
        self._problems: dict[Key, str] = {}
        """Why objects cannot be, whenever one tries."""
        self._damages: dict[Key, str] = {}
        """Why objects cannot be until their file is mended."""
        self._wanted = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="preparation", daemon=True)

    def start(self) -> None:
        """Begin with what there is."""
        self._wanted.set()
        self._thread.start()

    def look(self) -> None:
        """Say that there may be new objects, or new symmetries."""
        self._wanted.set()

    def is_prepared(self, item: Object) -> bool:
        """Whether workers have built what snaps need of an object."""
        return _key(item) in self._hashes

    def problem(self, item: Object) -> str | None:
        """Why an object cannot be snapped to, in one sentence; None where nothing speaks against it."""
        return self._problems.get(_key(item)) or self._damages.get(_key(item))

    def close(self) -> None:
        """Take up nothing more. What workers are at ends with the snapper."""
        self._closed = True
        self._wanted.set()

    def join(self) -> None:
        """Wait until it has ended, after it and the snapper were closed: it is in the database no more."""
        if self._thread.is_alive():
            self._thread.join(SECONDS_TO_END)

    def _run(self) -> None:
        try:
            self._snapper.wait_until_ready()
        except Exception:  # the server stops then, and says so
            return
        while self._wanted.wait() and not self._closed:
            self._wanted.clear()
            try:
                self._prepare_all()
                self._suggest_all()
            except Exception:  # what is missing is looked for again
                if not self._closed:
                    logger.exception("objects could not be prepared")

    def _prepare_all(self) -> None:
        with self._database.read() as session:
            items = session.scalars(select(Object).order_by(Object.id.desc())).all()
        for number, item in enumerate(items):
            if self._closed:
                return
            if not self.is_prepared(item) and _key(item) not in self._problems:
                self._prepare(item, number < KNOWN_AHEAD)
        hashes = [self._hashes[key] for key in map(_key, items) if key in self._hashes]
        self._snapper.hand_over(hashes[:KNOWN_AHEAD])  # to workers that came meanwhile

    def _suggest_all(self) -> None:
        with self._database.read() as session:
            items = {item.mesh_hash: item for item in never_looked_into(session)}
        for mesh_hash, item in items.items():
            if self._closed:
                return
            if self.problem(item) is not None:
                continue
            try:
                found = suggest(self._database, {mesh_hash: self._data.model(item)})
            except Exception as error:  # it stops no other; the next look tries again
                logger.warning("symmetries of object %d could not be looked for: %s", item.id, error)
                continue
            with self._database.write() as session:
                keep_suggestions(session, found)

    def _prepare(self, item: Object, ahead: bool) -> None:
        try:
            model = self._data.model(item)
            self._snapper.built(model).result()
            if ahead:
                self._snapper.hand_over([model.content_hash])
        except ValueError as error:
            self._problems[_key(item)] = f"{item.name} cannot be snapped to: {error}."
        except DamagedFileError as error:
            self._damages[_key(item)] = f"{item.name} cannot be snapped to: {error}."
        except Exception as error:  # a worker died, or cannot be reached: the next look tries again
            if not self._closed:
                logger.warning("object %d could not be prepared: %s", item.id, error)
        else:
            self._hashes[_key(item)] = model.content_hash
            self._damages.pop(_key(item), None)


def _key(item: Object) -> Key:
    return item.mesh_hash, item.mesh_format, json.dumps(item.symmetries, sort_keys=True)
