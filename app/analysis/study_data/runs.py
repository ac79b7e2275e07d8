"""Which trials of a study count."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import and_, select
from sqlalchemy.orm import Session, joinedload

from app.analysis.study_data.remarks import Remark, counted
from app.analysis.study_data.trial import TrialInfo
from app.datasets.scene_data import symmetries_from_json
from app.storage.tables import NAMED, Object, Participant, Registration, Scene, Study, Task, Trial

Array = NDArray[np.float64]
Place = tuple[int, int, int]
"""Scene, object and instance: what has one true pose."""


@dataclass(frozen=True, eq=False)
class Run:
    """A trial that was submitted."""

    participant: Participant
    task: Task
    registration: Registration

    @property
    def place(self) -> Place:
        """What was registered."""
        return self.task.scene_id, self.task.object_id, self.task.instance

    @property
    def about(self) -> str:
        """Names the trial in remarks."""
        return about_trial(self.participant, self.task)

    @property
    def info(self) -> TrialInfo:
        """What the trial was."""
        return TrialInfo(
            registration_id=self.registration.id,
            operator=self.participant.code,
            group=self.participant.group,
            mode=self.task.mode,
            condition=self.task.condition,
            scene=scene_name(self.task.scene),
            object=self.task.object.name,
            instance=self.task.instance,
            is_simulated=self.participant.is_simulated,
        )


def runs_of(session: Session, study_id: int) -> tuple[list[Run], list[Remark]]:
    """The submitted trials of a study that are no practice, of participants who did not withdraw; and what
    there is to say of the others.
    """
    rows = session.execute(
        select(Participant, Trial, Registration)
        .join(Trial, Trial.participant_id == Participant.id)
        .outerjoin(
            Registration,
            and_(Registration.task_id == Trial.task_id, Registration.user_id == Participant.user_id),
        )
        .where(Participant.study_id == study_id, Participant.withdrawn_at.is_(None))
        .order_by(Participant.id, Trial.place)
        .options(joinedload(Trial.task).options(*TASK_PARTS))
    ).all()
    runs, remarks = [], []
    not_begun: Counter[str] = Counter()
    practice = sum(trial.is_practice for _, trial, _ in rows)
    for participant, trial, row in rows:
        registration: Registration | None = row  # by the outer join
        if trial.is_practice:
            continue
        if registration is None:
            not_begun[participant.code] += 1
        elif registration.state == "submitted":
            runs.append(Run(participant, trial.task, registration))
        else:
            skipped = registration.state == "skipped"
            why = f"was skipped ({registration.skip_reason})" if skipped else "was not submitted"
            remarks.append(Remark(about_trial(participant, trial.task), f"{why}; left out", registration.id))
    remarks += [Remark(code, f"did not begin {counted(n, 'trial')}") for code, n in not_begun.items()]
    if practice:
        remarks.append(Remark("practice", f"{counted(practice, 'trial')} of practice tasks do not count"))
    return runs, remarks


TASK_PARTS = (joinedload(Task.scene).joinedload(Scene.dataset), *NAMED)
"""What is loaded with a task that is to be named."""


def about_participants(study: Study, participants: Sequence[Participant]) -> Iterator[Remark]:
    """Who withdrew, and which groups of the plan have nobody."""
    for participant in participants:
        if participant.withdrawn_at is not None:
            yield Remark(participant.code, "withdrew; nothing of them counts")
    there = {participant.group for participant in participants if participant.withdrawn_at is None}
    for group in study.plan.get("groups", {}):
        if group not in there:
            yield Remark(f"group {group}", "has no operators; there are no curves of it")


def about_trial(participant: Participant, task: Task) -> str:
    """Names a trial in remarks."""
    return f"{participant.code}, {place_name(task)}, {task.mode}, {task.condition}"


def place_name(task: Task) -> str:
    """How people call what is registered where."""
    return f"{scene_name(task.scene)}, {task.name}"


def scene_name(scene: Scene) -> str:
    """How people call a scene."""
    return f"{scene.dataset.name} {scene.label}"


def symmetries_of(item: Object) -> Array:
    """The transforms (S, 4, 4) that map an object onto itself."""
    return symmetries_from_json(item.symmetries).transforms(item.diameter)
