"""Which of the poses that operators passed through are snapped: all, or fewer where a snap takes seconds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from app.storage.tables import Method
from app.study.offline.samples import Sample
from registration_core.geometry import pose

ROUNDING = 1e-6
"""Seconds."""


@dataclass(frozen=True)
class Sampling:
    """A coarser choice among the samples of a registration; the first and the last are always in it.

    The last is what the operator submitted, whose snap tells what a snap would have gained at the end. A
    limit of 0 is none.
    """

    seconds: float = 0.0
    """A sample counts where it comes this long after the one that was chosen before, ..."""
    translation: float = 0.0
    """... and the object has moved by this much since, metres, ..."""
    rotation: float = 0.0
    """... or been turned by this much, radians."""

    def of(self, samples: Sequence[Sample]) -> list[Sample]:
        """The samples of one registration, in their order, that are to be snapped."""
        chosen: list[Sample] = []
        for sample in samples:
            if not chosen or sample is samples[-1] or self._is_apart(chosen[-1], sample):
                chosen.append(sample)
        return chosen

    def __str__(self) -> str:
        """Says which poses are snapped."""
        moved = [f"{1000 * self.translation:g} mm"] if self.translation else []
        moved += [f"{math.degrees(self.rotation):g}°"] if self.rotation else []
        apart = f"at least {self.seconds:g} s apart"
        return f"{apart} and moved by {' or '.join(moved)}" if moved else apart

    def _is_apart(self, before: Sample, sample: Sample) -> bool:
        moved = pose.distance(before.T_world_object, sample.T_world_object)
        limits = ((moved.translation, self.translation), (moved.rotation, self.rotation))
        enough = [much >= limit for much, limit in limits if limit > 0.0]
        return sample.seconds - before.seconds >= self.seconds - ROUNDING and (not enough or any(enough))


SAMPLINGS: Mapping[Method, Sampling] = {
    "default": Sampling(),
    "paper": Sampling(2.0, 0.005, math.radians(5.0)),
}
"""All poses with the default; with the paper's filter as many as two cores snap overnight, of 128 trials."""
