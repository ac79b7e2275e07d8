"""Studies in the database: tasks, participants, their links, their progress, and their end."""

import pytest
from sqlalchemy import func, select

from app.access.auth import Auth, SignInError
from app.storage.event_log import EventLog, NewEvent
from app.storage.roles import Actor, Role
from app.storage.tables import Registration, Scene, Task, Trial
from app.study.plan import DECLINED, StudyError, StudyPlan, order_of


@pytest.fixture
def study(studies, plan, admin):
    return studies.create("pilot", plan, 7, admin.id)


def tasks_of(database, participant):
    with database.read() as session:
        return session.scalars(
            select(Task).join(Trial).filter_by(participant_id=participant.id).order_by(Trial.place)
        ).all()


def submit(database, participant, task):
    with database.write() as session:
        row = Registration(task_id=task.id, user_id=participant.user_id)
        session.add(row)
        session.flush()
    pose = task.T_world_object_start
    EventLog(database).append(
        row.id, participant.user_id, NewEvent("submit", Actor.HUMAN, T_before=pose, T_after=pose)
    )


def test_the_plan_comes_back_as_it_was(study, plan):
    assert StudyPlan.model_validate(study.plan) == plan


def test_all_modes_and_conditions_of_a_thing_begin_where_its_first_task_does(database, study, plan):
    with database.read() as session:
        for ref in plan.tasks:
            rows = session.scalars(select(Task).filter_by(**ref.model_dump()).order_by(Task.id)).all()
            assert [row.is_for_studies for row in rows] == [False, True, True]
            assert len({(str(row.T_world_object_start), row.frame_id) for row in rows}) == 1
            assert len({str(row.T_world_object_reference) for row in rows}) == 1


def test_a_thing_that_nobody_asked_for_begins_at_the_start_pose(database, studies, study, plan, admin):
    fresh = plan.tasks[0].model_copy(update={"instance": 5})
    studies.create("another", plan.model_copy(update={"tasks": [fresh]}), 7, admin.id)
    with database.read() as session:
        new = session.scalar(select(Task).filter_by(instance=5, mode="quick"))
        assert new.T_world_object_reference is None
        first = session.get_one(Scene, fresh.scene_id).frames[0]
        assert new.frame_id == first.id


def test_a_second_study_uses_the_tasks_of_the_first(database, studies, study, plan, admin):
    with database.read() as session:
        before = session.scalar(select(func.count(Task.id)))
    studies.create("again", plan, 8, admin.id)
    with database.read() as session:
        assert session.scalar(select(func.count(Task.id))) == before


def test_a_participant_has_the_tasks_of_their_row_in_order(database, studies, study, plan):
    for group, row in (("expert", 0), ("expert", 1), ("novice", 0)):
        participant = studies.add_participant(study.id, group).participant
        assert participant.row == row
        assert [
            (t.scene_id, t.object_id, t.instance, t.mode, t.condition)
            for t in tasks_of(database, participant)
        ] == [
            (*slot.task.model_dump().values(), slot.mode, slot.condition)
            for slot in order_of(plan, row, study.seed)
        ]


def test_who_withdraws_leaves_their_row_to_the_next(studies, study):
    first = studies.add_participant(study.id, "novice").participant
    with pytest.raises(StudyError, match="is complete: 1 of 1 operators"):
        studies.add_participant(study.id, "novice")
    studies.withdraw(first.id)
    second = studies.add_participant(study.id, "novice").participant
    assert (second.row, second.code) == (first.row, "P02")


def test_a_link_can_be_used_again_until_the_participant_withdraws(database, studies, study):
    auth, joined = Auth(database), studies.add_participant(study.id, "novice")
    sessions = [auth.sign_in_to_study(joined.secret) for _ in range(2)]
    identities = [auth.identify_session(s) for s in sessions]
    assert [one.role for one in identities if one is not None] == [Role.PARTICIPANT] * 2
    studies.withdraw(joined.participant.id)
    assert [auth.identify_session(s) for s in sessions] == [None, None]
    with pytest.raises(SignInError, match="this link is not valid"):
        auth.sign_in_to_study(joined.secret)


def test_a_new_link_voids_the_old_one(database, studies, study):
    auth, joined = Auth(database), studies.add_participant(study.id, "novice")
    fresh = studies.new_secret(joined.participant.id)
    with pytest.raises(SignInError):
        auth.sign_in_to_study(joined.secret)
    identity = auth.identify_session(auth.sign_in_to_study(fresh))
    assert identity is not None and identity.user_id == joined.participant.user_id


def test_a_closed_study_shuts_its_participants_out_and_takes_no_more(database, studies, study):
    joined = studies.add_participant(study.id, "novice")
    studies.close(study.id)
    with pytest.raises(SignInError):
        Auth(database).sign_in_to_study(joined.secret)
    with pytest.raises(StudyError, match="closed"):
        studies.add_participant(study.id, "expert")
    with pytest.raises(StudyError, match="closed"):
        studies.new_secret(joined.participant.id)


def test_practice_does_not_count_in_the_progress(database, studies, study):
    participant = studies.add_participant(study.id, "novice").participant
    practice, *counted = tasks_of(database, participant)
    submit(database, participant, practice)
    submit(database, participant, counted[0])
    (standing,) = studies.progress(study.id)
    assert (standing.done, standing.total) == (1, 4)
    studies.finish(participant.id)
    assert studies.progress(study.id)[0].participant.finished_at is None
    for task in counted[1:]:
        submit(database, participant, task)
    studies.finish(participant.id)
    assert studies.progress(study.id)[0].participant.finished_at is not None


def test_answers_are_those_that_are_asked_for(studies, study):
    participant = studies.add_participant(study.id, "novice").participant
    question = "Have you used a 3-D program?"
    for answers, sentence in (
        ({}, "please answer"),
        ({question: "maybe"}, "choose one of yes, no"),
        ({question: "yes", "Name?": "Ann"}, "does not ask 'Name\\?'"),
    ):
        with pytest.raises(StudyError, match=sentence):
            studies.answer(participant.id, answers)
    studies.answer(participant.id, {question: " yes "})
    assert studies.progress(study.id)[0].participant.answers == {question: "yes"}


def test_what_is_left_empty_is_kept_apart_from_what_is_not_told(studies, plan, admin):
    hand, years = (
        {"text": "MotorModel?", "choices": ["left", "right"], "optional": True},
        {"text": "Years?", "optional": True},
    )
    asking = StudyPlan.model_validate(plan.model_dump() | {"questions": [hand, years]})
    study = studies.create("asking", asking, 7, admin.id)
    for group, answers, kept in (
        ("novice", {"MotorModel?": DECLINED, "Years?": " "}, {"MotorModel?": DECLINED, "Years?": None}),
        ("expert", {}, {"MotorModel?": None, "Years?": None}),
    ):
        participant = studies.add_participant(study.id, group).participant
        studies.answer(participant.id, answers)
        assert studies.progress(study.id)[-1].participant.answers == kept


def test_nobody_is_asked_before_they_agreed(studies, plan, admin):
    agreed = studies.create("agreed", plan.model_copy(update={"consent": "You move objects."}), 7, admin.id)
    participant = studies.add_participant(agreed.id, "novice").participant
    answers = {plan.questions[0].text: "yes"}
    with pytest.raises(StudyError, match="agree to take part first"):
        studies.answer(participant.id, answers)
    assert studies.progress(agreed.id)[0].participant.answers is None
    studies.consent(participant.id)
    studies.answer(participant.id, answers)
    assert studies.progress(agreed.id)[0].participant.answers == answers


def test_what_is_not_there_is_named(studies, study, plan, admin):
    lost = plan.model_copy(update={"tasks": [plan.tasks[0].model_copy(update={"scene_id": 99})]})
    with pytest.raises(StudyError, match="no scene 99"):
        studies.create("lost", lost, 1, admin.id)
    strange = plan.model_copy(update={"tasks": [plan.tasks[0].model_copy(update={"object_id": 99})]})
    with pytest.raises(StudyError, match="object 99 is none"):
        studies.check(strange)
    with pytest.raises(StudyError, match="already is a study named 'pilot'"):
        studies.create("pilot", plan, 1, admin.id)
    with pytest.raises(StudyError, match="no group 'wizard'; its groups are novice, expert"):
        studies.add_participant(study.id, "wizard")
    with pytest.raises(StudyError, match="no study 99"):
        studies.progress(99)


def test_erasing_leaves_only_that_somebody_was_there(database, studies, study, plan):
    joined = studies.add_participant(study.id, "expert").participant
    other = studies.add_participant(study.id, "expert").participant
    for participant in (joined, other):
        studies.consent(participant.id)
        submit(database, participant, tasks_of(database, participant)[0])
    studies.erase(joined.id)
    erased, kept = studies.progress(study.id)
    assert erased.total == 0 and erased.participant.withdrawn_at and not erased.participant.consented_at
    assert kept.total == 4 and kept.participant.consented_at
    with database.read() as session:
        assert [r.user_id for r in session.scalars(select(Registration))] == [other.user_id]
