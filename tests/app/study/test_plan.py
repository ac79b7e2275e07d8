"""The plan of a study: every operator's order, its balance, and plans that cannot be."""

from collections import Counter
from itertools import pairwise, product

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from app.study.plan import (
    DECLINED,
    Question,
    StudyError,
    StudyPlan,
    TaskRef,
    balanced_square,
    expected_minutes,
    order_of,
    rows_of_balance,
)

MUG, DRILL, CLAMP = (TaskRef(scene_id=scene, object_id=7) for scene in (1, 2, 3))
PLAN = StudyPlan(conditions=["manual", "snap"], tasks=[MUG, DRILL], practice=[CLAMP])


def test_the_square_of_four_as_worked_out_by_hand():
    assert balanced_square(4) == [[0, 1, 3, 2], [1, 2, 0, 3], [2, 3, 1, 0], [3, 0, 2, 1]]


@given(st.integers(1, 12))
def test_each_number_is_equally_often_in_each_place_and_after_each_other(size):
    square = balanced_square(size)
    places = Counter((place, number) for row in square for place, number in enumerate(row))
    followers = Counter(pair for row in square for pair in pairwise(row))
    assert len(places) == size**2 and len(set(places.values())) == 1
    assert len(followers) == size * (size - 1) and len(set(followers.values())) <= 1


@given(st.integers(0, 100), st.integers(0, 2**63 - 1))
def test_everybody_does_everything_once_after_practice(row, seed):
    order = order_of(PLAN, row, seed)
    assert [slot.is_practice for slot in order] == [True] * 2 + [False] * 8
    assert {(slot.task, slot.condition) for slot in order[:2]} == {(CLAMP, "manual"), (CLAMP, "snap")}
    assert Counter((slot.task, slot.mode, slot.condition) for slot in order[2:]) == Counter(
        product(PLAN.tasks, PLAN.modes, PLAN.conditions)
    )


def test_practice_is_in_the_mode_and_the_order_that_follow_it():
    order = order_of(PLAN, 3, 5)
    assert {slot.mode for slot in order[:2]} == {order[2].mode}
    assert order[0].condition == order[2].condition


def test_a_mode_and_condition_are_done_in_one_go():
    blocks = [(slot.mode, slot.condition) for slot in order_of(PLAN, 1, 5)[2:]]
    assert sum(a != b for a, b in pairwise(blocks)) == 3


@given(st.integers(0, 2**32))
def test_blocks_are_balanced_over_the_rows_whichever_seed_it_is(seed):
    rows = [order_of(PLAN, row, seed)[2::2] for row in range(rows_of_balance(PLAN))]
    places = Counter((place, slot.mode, slot.condition) for row in rows for place, slot in enumerate(row))
    assert len(places) == 16 and set(places.values()) == {1}


def test_tasks_are_balanced_within_each_block_and_against_the_blocks_place():
    count: Counter[tuple[object, ...]] = Counter()
    for row in range(8):
        order = order_of(PLAN, row, 9)[2:]
        count.update((place, slot.task, slot.mode, slot.condition) for place, slot in enumerate(order))
    assert len(count) == 64 and set(count.values()) == {1}


def test_rows_repeat_exactly_and_seeds_differ():
    assert order_of(PLAN, 2, 1) == order_of(PLAN, 2, 1)
    assert len({tuple(order_of(PLAN, 0, seed)) for seed in range(20)}) > 1


def test_the_minutes_are_those_of_all_tasks_with_practice():
    assert expected_minutes(PLAN) in (14.0, 16.0)  # 4 accurate, 4 quick, 2 for practice in either mode
    assert expected_minutes(PLAN.model_copy(update={"modes": ["quick"], "practice": []})) == 4.0


def test_an_optional_question_offers_to_tell_nothing_and_may_be_left_empty():
    asked = Question(text="MotorModel?", choices=["left", "right"], optional=True)
    assert asked.offered == ["left", "right", DECLINED]
    assert (asked.checked(" left "), asked.checked(DECLINED), asked.checked(" ")) == ("left", DECLINED, None)
    with pytest.raises(StudyError, match="choose one of left, right, Rather not say"):
        asked.checked("both")
    assert Question(text="Years?", optional=True).offered == []
    own = Question(text="MotorModel?", choices=["left", DECLINED], optional=True)
    assert own.offered == ["left", DECLINED]


def test_a_question_of_before_has_to_be_answered_with_its_own_choices():
    old = Question.model_validate({"text": "MotorModel?", "choices": ["left", "right"]})
    assert not old.optional and old.offered == ["left", "right"]
    for answer, sentence in (("", "please answer 'MotorModel\\?'"), (DECLINED, "choose one of left, right")):
        with pytest.raises(StudyError, match=sentence):
            old.checked(answer)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"tasks": []}, "at least 1 item"),
        ({"tasks": [MUG, MUG]}, "scene 1, object 7, instance 0 is there twice"),
        ({"practice": [MUG]}, "is for practice and counts as well"),
        ({"conditions": ["magic"]}, "manual"),
        ({"groups": {"novice": 0}}, "greater than or equal to 1"),
        ({"groups": {}}, "at least 1 item"),
        ({"groups": {"novice": 1, "novice ": 3}}, "novice is there twice"),
        ({"groups": {"no\0vice": 1}}, "control character"),
        ({"questions": [{"text": "MotorModel?", "choices": ["left"]}]}, "left is the only choice"),
        ({"questions": [{"text": "Left\nor right?"}]}, "write one line"),
        ({"questions": [{"text": "Age?"}, {"text": "Age?"}]}, "Age\\? is there twice"),
        ({"tasks": [{"scene_id": s, "object_id": 1} for s in range(1, 400)]}, "would do 1598 tasks"),
        ({"colour": "red"}, "not permitted"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_with_its_reason(change, sentence):
    with pytest.raises(ValidationError, match=sentence):
        StudyPlan.model_validate(PLAN.model_dump() | change)
