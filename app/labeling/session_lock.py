"""One at a time: whoever acts on a session is alone with it, and all who listen are told what came of it."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import ParamSpec

from app.labeling.session_state import SessionState

P = ParamSpec("P")
Listener = Callable[[SessionState], None]


class SessionLock:
    """The lock of a session, and its listeners.

    Args:
        settle: Lets what follows the session catch up with a change, before it is told.
        state: The state to tell.
    """

    def __init__(self, settle: Callable[[], None], state: Callable[[], SessionState]) -> None:
        self._settle = settle
        self._state = state
        self._listeners: list[Listener] = []
        self.held = threading.RLock()
        """Held by whoever looks at the session or acts on it."""
        self.revision = time.time_ns() // 1_000_000
        self.last_used = time.monotonic()

    @contextmanager
    def change(self) -> Iterator[None]:
        """Alone with the session until the block ends; then all are told, unless it failed."""
        with self.held:
            yield
            self.notify()

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """As `change`, but all are told where it failed as well."""
        with self.held:
            try:
                yield
            finally:
                self.notify()

    def report(self, report: Callable[P, None]) -> Callable[P, None]:
        """Workers report from any thread: let each in alone, and tell what it changed."""

        def run(*args: P.args, **kwargs: P.kwargs) -> None:
            with self.attempt():
                report(*args, **kwargs)

        return run

    def notify(self) -> None:
        """Tell the listeners the present state, as a newer one; whoever calls this is alone."""
        self.last_used = time.monotonic()
        self._settle()
        self.revision += 1
        state = self._state()
        for listener in tuple(self._listeners):
            listener(state)

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Call `listener` with every state that is told; returns a function that ends that."""
        with self.held:
            self._listeners.append(listener)

        def unsubscribe() -> None:
            with self.held:
                if listener in self._listeners:  # closing the session ended it before
                    self._listeners.remove(listener)

        return unsubscribe

    def end(self) -> None:
        """Tell nobody any more."""
        self._listeners.clear()
