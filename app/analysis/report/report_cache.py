"""What reports are made of, kept until something of it changes: it takes seconds to collect."""

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from sqlalchemy import func, select

from app.analysis.study_data.collect import Collected, TruthSource, trials_of
from app.analysis.study_data.remarks import Remark
from app.analysis.team.team import Work, work_of
from app.storage.database import Database
from app.storage.tables import OfflineSnap, Participant, Registration, Study, SymmetryVersion, Trial

Value = TypeVar("Value")

LATEST = (func.count(), func.max(Registration.submitted_at), func.max(Registration.id))
"""Of submitted registrations: only these count, and whoever goes on with one submits it again."""

DECIDED = select(func.count(SymmetryVersion.id))
"""Errors are up to the symmetries of objects."""


class ReportCache:
    """The last state of each study, and of the ordinary work."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._values: dict[object, tuple[object, Any]] = {}
        self._lock = threading.Lock()

    def study(self, study_id: int, source: TruthSource) -> Collected:
        """As `trials_of`."""
        return self._kept(
            (study_id, source),
            self._study_state(study_id),
            lambda: trials_of(self._database, study_id, source),
        )

    def team(self) -> tuple[list[Work], list[Remark]]:
        """As `work_of`."""
        return self._kept("team", self._team_state(), lambda: work_of(self._database))

    def _kept(self, key: object, state: object, collect: Callable[[], Value]) -> Value:
        with self._lock:  # whoever asks for the same meanwhile waits instead of collecting it again
            before, value = self._values.get(key, (None, None))
            if before != state:
                value = collect()
                self._values[key] = state, value
            kept: Value = value
            return kept

    def _study_state(self, study_id: int) -> object:
        of_study = Participant.study_id == study_id
        submitted = select(*LATEST).join(Participant, Participant.user_id == Registration.user_id)
        snaps = (
            select(func.count(), func.max(OfflineSnap.id))
            .join(Registration, OfflineSnap.registration_id == Registration.id)
            .join(Participant, Participant.user_id == Registration.user_id)
        )
        trials = select(func.count()).select_from(Trial).join(Participant)
        states = select(Registration.state, func.count()).join(
            Participant, Participant.user_id == Registration.user_id
        )
        with self._database.read() as session:
            study = session.get(Study, study_id)
            return (
                study and (study.name, str(study.plan)),
                session.execute(submitted.where(of_study, Registration.state == "submitted")).one(),
                session.execute(states.where(of_study).group_by(Registration.state)).all(),
                session.execute(snaps.where(of_study)).one(),
                session.execute(trials.where(of_study)).one(),
                session.execute(
                    select(Participant.id, Participant.group, Participant.withdrawn_at).where(of_study)
                ).all(),
                session.execute(DECIDED).one(),
            )

    def _team_state(self) -> object:
        with self._database.read() as session:
            latest = session.execute(select(*LATEST).where(Registration.state == "submitted")).one()
            return latest, session.execute(DECIDED).one()
