"""The place before a session: for one open page at a time, and the newest gets it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class _Sitter:
    page: str
    give_way: Callable[[], None]


class Chair:
    """Tells a page when another one has taken its place, be it while that page was away."""

    def __init__(self) -> None:
        self._sitter: _Sitter | None = None
        self._newest: str | None = None
        self._outdated: set[str] = set()
        self._lock = threading.Lock()

    @property
    def is_taken(self) -> bool:
        """Whether a page is there now."""
        return self._sitter is not None

    def sit(self, page: str, give_way: Callable[[], None]) -> Callable[[], None]:
        """Take the place; whoever had it is told to give way, unless it is the same page that came back.

        A page that lost its connection and comes back after a newer one has come is itself told, at once.

        Args:
            page: The page's name, which is its own.
            give_way: Called once, from any thread, when another page comes; it must be quick.

        Returns:
            A function that leaves the place.
        """
        sitter = _Sitter(page, give_way)
        with self._lock:
            before = self._take(sitter)
        if before is not None:
            before.give_way()

        def stand_up() -> None:
            with self._lock:
                if self._sitter is sitter:
                    self._sitter = None

        return stand_up

    def _take(self, sitter: _Sitter) -> _Sitter | None:
        """Seat somebody; returns who has to give way."""
        if sitter.page in self._outdated:
            return sitter
        if self._newest not in (None, sitter.page):
            self._outdated.add(self._newest)
        self._newest = sitter.page
        before, self._sitter = self._sitter, sitter
        return before if before is not None and before.page != sitter.page else None
