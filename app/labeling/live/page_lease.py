"""The lease of a session: one open page at a time holds it, and the newest gets it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class _Holder:
    page: str
    on_taken_over: Callable[[], None]


class PageLease:
    """Notifies a page when another one has taken the lease, be it while that page was away."""

    def __init__(self) -> None:
        self._holder: _Holder | None = None
        self._newest: str | None = None
        self._outdated: set[str] = set()
        self._lock = threading.Lock()

    @property
    def is_taken(self) -> bool:
        """Whether a page holds it now."""
        return self._holder is not None

    def take(self, page: str, on_taken_over: Callable[[], None]) -> Callable[[], None]:
        """Take the lease; the page that held it is notified, unless it is the same page that came back.

        A page that lost its connection and comes back after a newer one has come is itself notified, at once.

        Args:
            page: The page's name, which is its own.
            on_taken_over: Called once, from any thread, when another page comes; it must be quick.

        Returns:
            A function that releases the lease.
        """
        holder = _Holder(page, on_taken_over)
        with self._lock:
            before = self._replace(holder)
        if before is not None:
            before.on_taken_over()

        def release() -> None:
            with self._lock:
                if self._holder is holder:
                    self._holder = None

        return release

    def _replace(self, holder: _Holder) -> _Holder | None:
        """LiveSession somebody; returns who has to give way."""
        if holder.page in self._outdated:
            return holder
        if self._newest not in (None, holder.page):
            self._outdated.add(self._newest)
        self._newest = holder.page
        before, self._holder = self._holder, holder
        return before if before is not None and before.page != holder.page else None
