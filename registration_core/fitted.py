"""The fitted numbers of a snap, which `./scripts/fit` makes and nobody edits by hand."""

import json
from dataclasses import dataclass
from pathlib import Path

PATH = Path(__file__).with_name("fitted.json")


@dataclass(frozen=True)
class Fitted:
    """What was fitted, in the order in which the code asks for it."""

    classes: tuple[float, ...]
    """Weights of the classes of evidence, as `evidence.class_names()` orders them."""
    match_share: float
    """Weight of the share of the claimed surface that matches."""
    prior: float
    """Weight of the distance from the start."""
    temperature: float
    """Of the softmax that shares the belief among modes."""
    confidence: tuple[float, ...]
    """Logistic weights, as `confidence.FEATURES` orders them."""
    doubts: tuple[float, ...]
    """For each round of a search, the confidence from which on it is left out."""


NOTHING = Fitted(classes=(), match_share=0.0, prior=0.0, temperature=1.0, confidence=(), doubts=())
"""Before anything was fitted: what is needed to search, but not to judge what is found."""


def read_fitted(path: Path = PATH) -> Fitted:
    """The fitted numbers in a file; `NOTHING` where there is none, so that they can be made from nothing."""
    if not path.exists():
        return NOTHING
    stored = json.loads(path.read_text(encoding="utf-8"))
    judge, confidence = stored["judge"], stored["confidence"]
    return Fitted(
        classes=tuple(judge["classes"].values()),
        match_share=judge["match_share"],
        prior=judge["prior"],
        temperature=confidence["temperature"],
        confidence=tuple(confidence["weights"].values()),
        doubts=tuple(stored["doubts"]),
    )


FITTED = read_fitted()
