"""Laws of giving memory back, each in a process of its own: the C library's settings are a process's."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="glibc's memory is what this is about")

SCRIPT = """
import numpy, psutil
from app.serving import memory

def resident(): return psutil.Process().memory_info().rss

SETUP
before = resident()
numpy.ones(30_000_000, dtype=numpy.uint8)
arrays, small = [], []
for _ in range(60):
    arrays.append(numpy.ones(4_000_000, dtype=numpy.uint8))
    small.append(numpy.ones(50_000, dtype=numpy.uint8))
del arrays
END
print((resident() - before) / 1e6)
"""


def kept_megabytes(setup: str, end: str) -> float:
    """What stays of 240 MB of large arrays that lay among 3 MB of small ones."""
    script = SCRIPT.replace("SETUP", setup).replace("END", end)
    plain = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, env=plain)
    return float(done.stdout)


def test_large_arrays_go_back_to_the_system_when_they_are_freed() -> None:
    assert kept_megabytes("memory.keep_large_blocks_apart()", "") < 20


def test_free_memory_is_given_back_on_demand() -> None:
    kept = kept_megabytes("", "")
    assert kept > 100, "without either, the C library keeps what was freed"
    assert kept_megabytes("", "memory.give_back()") < 20
