"""The feature table: all that the fitted numbers follow from, small enough to be kept beside the code.

The judge's weights follow from the candidates. The decisions are what the judge with these weights makes of
all trials; the confidence, the rounds' thresholds and the acceptance follow from them.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from registration_core.fitting.ranking import Choice, fitted_weights, judged_features
from registration_core.fitting.replay import TEMPERATURES, Decision
from registration_core.fitting.trials import Trial
from registration_core.judge import pixel_evidence as evidence

Array = NDArray[np.float64]

PATH = Path(__file__).with_name("table.npz")
HARD, EASY = 20, 10
"""Candidates of a trial that are kept beside the start, its polishes and the best one that is wanted: those
that would come nearest to winning, and some spread over the rest, or nothing would hold those back."""
FIRST_RIDGE = 0.01
"""Of the ranking that finds those."""
UNIT = 1.0 / 256.0
"""In which features are stored, as whole numbers."""


@dataclass(frozen=True, eq=False)
class FeatureTable:
    """Candidates and decisions of all trials, one after the other, and what the trials are of."""

    features: NDArray[np.int16]
    """(N, F), judged features in UNITs."""
    right: NDArray[np.bool_]
    """(N,), as `Choice.right` has it."""
    exact: NDArray[np.bool_]
    """(N,), the same for `Choice.exact`."""
    lengths: NDArray[np.int32]
    """(T,), candidates of each trial."""
    families: NDArray[np.str_]
    """(T,)."""
    kinds: NDArray[np.str_]
    """(T,)."""
    beliefs: NDArray[np.float32]
    """(T, R, len(TEMPERATURES)), near the winner after the polish and after each round."""
    scores: NDArray[np.float32]
    """(T, R), the winner's."""
    counts: NDArray[np.int16]
    """(T, R, COUNT), the winner's, in UNITs."""
    spreads: NDArray[np.float32]
    """(T, R), of the winner's surface."""
    won_right: NDArray[np.bool_]
    """(T, R), whether its mean distance is small enough."""
    won_exact: NDArray[np.bool_]
    """(T, R), whether its largest distance is."""

    def choices(self) -> list[Choice]:
        """The trials, as a ranking is fitted to them."""
        ends = np.cumsum(self.lengths)
        parts = [
            np.split(values, ends[:-1]) for values in (from_units(self.features), self.right, self.exact)
        ]
        return [Choice(*candidates) for candidates in zip(*parts, strict=True)]

    def hash(self) -> str:
        """Of the content, not of how it is packed."""
        digest = hashlib.sha256()
        for field in fields(self):
            values = getattr(self, field.name)
            digest.update(
                "\n".join(values.tolist()).encode() if values.dtype.kind == "U" else values.tobytes()
            )
        return digest.hexdigest()

    def write(self, path: Path = PATH) -> None:
        """Write it, compressed."""
        np.savez_compressed(path, **{field.name: getattr(self, field.name) for field in fields(self)})


def read_table(path: Path = PATH) -> FeatureTable:
    """The table in a file."""
    with np.load(path) as arrays:
        return FeatureTable(**{name: arrays[name] for name in arrays.files})


def table_of(trials: Sequence[Trial]) -> FeatureTable:
    """The candidates that decide, found by a first ranking over all; decisions are still to be made."""
    choices = [Choice(judged_features(one.counts, one.tails), one.right, one.exact) for one in trials]
    weights = fitted_weights(choices, FIRST_RIDGE)
    kept = [_deciding(choice, one.near, weights) for choice, one in zip(choices, trials, strict=True)]
    parts = [choice.features[rows] for choice, rows in zip(choices, kept, strict=True)]
    nothing = np.zeros((0, 0))
    return FeatureTable(
        features=in_units(np.concatenate(parts)),
        right=np.concatenate([choice.right[rows] for choice, rows in zip(choices, kept, strict=True)]),
        exact=np.concatenate([choice.exact[rows] for choice, rows in zip(choices, kept, strict=True)]),
        lengths=np.array([len(rows) for rows in kept], dtype=np.int32),
        families=np.array([one.family for one in trials]),
        kinds=np.array([one.kind for one in trials]),
        beliefs=nothing.astype(np.float32),
        scores=nothing.astype(np.float32),
        counts=nothing.astype(np.int16),
        spreads=nothing.astype(np.float32),
        won_right=nothing.astype(np.bool_),
        won_exact=nothing.astype(np.bool_),
    )


def with_decisions(table: FeatureTable, decisions: Sequence[Decision]) -> FeatureTable:
    """The table with what the judge made of its trials, in their order."""
    shape = (len(table.lengths), -1)
    return replace(
        table,
        beliefs=np.array([one.beliefs for one in decisions], np.float32).reshape(*shape, len(TEMPERATURES)),
        scores=np.array([one.score for one in decisions], np.float32).reshape(shape),
        counts=in_units(np.array([one.counts for one in decisions])).reshape(*shape, evidence.COUNT),
        spreads=np.array([one.spread for one in decisions], np.float32).reshape(shape),
        won_right=np.array([one.right for one in decisions]).reshape(shape),
        won_exact=np.array([one.exact for one in decisions]).reshape(shape),
    )


def in_units(values: Array) -> NDArray[np.int16]:
    """As whole numbers of UNITs."""
    return np.rint(values / UNIT).astype(np.int16)


def from_units(values: NDArray[np.int16]) -> Array:
    """Whole numbers of UNITs as what they stand for."""
    return values.astype(np.float64) * UNIT


def _deciding(choice: Choice, near: int, weights: Array) -> NDArray[np.intp]:
    order = np.argsort(-(choice.features @ weights), kind="stable")
    kept = [order[:HARD], order[HARD :: max(1, (len(order) - HARD) // EASY)]]
    return np.unique(np.concatenate([np.arange(1 + near), *kept, order[choice.wanted[order]][:1]]))
