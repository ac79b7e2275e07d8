"""What is to be thought of an estimate, in words: accept it, look at it, or doubt it, and why.

All words about it stand here; pages show them as they are.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from app.confidence.ambiguity_words import ANY_TURN, amount, axis_name, millimetres, reach
from registration_core import Ambiguity, Check, Estimate, ObjectModel, Recalibration
from registration_core.judge.certificates import MOST_OFF, NOTHING

Array = NDArray[np.float64]
Assessed = Literal["accept", "look", "doubt"]

EVEN = 0.5
"""Below this a pose is more likely wrong than right."""
NUMBERS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


@dataclass(frozen=True)
class Standard:
    """What is asked of an estimate."""

    risk: float
    """Share of wrong poses among the accepted that is allowed."""
    threshold: float
    """The corrected confidence from which on that holds; above 1 where none is known."""
    recalibration: Recalibration = field(default_factory=Recalibration)
    """What a dataset's own registrations have taught."""
    is_own: bool = False
    """Whether the threshold stems from the dataset's own registrations, not from the shipped calibration."""
    rests_on: int = 0
    """Number of estimates or registrations that it was read off."""


@dataclass(frozen=True)
class Assessment:
    """What is to be thought of one estimate."""

    verdict: Assessed
    reasons: tuple[str, ...]
    """In words, the weightiest first."""
    confidence: float
    """Corrected by what the dataset's registrations have taught."""
    risk: float
    threshold: float | None
    """None where no confidence is known that bears the risk out."""

    @property
    def sentence(self) -> str:
        """All of it in words."""
        return f"{self.verdict}: {'; '.join(self.reasons)}"

    def stored(self) -> dict[str, Any]:
        """As JSON keeps it."""
        return {**asdict(self), "reasons": list(self.reasons)}


def assessment_in(detail: Mapping[str, Any]) -> Assessment | None:
    """The one that an event's detail has kept; None where it has none."""
    stored = detail.get("assessment")
    return None if stored is None else Assessment(**{**stored, "reasons": tuple(stored["reasons"])})


def assess(estimate: Estimate, standard: Standard, model: ObjectModel) -> Assessment:
    """Judge an estimate by a standard, its certificates and its ambiguities."""
    confidence = float(standard.recalibration(estimate.confidence))
    likely = confidence >= standard.threshold
    certificates, check = estimate.certificates, estimate.certificates.check
    contradicted = check.is_enough and max(check.behind, check.before) > MOST_OFF
    modes = sum(one.kind == "other mode" for one in estimate.ambiguities)
    reasons = [
        *([] if estimate.converged else ["little of the object is seen: the pose is kept as it was"]),
        *(_off(check) if contradicted and estimate.converged else []),
        *_ambiguous(estimate.ambiguities, model),
        *(_unproven(check) if estimate.converged and not contradicted else []),
        *_unlikely(confidence, standard),
    ]
    verdict: Assessed = "look"
    if not estimate.converged or contradicted or min(1.0, (1 + modes) * confidence) < EVEN:
        verdict = "doubt"
    elif likely and certificates.observably_correct and certificates.non_degenerate:
        verdict = "accept"
        reasons = [f"at most {percent(standard.risk)} of poses that are as sure are wrong"]
    known = standard.threshold if standard.threshold <= 1.0 else None
    return Assessment(verdict, tuple(reasons), confidence, standard.risk, known)


def _off(check: Check) -> list[str]:
    """Where depth contradicts the pose."""
    found = []
    if check.behind > MOST_OFF:
        found.append((check.behind, check.behind_by, "behind"))
    if check.before > MOST_OFF:
        found.append((check.before, check.before_by, "in front of"))
    return [
        f"depth lies {millimetres(length)} {where} the object over {percent(share)} of it"
        for share, length, where in sorted(found, reverse=True)
    ]


def _unproven(check: Check) -> list[str]:
    """Why depth does not confirm the pose, where it does not contradict it."""
    if check.agrees:
        return []
    if check == NOTHING:
        return ["it is too small in the image to be checked by depth that the snap did not use"]
    if not check.is_enough:
        return [f"little of the object is seen: {percent(check.seen)} of its outline"]
    return [f"depth fits only {percent(check.match)} of what is seen of it"]


def _ambiguous(ambiguities: tuple[Ambiguity, ...], model: ObjectModel) -> list[str]:
    """What depth cannot tell."""
    modes = [one for one in ambiguities if one.kind == "other mode"]
    reasons = []
    if modes:
        count = NUMBERS.get(1 + len(modes), str(1 + len(modes)))
        verb = "turned by" if modes[0].motion == "turn" else "shifted by"
        one = "" if len(modes) == 1 else "one of them "
        reasons.append(f"{count} poses fit, {one}{verb} {amount(modes[0])} {_axis(modes[0], model)}")
    for free in ambiguities[len(modes) :]:
        motion = replace(free, extent=reach(free.kind, free.motion, free.extent))
        if motion.motion == "shift":
            where = f"where it lies {_axis(motion, model)}, ± {amount(motion)}"
        elif motion.extent >= ANY_TURN:
            where = f"the turn {_axis(motion, model)}"
        else:
            where = f"the turn {_axis(motion, model)}, ± {amount(motion)}"
        reasons.append(f"depth does not tell {where}")
    return reasons


def _unlikely(confidence: float, standard: Standard) -> list[str]:
    """Why the confidence is not enough."""
    if standard.threshold > 1.0:
        return [f"no confidence is known from which on at most {percent(standard.risk)} are wrong"]
    if confidence >= standard.threshold:
        return []
    if confidence < EVEN:
        return ["poses that are as unsure are more often wrong than right"]
    enough = f"{standard.threshold:.2f}"
    return [f"it takes a confidence of {enough} for at most {percent(standard.risk)} to be wrong"]


def _axis(ambiguity: Ambiguity, model: ObjectModel) -> str:
    preposition = "about" if ambiguity.motion == "turn" else "along"
    return f"{preposition} {axis_name(ambiguity.axis, np.ptp(model.vertices, axis=0))}"


def percent(share: float) -> str:
    """A share as people read it: 2 %, 0.5 %."""
    return f"{100.0 * share:.2g} %" if share < 0.1 else f"{100.0 * share:.0f} %"
