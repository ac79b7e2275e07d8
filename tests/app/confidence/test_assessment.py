"""What is thought of an estimate, and in which words."""

from dataclasses import replace

import numpy as np
import pytest

from app.confidence.assessment import Assessment, Standard, assess, assessment_in
from registration_core import Ambiguity, Certificates, Check, Estimate, ObjectModel, Recalibration
from registration_core.judge.acceptance import NEVER
from registration_core.judge.certificates import NOTHING, certified

BOX = np.array([[x, y, z] for x in (0.0, 0.2) for y in (0.0, 0.08) for z in (0.0, 0.03)])
MODEL = ObjectModel(BOX, np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6], [0, 4, 7]], dtype=np.int32))
GOOD = Check(pixels=400, seen=0.9, match=0.97, behind=0.01, behind_by=0.014, before=0.0, before_by=0.0)
STANDARD = Standard(risk=0.02, threshold=0.9)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def estimate(
    confidence: float = 0.95, check: Check = GOOD, *ambiguities: Ambiguity, converged: bool = True
) -> Estimate:
    certificates: Certificates = certified(converged, bool(ambiguities), [check])
    return Estimate(
        np.eye(4), confidence, np.eye(6), (), 0.1, 1, converged, ambiguities, certificates, seed=0
    )


def other(motion="turn", axis=X, extent=np.pi) -> Ambiguity:
    return Ambiguity("other mode", motion, axis, extent)


def free(motion="turn", axis=X, extent=0.2) -> Ambiguity:
    return Ambiguity("free motion", motion, axis, extent)


@pytest.mark.parametrize(
    ("known", "sentence"),
    [
        (estimate(), "accept: at most 2 % of poses that are as sure are wrong"),
        (estimate(0.8), "look: it takes a confidence of 0.90 for at most 2 % to be wrong"),
        (estimate(0.3), "doubt: poses that are as unsure are more often wrong than right"),
        (
            estimate(converged=False),
            "doubt: little of the object is seen: the pose is kept as it was",
        ),
        (
            estimate(0.95, GOOD, other()),
            "look: two poses fit, turned by 180° about the long axis",
        ),
        (
            estimate(0.95, GOOD, other(axis=Z, extent=np.pi / 2), other(), other("shift", Y, 0.012)),
            "look: four poses fit, one of them turned by 90° about the short axis",
        ),
        (
            estimate(0.95, GOOD, other("shift", Y, 0.012)),
            "look: two poses fit, shifted by 12 mm along the y axis",
        ),
        (
            estimate(0.95, GOOD, free(axis=(0.6, 0.6, 0.52))),
            "look: depth does not tell the turn about a slanted axis, ± 22°",
        ),
        (estimate(0.95, GOOD, free(extent=2.0)), "look: depth does not tell the turn about the long axis"),
        (
            estimate(0.95, GOOD, free("shift", X, 0.02)),
            "look: depth does not tell where it lies along the long axis, ± 39 mm",
        ),
        (
            estimate(0.95, replace(GOOD, behind=0.3, behind_by=0.0152, match=0.6)),
            "doubt: depth lies 15 mm behind the object over 30 % of it",
        ),
        (
            estimate(0.95, replace(GOOD, behind=0.06, behind_by=0.02, before=0.2, before_by=0.013)),
            "doubt: depth lies 13 mm in front of the object over 20 % of it;"
            " depth lies 20 mm behind the object over 6 % of it",
        ),
        (estimate(0.95, replace(GOOD, match=0.7)), "look: depth fits only 70 % of what is seen of it"),
        (estimate(0.95, replace(GOOD, seen=0.12)), "look: little of the object is seen: 12 % of its outline"),
        (
            estimate(0.95, NOTHING),
            "look: it is too small in the image to be checked by depth that the snap did not use",
        ),
    ],
)
def test_words(known: Estimate, sentence: str) -> None:
    assert assess(known, STANDARD, MODEL).sentence == sentence


def test_of_two_poses_that_share_the_belief_neither_is_doubted() -> None:
    known = estimate(0.4, GOOD, other())
    assert assess(known, STANDARD, MODEL).verdict == "look"
    assert assess(estimate(0.2, GOOD, other()), STANDARD, MODEL).verdict == "doubt"


def test_sides_of_one_length_are_told_by_their_letters() -> None:
    cube = ObjectModel(BOX / [0.2, 0.08, 0.03] * 0.1, MODEL.faces)
    reasons = assess(estimate(0.95, GOOD, other(axis=Z)), STANDARD, cube).reasons
    assert reasons[0] == "two poses fit, turned by 180° about the z axis"


def test_without_a_known_threshold_nothing_is_accepted() -> None:
    found = assess(estimate(1.0), Standard(0.005, NEVER), MODEL)
    assert found.sentence == "look: no confidence is known from which on at most 0.5 % are wrong"
    assert found.threshold is None


def test_the_corrected_confidence_counts() -> None:
    taught = Standard(0.02, 0.9, Recalibration(1.0, -3.0))
    found = assess(estimate(0.95), taught, MODEL)
    assert found.confidence == pytest.approx(0.486, abs=0.001)
    assert found.verdict == "doubt"


def test_an_assessment_is_kept_in_the_log_as_it_was() -> None:
    found = assess(estimate(0.8, GOOD, other()), STANDARD, MODEL)
    assert assessment_in({"assessment": found.stored()}) == found
    assert assessment_in({}) is None
    assert isinstance(found, Assessment)
