"""Giving memory back to the system: Python frees it, but the C library tends to keep it."""

import ctypes
import gc
import sys

LARGE_BLOCK = 1 << 20
"""Bytes from which on a block is mapped on its own."""
MMAP_THRESHOLD = -3
"""glibc's name for that limit: M_MMAP_THRESHOLD of malloc.h."""


def keep_large_blocks_apart() -> None:
    """Have large arrays go back to the system as soon as they are freed; call it once, before there are any.

    glibc raises its limit when large blocks are freed, up to 32 MB; point clouds then lie in the heap between
    small things and cannot be given back.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, LARGE_BLOCK)


def give_back() -> None:
    """Free what only garbage refers to, and hand free memory back; takes a tenth of a second."""
    gc.collect()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
