"""What workers build of objects before they can look for them: built once for all who ask, and kept."""

import logging
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError
from concurrent.futures import Future as Promise
from dataclasses import dataclass, field

from distributed import Future

from app.storage.files import PreparedStore
from registration_core import ObjectModel
from registration_core.search.viewpoint_model import unpacked

logger = logging.getLogger(__name__)


@dataclass
class _Build:
    """One object that is being built."""

    promise: Promise[bytes] = field(default_factory=Promise)
    future: Future | None = None
    """Kept, since a worker drops what nobody holds on to."""


class PreparedObjects:
    """Out of the store, or else from a worker.

    Args:
        store: Where they are kept.
        submit: Hands an object to a worker, which builds it; the number is its priority.
        later: Calls a function in a thread that may wait for the scheduler.
    """

    def __init__(
        self,
        store: PreparedStore,
        submit: Callable[[ObjectModel, int], Future],
        later: Callable[..., None],
    ) -> None:
        self._store = store
        self._submit = submit
        self._later = later
        self._builds: dict[str, _Build] = {}
        self._lock = threading.Lock()

    def read(self, model_hash: str) -> bytes | None:
        """What was built of an object before; None where nothing was that can be read."""
        content = self._store.read(model_hash)
        if content is None:
            return None
        try:
            unpacked(content)
        except ValueError as error:
            logger.warning("object %s is built anew: %s", model_hash[:12], error)
            return None
        return content

    def get(self, model: ObjectModel, priority: int) -> Promise[bytes]:
        """What was built of an object, as `viewpoint_model.packed`: who asks meanwhile joins the one build.

        Reads a file and may wait for the scheduler, so it has no place in an operator's way. The promise may
        hold a ValueError, where the object cannot be looked for, and whatever befalls jobs.
        """
        model_hash = model.content_hash
        with self._lock:
            under_way = self._builds.get(model_hash)
            if under_way is not None:
                return under_way.promise
            build = self._builds[model_hash] = _Build()
        try:
            content = self.read(model_hash)
            if content is None:
                build.future = self._submit(model, priority)
                build.future.add_done_callback(lambda done: self._later(self._on_built, model_hash, done))
            else:
                self._end(model_hash, content)
        except Exception as error:
            self._end(model_hash, error)
        return build.promise

    def close(self) -> None:
        """Let nobody wait any longer."""
        with self._lock:
            left = list(self._builds)
        for model_hash in left:
            self._end(model_hash, CancelledError())

    def _on_built(self, model_hash: str, future: Future) -> None:
        try:
            content = future.result()
        except Exception as error:
            self._end(model_hash, error)
            return
        try:
            self._store.put(model_hash, content)
        except OSError as error:  # a full disk costs time later, and no snap now
            logger.warning("what was built of an object could not be kept: %s", error)
        self._end(model_hash, content)

    def _end(self, model_hash: str, outcome: bytes | BaseException) -> None:
        with self._lock:
            build = self._builds.pop(model_hash, None)
        if build is None:
            return
        if isinstance(outcome, bytes):
            build.promise.set_result(outcome)
        else:
            build.promise.set_exception(outcome)
