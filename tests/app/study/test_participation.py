"""A participant's way: which screens come, when a task may be begun, and what is theirs to see."""

import pytest

from app.storage.tables import Registration, Task
from app.study.participation import place_of, require_turn, sees
from app.study.plan import StudyError
from tests.app.study.test_studies import submit, tasks_of


@pytest.fixture
def join(studies, plan, admin):
    """Lets somebody take part in a study with changes to the plan."""

    def join_one(**changes):
        changed = plan.model_copy(update={"consent": "", "questions": [], **changes})
        study = studies.create(str(changes), changed, 7, admin.id)
        return studies.add_participant(study.id, "novice").participant

    return join_one


def screens_through(database, participant):
    """The screens before each task and at the end, while one after the other is submitted."""
    seen = []
    for task in tasks_of(database, participant):
        seen.append(place_of(database, participant.user_id).screens)
        submit(database, participant, task)
    return [*seen, place_of(database, participant.user_id).screens]


def test_a_break_comes_after_so_many_tasks_that_count(database, join):
    assert screens_through(database, join(break_after=1)) == [
        ("practice", "instructions", "task"),
        ("instructions", "task"),
        ("break", "task"),
        ("break", "instructions", "task"),
        ("break", "task"),
        ("thanks",),
    ]


def test_without_breaks_and_practice_only_instructions_come_between(database, join):
    assert screens_through(database, join(break_after=0, practice=[])) == [
        ("instructions", "task"),
        ("task",),
        ("instructions", "task"),
        ("task",),
        ("thanks",),
    ]


def test_who_has_begun_a_task_goes_straight_back_to_it(database, join):
    participant = join(break_after=1)
    first = tasks_of(database, participant)[0]
    with database.write() as session:
        session.add(Registration(task_id=first.id, user_id=participant.user_id))
    place = place_of(database, participant.user_id)
    assert place.trial is not None
    assert (place.screens, place.is_begun, place.trial.task_id) == (("task",), True, first.id)


def test_consent_and_questions_come_before_anything_may_be_begun(database, studies, join, plan):
    participant = join(consent="Do you?", questions=plan.questions)
    first = tasks_of(database, participant)[0]
    for before, agree in (
        ("consent", lambda: studies.consent(participant.id)),
        ("questions", lambda: studies.answer(participant.id, {plan.questions[0].text: "no"})),
    ):
        assert place_of(database, participant.user_id).screens[0] == before
        with pytest.raises(StudyError, match="begins with its first page"):
            require_turn(database, participant.user_id, first.id)
        agree()
    require_turn(database, participant.user_id, first.id)


def test_only_the_next_task_and_those_begun_may_be_worked_on(database, join):
    participant = join()
    first, second, third, *_ = tasks_of(database, participant)
    submit(database, participant, first)
    require_turn(database, participant.user_id, first.id)
    require_turn(database, participant.user_id, second.id)
    with pytest.raises(StudyError, match="not your next task"):
        require_turn(database, participant.user_id, third.id)


def test_whoever_has_left_is_told(database, studies, join, admin):
    participant = join()
    studies.withdraw(participant.id)
    with pytest.raises(StudyError, match="P01 has withdrawn"):
        place_of(database, participant.user_id)
    with pytest.raises(StudyError, match="take part in no study"):
        place_of(database, admin.id)


def test_a_participant_sees_what_their_tasks_are_about(database, join, plan):
    participant = join()
    ref = plan.tasks[0]
    assert sees(database, participant.user_id, Task.scene_id == ref.scene_id)
    assert sees(database, participant.user_id, Task.object_id == ref.object_id)
    assert not sees(database, participant.user_id, Task.scene_id == 999)
    assert not sees(database, participant.user_id + 1, Task.scene_id == ref.scene_id)
