"""Studies in the database: set up, joined, left and looked at."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session, joinedload

from app.access.auth import add_credential
from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.storage.roles import Role
from app.storage.tables import Credential, Participant, Registration, Study, Trial, User, utc_now
from app.study.erasing import erase_registrations
from app.study.plan import Slot, StudyError, StudyPlan, order_of
from app.study.tasks import ensure_task, find_task, start_of


@dataclass(frozen=True)
class Joined:
    """A new participant, and the secret of their link."""

    participant: Participant
    secret: str
    """Stands in the link, is told once, and kept only as a hash."""


@dataclass(frozen=True)
class Standing:
    """How far a participant has come."""

    participant: Participant
    done: int
    """Tasks that count and are submitted."""
    total: int
    """Tasks that count; 0 when the data were erased."""


class Studies:
    """All that is done with studies, safe to call from any thread."""

    def __init__(self, database: Database, data: SceneData) -> None:
        self._database = database
        self._data = data

    def create(
        self, name: str, plan: StudyPlan, seed: int, user_id: int, is_simulated: bool = False
    ) -> Study:
        """Add a study with the tasks that it needs.

        Raises:
            StudyError: where the name is taken, or the plan names what is not there.
        """
        starts = {ref: start_of(self._database, self._data, ref) for ref in [*plan.practice, *plan.tasks]}
        with self._database.write() as session:
            if session.scalar(select(Study.id).filter_by(name=name)) is not None:
                raise StudyError(f"there already is a study named {name!r}; choose another name")
            for ref, mode, condition in product(starts, plan.modes, plan.conditions):
                ensure_task(session, Slot(ref, mode, condition), starts[ref])
            study = Study(
                name=name,
                plan=plan.model_dump(mode="json"),
                seed=seed,
                user_id=user_id,
                is_simulated=is_simulated,
            )
            session.add(study)
            session.flush()
        return study

    def check(self, plan: StudyPlan) -> None:
        """Raise `StudyError` where the plan names scenes or objects that are not there."""
        for ref in [*plan.practice, *plan.tasks]:
            start_of(self._database, self._data, ref)

    def add_participant(self, study_id: int, group: str, is_simulated: bool = False) -> Joined:
        """Let one more operator take part, in the first row of their group that nobody holds.

        Raises:
            StudyError: where the study is closed or has no such group, or the group is complete.
        """
        with self._database.write() as session:
            study = _study(session, study_id)
            if study.state != "open":
                raise StudyError(f"the study {study.name!r} is closed; nobody can join it any more")
            plan = StudyPlan.model_validate(study.plan)
            if group not in plan.groups:
                known = ", ".join(plan.groups)
                raise StudyError(f"the study {study.name!r} has no group {group!r}; its groups are {known}")
            row = _free_row(study.participants, group)
            if row >= plan.groups[group]:
                size = plan.groups[group]
                raise StudyError(f"the group {group!r} is complete: {size} of {size} operators are invited")
            participant = _new_participant(session, study, group, row, is_simulated or study.is_simulated)
            for place, slot in enumerate(order_of(plan, row, study.seed)):
                task = find_task(session, slot)
                assert task is not None  # made with the study
                participant.trials.append(Trial(place=place, task_id=task.id, is_practice=slot.is_practice))
            secret = add_credential(session, "participant", participant.user_id, None)
        return Joined(participant, secret)

    def new_secret(self, participant_id: int) -> str:
        """The secret of a new link; the old one and whoever is signed in by it are shut out.

        Raises:
            StudyError: where the participant has withdrawn or the study is closed.
        """
        with self._database.write() as session:
            participant = _participant(session, participant_id)
            require_taking_part(participant)
            _shut_out(session, [participant.user_id])
            return add_credential(session, "participant", participant.user_id, None)

    def consent(self, participant_id: int) -> None:
        """The participant agrees to take part."""
        with self._database.write() as session:
            participant = _participant(session, participant_id)
            participant.consented_at = participant.consented_at or utc_now()

    def answer(self, participant_id: int, answers: dict[str, str]) -> None:
        """What the participant answers, by the questions' texts; None is kept of what they left empty.

        Raises:
            StudyError: before they have agreed to take part, and where a question that has to be answered
                is not, is not asked, or has no such choice.
        """
        with self._database.write() as session:
            participant = _participant(session, participant_id)
            plan = StudyPlan.model_validate(participant.study.plan)
            if plan.consent and participant.consented_at is None:
                raise StudyError("please agree to take part first; nothing is kept of you before")
            questions = {question.text: question for question in plan.questions}
            strange = next((text for text in answers if text not in questions), None)
            if strange is not None:
                raise StudyError(f"the study does not ask {strange!r}")
            participant.answers = {
                text: question.checked(answers.get(text, "")) for text, question in questions.items()
            }

    def finish(self, participant_id: int) -> None:
        """Note when a participant is through; nothing happens where they are not."""
        with self._database.write() as session:
            participant = _participant(session, participant_id)
            standing = _standing(session, participant)
            if standing.total and standing.done == standing.total:
                participant.finished_at = participant.finished_at or utc_now()

    def withdraw(self, participant_id: int) -> None:
        """The participant leaves the study: their data are left out from now on, and their link is void."""
        with self._database.write() as session:
            _withdraw(session, _participant(session, participant_id))

    def erase(self, participant_id: int) -> None:
        """Delete all that a participant did and answered; they withdraw by it.

        That they were there stays: code, group, row, and when they withdrew.
        """
        with self._database.write() as session:
            participant = _participant(session, participant_id)
            _withdraw(session, participant)
            participant.answers = None
            participant.consented_at = participant.finished_at = None
            session.execute(delete(Trial).filter_by(participant_id=participant_id))
            erase_registrations(session, participant.user_id)

    def close(self, study_id: int) -> None:
        """End a study: nobody joins it or goes on with it any more."""
        with self._database.write() as session:
            study = _study(session, study_id)
            study.state = "closed"
            _shut_out(session, [participant.user_id for participant in study.participants])

    def progress(self, study_id: int) -> list[Standing]:
        """How far each participant has come, in the order in which they joined.

        Raises:
            StudyError: where there is no such study.
        """
        with self._database.read() as session:
            return [_standing(session, participant) for participant in _study(session, study_id).participants]


def require_taking_part(participant: Participant) -> None:
    """Raise `StudyError` unless the participant may go on; their study has to be loaded."""
    if participant.withdrawn_at is not None:
        raise StudyError(f"{participant.code} has withdrawn from the study")
    if participant.study.state != "open":
        raise StudyError(f"the study {participant.study.name!r} is closed")


def _study(session: Session, study_id: int) -> Study:
    study = session.get(Study, study_id)
    if study is None:
        raise StudyError(f"there is no study {study_id}")
    return study


def _participant(session: Session, participant_id: int) -> Participant:
    participant = session.get(Participant, participant_id, options=[joinedload(Participant.study)])
    if participant is None:
        raise StudyError(f"there is no participant {participant_id}")
    return participant


def _new_participant(session: Session, study: Study, group: str, row: int, is_simulated: bool) -> Participant:
    """With a user of its own, who is known by nothing but the participant's code."""
    code = f"P{len(study.participants) + 1:02d}"
    user = User(name=f"study {study.id}, {code}", role=Role.PARTICIPANT)
    session.add(user)
    session.flush()
    participant = Participant(
        study_id=study.id, user_id=user.id, code=code, group=group, row=row, is_simulated=is_simulated
    )
    session.add(participant)
    session.flush()
    return participant


def _free_row(participants: Sequence[Participant], group: str) -> int:
    """The first that nobody of the group holds; who withdraws leaves theirs to the next."""
    held = {p.row for p in participants if p.group == group and p.withdrawn_at is None}
    return next(row for row in range(len(held) + 1) if row not in held)


def _withdraw(session: Session, participant: Participant) -> None:
    participant.withdrawn_at = participant.withdrawn_at or utc_now()
    _shut_out(session, [participant.user_id])


def _shut_out(session: Session, user_ids: Sequence[int]) -> None:
    session.execute(delete(Credential).where(Credential.user_id.in_(user_ids)))


def _standing(session: Session, participant: Participant) -> Standing:
    trials = select(Trial).filter_by(participant_id=participant.id, is_practice=False)
    total = session.scalar(select(func.count()).select_from(trials.subquery())) or 0
    done = session.scalar(
        select(func.count(Trial.id))
        .join(Registration, Registration.task_id == Trial.task_id)
        .where(
            Trial.participant_id == participant.id,
            ~Trial.is_practice,
            Registration.user_id == participant.user_id,
            Registration.state == "submitted",
        )
    )
    return Standing(participant, done or 0, total)
