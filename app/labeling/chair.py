"""The place before a session: for one open page at a time, and the newest gets it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class _Sitter:
    page: str
    give_way: Callable[[], None]


class Chair:
    """Tells a page when another one has taken its place."""

    def __init__(self) -> None:
        self._sitter: _Sitter | None = None
        self._lock = threading.Lock()

    def sit(self, page: str, give_way: Callable[[], None]) -> Callable[[], None]:
        """Take the place; whoever had it is told to give way, unless it is the same page that came back.

        Args:
            page: The page's name, which is its own.
            give_way: Called once, from any thread, when another page comes; it must be quick.

        Returns:
            A function that leaves the place.
        """
        sitter = _Sitter(page, give_way)
        with self._lock:
            before, self._sitter = self._sitter, sitter
        if before is not None and before.page != page:
            before.give_way()

        def stand_up() -> None:
            with self._lock:
                if self._sitter is sitter:
                    self._sitter = None

        return stand_up
