"""The seed that makes a randomised method repeat itself."""

import numpy as np


def seed_of(rng: np.random.Generator | None) -> int:
    """A seed s such that a snap with `default_rng(s)` does the same as one with `rng`.

    A generator that comes fresh from `default_rng(s)` has the seed s; from any other one a seed is drawn.
    """
    if rng is None:
        return int(np.random.default_rng().integers(2**53))
    drawn = int(rng.integers(2**53))
    entropy = getattr(rng.bit_generator.seed_seq, "entropy", None)
    if isinstance(entropy, int) and entropy < 2**64:
        fresh = np.random.default_rng(entropy)
        if int(fresh.integers(2**53)) == drawn and fresh.bit_generator.state == rng.bit_generator.state:
            return entropy
    return drawn
