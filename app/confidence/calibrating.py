"""Calibrates the confidence by a dataset's own submitted registrations.

The pose that an operator submitted is the truth for the estimates that were made on the way to it. Estimates
of one registration are alike: a fold of the cross-validation has all of one or none, each registration counts
as one, and one estimate of each, drawn at random, stands for it where thresholds are tested.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from app.confidence.standards import standard_of
from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.storage.tables import OUTSIDE_STUDIES, CalibrationRow, EstimateRow, Object, Registration, Scene, Task
from app.workers.methods import method_of
from registration_core import Recalibration, acceptance, recalibration
from registration_core.algorithm import ALGORITHM
from registration_core.symmetry.pose_equivalence import same_pose_of

Array = NDArray[np.float64]

FEWEST = 30
"""Registrations below which nothing can be learnt."""
FOLDS = 5
BINS = 10
"""Of equal count, in which confidences are compared with what came of them."""


class TooFewError(ValueError):
    """There is too little to calibrate from; the message may be shown."""


@dataclass(frozen=True, eq=False)
class Experience:
    """Estimates of which it is known whether they were right."""

    confidences: Array
    """(N,), as computed."""
    right: NDArray[np.bool_]
    """(N,), whether the MSSD to the submitted pose is below 5 % of the diameter."""
    registrations: NDArray[np.intp]
    """(N,), to which of them each belongs, from 0 on."""

    def __len__(self) -> int:
        """Of the registrations."""
        return len(np.unique(self.registrations))

    @property
    def weights(self) -> Array:
        """(N,): those of one registration sum to 1."""
        return 1.0 / np.bincount(self.registrations)[self.registrations]

    def part(self, chosen: NDArray[np.bool_]) -> "Experience":
        """Some of the estimates."""
        _, numbers = np.unique(self.registrations[chosen], return_inverse=True)
        return Experience(self.confidences[chosen], self.right[chosen], numbers)


@dataclass(frozen=True)
class Worth:
    """What a confidence is worth."""

    brier: float
    log_loss: float
    auroc: float | None
    """None where all were right, or all wrong."""
    calibration_error: float
    accepted: float
    """Share that is accepted at the risk."""
    wrong_among_accepted: float | None
    """None where nothing is accepted."""


@dataclass(frozen=True)
class Gains:
    """What calibrating gained."""

    registrations: int
    estimates: int
    right: float
    """Share."""
    risk: float
    before: Worth
    after: Worth
    """Cross-validated by registration."""


def experience_of(database: Database, data: SceneData, dataset_id: int) -> Experience:
    """The estimates of the present algorithm on the way to submitted poses, but for those of studies."""
    query = (
        select(EstimateRow, Registration, Object)
        .join(Registration, EstimateRow.registration_id == Registration.id)
        .join(Task, Registration.task_id == Task.id)
        .join(Scene, Task.scene_id == Scene.id)
        .join(Object, Task.object_id == Object.id)
        .where(Scene.dataset_id == dataset_id, Registration.state == "submitted", OUTSIDE_STUDIES)
        .where(EstimateRow.algorithm == ALGORITHM)
        .order_by(EstimateRow.id)
    )
    confidences, right, registrations = [], [], []
    with database.read() as session:
        for estimate, registration, item in session.execute(query):
            if method_of(estimate.config) != "default":
                continue
            same = same_pose_of(data.model(item))
            confidences.append(estimate.confidence)
            right.append(same(np.array(estimate.T_world_object), np.array(registration.T_world_object)))
            registrations.append(registration.id)
    _, numbers = np.unique(registrations, return_inverse=True)
    return Experience(np.array(confidences), np.array(right, dtype=np.bool_), numbers.astype(np.intp))


def calibrate(known: Experience, risk: float) -> tuple[CalibrationRow, Gains]:
    """A calibration, for whichever dataset it was made of, and what it gained.

    Raises:
        TooFewError: where it was made of too few registrations.
    """
    if len(known) < FEWEST:
        raise TooFewError(
            f"{len(known)} submitted registrations have snaps of this version; calibrating needs {FEWEST}"
        )
    gains = gains_of(known, risk)
    row = _row(known)
    row.gains = asdict(gains)
    return row, gains


def gains_of(known: Experience, risk: float) -> Gains:
    """What a calibration gains on registrations that it was not made from."""
    folds = np.random.default_rng(0).permutation(len(known)) % FOLDS
    fold = folds[known.registrations]
    corrected, accepted = np.empty(len(fold)), np.empty(len(fold), dtype=np.bool_)
    for number in range(FOLDS):
        standard = standard_of(_row(known.part(fold != number)), risk)
        aside = fold == number
        corrected[aside] = standard.recalibration(known.confidences[aside])
        accepted[aside] = corrected[aside] >= standard.threshold
    return Gains(
        registrations=len(known),
        estimates=len(known.right),
        right=float(known.weights @ known.right / len(known)),
        risk=risk,
        before=worth(known.confidences, known, known.confidences >= acceptance(risk)),
        after=worth(corrected, known, accepted),
    )


def worth(confidences: Array, known: Experience, accepted: NDArray[np.bool_]) -> Worth:
    """What confidences (N,) of known estimates are worth, and of those that are accepted, (N,)."""
    right, weights = known.right, known.weights / len(known)
    chance = np.clip(confidences, 1e-6, 1.0 - 1e-6)
    taken = weights @ accepted
    bins = np.array_split(np.argsort(confidences, kind="stable"), BINS)
    gaps = [abs(weights[part] @ (confidences[part] - right[part])) for part in bins]
    return Worth(
        brier=float(weights @ (confidences - right) ** 2),
        log_loss=float(-weights @ np.log(np.where(right, chance, 1.0 - chance))),
        auroc=_auroc(confidences, right),
        calibration_error=float(np.sum(gaps)),
        accepted=float(taken),
        wrong_among_accepted=float(weights @ (accepted & ~right) / taken) if taken > 0.0 else None,
    )


def keep(session: Session, dataset_id: int, row: CalibrationRow) -> None:
    """Let a dataset's snaps go by a calibration from now on, in place of the one before."""
    forget(session, dataset_id)
    row.dataset_id = dataset_id
    session.add(row)


def forget(session: Session, dataset_id: int) -> bool:
    """Let a dataset's snaps go by the shipped calibration again; whether it had one of its own."""
    ids = session.scalars(select(CalibrationRow.id).filter_by(dataset_id=dataset_id)).all()
    session.execute(delete(CalibrationRow).where(CalibrationRow.id.in_(ids)))
    return bool(ids)


def told(gains: Gains) -> list[str]:
    """What calibrating gained, in lines for people."""
    return [
        f"{gains.registrations} registrations, {gains.estimates} estimates, {_percent(gains.right)} right;"
        " after: on registrations left out",
        f"{'':28}{'before':>9}{'after':>9}",
        *(
            f"{name:28}"
            + "".join(f"{_told(getattr(one, field), as_share):>9}" for one in (gains.before, gains.after))
            for name, field, as_share in (
                ("Brier score", "brier", False),
                ("log loss", "log_loss", False),
                ("AUROC", "auroc", False),
                ("calibration error", "calibration_error", True),
                (f"accepted at a risk of {_percent(gains.risk)}", "accepted", True),
                ("wrong among these", "wrong_among_accepted", True),
            )
        ),
    ]


def _row(known: Experience) -> CalibrationRow:
    corrected: Recalibration = recalibration(known.confidences, known.right, known.weights)
    rng = np.random.default_rng(0)
    of_each = [np.flatnonzero(known.registrations == number) for number in range(len(known))]
    drawn = [int(rng.choice(own)) for own in of_each]
    return CalibrationRow(
        algorithm=ALGORITHM,
        stretch=corrected.stretch,
        shift=corrected.shift,
        confidences=corrected(known.confidences[drawn]).tolist(),
        right=known.right[drawn].tolist(),
    )


def _auroc(confidences: Array, right: NDArray[np.bool_]) -> float | None:
    good, bad = int(right.sum()), int((~right).sum())
    if good == 0 or bad == 0:
        return None
    from scipy.stats import rankdata  # heavy, and needed only where a dataset is calibrated

    return float((rankdata(confidences)[right].sum() - good * (good + 1) / 2) / (good * bad))


def _told(value: Any, as_share: bool) -> str:
    if value is None:
        return "–"
    return _percent(value) if as_share else f"{value:.3f}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
