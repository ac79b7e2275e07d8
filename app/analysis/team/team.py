"""Ordinary work, seen as a study: how long it takes, and how the machine's poses fare."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app.analysis.statistics.curves import Timing
from app.analysis.study_data.remarks import Remark
from app.analysis.study_data.runs import TASK_PARTS, place_name, scene_name, symmetries_of
from app.analysis.study_data.trial import Snapped, TrialInfo, TrialTrace, traced, without_snaps
from app.analysis.team.machine_poses import MachinePose, drags_after, machine_poses, taken_steps
from app.analysis.trace.log_faults import faults_of
from app.analysis.trace.logs import LoggedRow, read_logs
from app.analysis.trace.pose_errors import PoseErrors, pose_errors
from app.analysis.trace.trace import Trace, trace_of, until_submission
from app.storage.database import Database
from app.storage.tables import Participant, Registration, utc_now

Array = NDArray[np.float64]

TEAM_TIMING = Timing(snap_seconds=0.0, without_idle=True)
"""Snaps of ordinary work have taken their time already; whoever is away does not work."""


@dataclass(frozen=True, eq=False)
class Work:
    """One registration of ordinary work. Its own last pose counts as the truth."""

    trial: TrialTrace
    """Its group is the operator; its STG errors are of the snaps that were made, when their results came."""
    week: str
    """ISO 8601, such as "2026-W05", of the submission."""
    starts: PoseErrors
    """(N,) each, of the poses from which snaps were asked for."""
    results: PoseErrors
    """(N,) each, of what they brought."""
    accepted: int
    """Of these results."""
    drags_after: int | None
    """After the last accepted one; None where there was none."""

    @property
    def snaps(self) -> int:
        """Results of snaps."""
        return len(self.starts.translation)


@dataclass(frozen=True)
class TeamRow:
    """Figures of one operator, object and week."""

    operator: str
    object: str
    week: str
    registrations: int
    active_seconds: float
    """Mean of a registration, without idle time."""
    snaps: float
    """Results of snaps, mean of a registration."""
    accepted: float
    """Share of these results; NaN where there were none."""
    drags_after: float
    """Mean of the registrations with an accepted result; NaN where there were none."""


def work_of(database: Database) -> tuple[list[Work], list[Remark]]:
    """All submitted registrations that belong to no study, and what there is to say of those left out."""
    with database.read() as session:
        rows = session.scalars(
            select(Registration)
            .outerjoin(Participant, Participant.user_id == Registration.user_id)
            .where(Participant.id.is_(None), Registration.state == "submitted")
            .options(joinedload(Registration.user), joinedload(Registration.task).options(*TASK_PARTS))
        ).all()
    registrations = {row.id: row for row in rows}
    symmetries = {row.task.object_id: symmetries_of(row.task.object) for row in rows}
    work: list[Work] = []
    remarks: list[Remark] = []
    for registration_id, log in read_logs(database, list(registrations)):
        row = registrations[registration_id]
        spoiled = [fault for fault in faults_of(log) if fault.spoils_times]
        if spoiled:
            about = f"{row.user.name}, {place_name(row.task)}"
            remarks.append(Remark(about, f"{spoiled[0].text}; left out", registration_id))
        else:
            work.append(_work(row, until_submission(log), symmetries[row.task.object_id]))
    return work, remarks


def team_rows(work: Sequence[Work]) -> list[TeamRow]:
    """Figures by operator, object and week, the newest week first."""
    ordered = sorted(work, key=_key)
    rows = [_row(*key, list(part)) for key, part in groupby(ordered, key=_key)]
    return sorted(rows, key=lambda row: row.week, reverse=True)


def _work(row: Registration, log: Sequence[LoggedRow], symmetries: Array) -> Work:
    task = row.task
    trace = trace_of(task.T_world_object_start, log)
    T_truth = np.array(row.T_world_object)
    times = trace.sample_times()
    taken = taken_steps(task.T_world_object_start, log)
    snaps = machine_poses(trace, log, taken)
    starts, results = (
        pose_errors(np.array(poses).reshape(-1, 4, 4), T_truth, symmetries)
        for poses in ([snap.T_start for snap in snaps], [snap.T_result for snap in snaps])
    )
    year, week, _ = (row.submitted_at or utc_now()).isocalendar()
    info = TrialInfo(
        registration_id=row.id,
        operator=row.user.name,
        group=row.user.name,
        mode=task.mode,
        condition=task.condition,
        scene=scene_name(task.scene),
        object=task.object.name,
        instance=task.instance,
        is_simulated=False,
    )
    errors = pose_errors(trace.motion.at(times), T_truth, symmetries)
    return Work(
        trial=traced(info, trace, times, errors, {"default": _when_they_came(trace, times, snaps, results)}),
        week=f"{year}-W{week:02d}",
        starts=starts,
        results=results,
        accepted=sum(snap.is_accepted for snap in snaps),
        drags_after=drags_after(taken),
    )


def _when_they_came(trace: Trace, times: Array, snaps: Sequence[MachinePose], results: PoseErrors) -> Snapped:
    """Errors of results at the samples (M,) that follow them, NaN at the others."""
    errors = without_snaps(len(times))
    places = np.searchsorted(times, [min(snap.seconds, trace.duration) for snap in snaps])
    errors.translation[places] = results.translation
    errors.rotation[places] = results.rotation
    return Snapped(errors, np.isfinite(errors.translation))


def _key(work: Work) -> tuple[str, str, str]:
    return work.trial.operator, work.trial.object, work.week


def _row(operator: str, name: str, week: str, work: Sequence[Work]) -> TeamRow:
    snaps = sum(one.snaps for one in work)
    drags = [one.drags_after for one in work if one.drags_after is not None]
    return TeamRow(
        operator=operator,
        object=name,
        week=week,
        registrations=len(work),
        active_seconds=float(np.mean([one.trial.active_seconds[-1] for one in work])),
        snaps=snaps / len(work),
        accepted=sum(one.accepted for one in work) / snaps if snaps else np.nan,
        drags_after=float(np.mean(drags)) if drags else np.nan,
    )
