"""What a result was computed on: with another processor its last digits may differ."""

import platform
from functools import cache


@cache
def hardware() -> str:
    """Names the machine that this process computes on."""
    return f"{platform.machine()} {platform.processor() or 'cpu'} on {platform.node()}"
