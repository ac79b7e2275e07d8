"""Waiting for something to become true, with a deadline."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

LONGEST = 60.0
"""Seconds; far more than anything here takes, for slow machines."""


def wait_until(look: Callable[[], T | None], what: str, seconds: float = LONGEST) -> T:
    """What `look` returns, as soon as it is true; fails where that takes too long."""
    deadline = time.monotonic() + seconds
    while True:
        found = look()
        if found:
            return found
        assert time.monotonic() < deadline, f"waited {seconds:g} s for {what}"
        time.sleep(0.005)
