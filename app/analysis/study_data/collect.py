"""A study out of the database: the trace of each trial, and what was left out and why."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select

from app.analysis.study_data.ground_truth import GroundTruth, given_truth, mean_truth
from app.analysis.study_data.offline_snaps import (
    SnapsAt,
    SnapsBySecond,
    StudySnaps,
    about_snaps,
    snaps_at,
    snaps_of,
)
from app.analysis.study_data.remarks import Remark, counted
from app.analysis.study_data.runs import Place, Run, about_participants, place_name, runs_of, symmetries_of
from app.analysis.study_data.trial import Snapped, TrialTrace, traced, without_snaps
from app.analysis.trace.log_faults import faults_of
from app.analysis.trace.logs import LoggedRow, read_logs
from app.analysis.trace.pose_errors import PoseErrors, pose_errors
from app.analysis.trace.trace import trace_of, until_submission
from app.storage.database import Database
from app.storage.tables import Method, Participant, Pose, Study

Array = NDArray[np.float64]
TruthSource = Literal["operators", "reference"]


@dataclass(frozen=True, eq=False)
class PlaceTruth:
    """The ground truth of one object in one scene, for the report."""

    name: str
    truth: GroundTruth
    from_reference: PoseErrors | None
    """(1,) each: how far the mean is from the given pose, where there are both."""


@dataclass(frozen=True, eq=False)
class Collected:
    """All that a report is made of."""

    study_id: int
    name: str
    is_simulated: bool
    groups: Mapping[str, int]
    """Operators who did not withdraw, by group; 0 for a group of the plan that has none."""
    trials: Sequence[TrialTrace]
    truths: Sequence[PlaceTruth]
    algorithm: str | None
    """That computed the offline snaps, those by the default where there are any; None where there are none,
    or an older version did not say."""
    remarks: Sequence[Remark]


def trials_of(database: Database, study_id: int, source: TruthSource = "operators") -> Collected:
    """The traces of all trials of a study that count.

    Args:
        database: With the log.
        study_id: Whose trials.
        source: Whether the mean of the accurate registrations by hand is the truth, or the given reference
            pose; where a place has only the other one, that one is, and it is remarked.

    Raises:
        LookupError: where there is no such study.
    """
    with database.read() as session:
        study = session.get(Study, study_id)
        if study is None:
            raise LookupError(f"There is no study {study_id}.")
        participants = session.scalars(
            select(Participant).where(Participant.study_id == study_id).order_by(Participant.id)
        ).all()
        runs, remarks = runs_of(session, study_id)
        snaps = snaps_of(session, study_id)
    remarks = [*about_participants(study, participants), *remarks]
    truths = _truths(runs, source, remarks)
    trials = _trials(database, runs, truths, snaps, remarks)
    remarks += about_snaps(trials, snaps)
    present = [participant.group for participant in participants if participant.withdrawn_at is None]
    return Collected(
        study_id=study_id,
        name=study.name,
        is_simulated=study.is_simulated or any(trial.is_simulated for trial in trials),
        groups={
            name: present.count(name) for name in dict.fromkeys([*study.plan.get("groups", {}), *present])
        },
        trials=trials,
        truths=list(truths.values()),
        algorithm=next((of_method.algorithm for of_method in snaps.values()), None),
        remarks=remarks,
    )


def _truths(runs: Sequence[Run], source: TruthSource, remarks: list[Remark]) -> dict[Place, PlaceTruth]:
    of_place: dict[Place, list[Run]] = defaultdict(list)
    for run in runs:
        of_place[run.place].append(run)
    truths = {}
    for place, here in of_place.items():
        name = place_name(here[0].task)
        truth, text = _truth(here, source)
        if text:
            remarks.append(Remark(name, text))
        if truth is not None:
            truths[place] = PlaceTruth(name, truth, _from_reference(here, truth))
    return truths


def _truth(here: Sequence[Run], source: TruthSource) -> tuple[GroundTruth | None, str]:
    """The truth of one place from the runs there, and what there is to say of it."""
    task = here[0].task
    reference = _reference(here)
    by_hand = [
        run.registration.T_world_object
        for run in here
        if run.task.condition == "manual" and run.task.mode == "accurate"
    ]
    if by_hand and (source == "operators" or reference is None):
        text = "" if source == "operators" else "has no reference pose; the mean by hand is its ground truth"
        return mean_truth(np.array(by_hand), symmetries_of(task.object)), text
    if reference is not None:
        text = "has no accurate registration by hand; its reference pose is the ground truth"
        return given_truth(np.array(reference)), text if source == "operators" else ""
    left_out = f"{counted(len(here), 'trial')} left out"
    return (
        None,
        f"has no ground truth, neither accurate registrations by hand nor a reference pose; {left_out}",
    )


def _reference(here: Sequence[Run]) -> Pose | None:
    """The pose that was given for a place, with any of its tasks."""
    return next((T for run in here if (T := run.task.T_world_object_reference) is not None), None)


def _from_reference(here: Sequence[Run], truth: GroundTruth) -> PoseErrors | None:
    reference = _reference(here)
    if reference is None or not truth.count:
        return None
    return pose_errors(truth.T_world_object[None], np.array(reference), symmetries_of(here[0].task.object))


def _trials(
    database: Database,
    runs: Sequence[Run],
    truths: Mapping[Place, PlaceTruth],
    snaps: Mapping[Method, StudySnaps],
    remarks: list[Remark],
) -> list[TrialTrace]:
    counting = {run.registration.id: run for run in runs if run.place in truths}
    symmetries = {run.task.object_id: symmetries_of(run.task.object) for run in counting.values()}
    logs_missing = dict(counting)
    trials = []
    for registration_id, rows in read_logs(database, list(counting)):
        run = logs_missing.pop(registration_id)
        faults = faults_of(rows)
        remarks += [
            Remark(run.about, fault.text + ("; left out" if fault.spoils_times else ""), registration_id)
            for fault in faults
        ]
        if not any(fault.spoils_times for fault in faults):
            T_truth = truths[run.place].truth.T_world_object
            of_object = symmetries[run.task.object_id]
            of_run = {
                method: of_method.by_registration[registration_id]
                for method, of_method in snaps.items()
                if registration_id in of_method.by_registration
            }
            trials.append(_trial(run, rows, T_truth, of_object, of_run))
    remarks += [
        Remark(run.about, "has no log; left out", run.registration.id) for run in logs_missing.values()
    ]
    return trials


def _trial(
    run: Run,
    rows: Sequence[LoggedRow],
    T_truth: Array,
    symmetries: Array,
    snaps: Mapping[Method, SnapsBySecond],
) -> TrialTrace:
    trace = trace_of(run.task.T_world_object_start, until_submission(rows))
    times = trace.sample_times()
    errors = pose_errors(trace.motion.at(times), T_truth, symmetries)
    stg = {
        method: _snapped(snaps_at(times, by_second), T_truth, symmetries)
        for method, by_second in snaps.items()
    }
    return traced(run.info, trace, times, errors, stg)


def _snapped(found: SnapsAt, T_truth: Array, symmetries: Array) -> Snapped:
    errors = without_snaps(len(found.computed))
    if found.places:
        known = pose_errors(found.T_world_object, T_truth, symmetries)
        errors.translation[found.places] = known.translation
        errors.rotation[found.places] = known.rotation
    return Snapped(errors, found.computed)
