"""What time it is, as logs tell it."""

import time
import uuid
from datetime import datetime

from app.storage.tables import utc_now

BOOT_ID = uuid.uuid4().hex
"""Names this run of the server: monotonic seconds are comparable only within one run."""

SIMULATED = "simulated-"
"""How runs are named whose time is simulated."""


class Clock:
    """This process's clock."""

    @property
    def boot_id(self) -> str:
        """Names the run within which monotonic seconds are comparable."""
        return BOOT_ID

    def monotonic(self) -> float:
        """Seconds that never go back."""
        return time.monotonic()

    def utc(self) -> datetime:
        """The present moment."""
        return utc_now()
