"""What a study asks of whom, and the order in which each operator does it."""

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from app.storage.tables import Condition, Mode

Item = TypeVar("Item")

LARGEST_GROUP = 500
LONGEST_ORDER = 1000
"""Tasks of one operator."""
ACCURATELY = (
    "Place the object as accurately as you can. Take the time you need; submit when you cannot improve it."
)
QUICKLY = (
    "Place the object as quickly as you can. Submit as soon as it looks about right; a clock is running."
)


MINUTES_A_TASK: Mapping[Mode, float] = {"accurate": 2.0, "quick": 1.0}
"""Assumed before a study begins: simulated operators, who move at published speeds, take 107 s and 52 s by
hand (medians on the demo scenes), and there is the way to the next task. A pilot tells better."""


class StudyError(ValueError):
    """A study, its plan or its participants do not allow this; the message may be shown."""


def _without_repetition(items: list[Item]) -> list[Item]:
    for index, item in enumerate(items):
        if item in items[:index]:
            raise ValueError(f"{item} is there twice; name each once")
    return items


def _each_group_once(groups: Any) -> Any:
    """Before names are stripped: of two that are the same then, only one would be left."""
    if isinstance(groups, dict):
        _without_repetition([str(name).strip() for name in groups])
    return groups


def _one_line(text: str) -> str:
    if any(unicodedata.category(character) == "Cc" for character in text):
        raise ValueError(f"{text!r} has a line break or a control character; write one line of text")
    return text


def _two_or_none(choices: list[str]) -> list[str]:
    if len(choices) == 1:
        raise ValueError(f"{choices[0]} is the only choice; give two or more, or none for a free answer")
    return choices


Text = Annotated[str, StringConstraints(strip_whitespace=True, max_length=5000)]
Line = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200), AfterValidator(_one_line)
]
GroupName = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=40), AfterValidator(_one_line)
]
RowId = Annotated[int, Field(ge=1, le=2**31 - 1)]
Once = AfterValidator(_without_repetition)


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class TaskRef(_Part):
    """One instance of an object in a scene."""

    scene_id: RowId
    object_id: RowId
    instance: int = Field(0, ge=0, le=1000)

    def __str__(self) -> str:
        return f"scene {self.scene_id}, object {self.object_id}, instance {self.instance}"


DECLINED = "Rather not say"
"""Offered beside the choices of an optional question. A form cannot take a choice back, and what is left
empty may have been overlooked: whoever wants to tell nothing can say so, which is told from both."""


class Question(_Part):
    """What participants are asked once, before they begin."""

    text: Line
    choices: Annotated[list[Line], Once, AfterValidator(_two_or_none)] = Field(
        [], max_length=20, description="None: a short free answer."
    )
    optional: bool = Field(
        False, description=f"May be left empty; where there are choices, {DECLINED!r} is offered, too."
    )

    @property
    def offered(self) -> list[str]:
        """The choices that participants see."""
        adds = self.optional and self.choices and DECLINED not in self.choices
        return [*self.choices, DECLINED] if adds else self.choices

    def checked(self, given: str) -> str | None:
        """An answer as it is kept; None where it was left empty.

        Raises:
            StudyError: where the question has to be answered, or has no such choice.
        """
        answer = given.strip()
        if not answer:
            if self.optional:
                return None
            raise StudyError(f"please answer {self.text!r}")
        if self.offered and answer not in self.offered:
            choices = ", ".join(self.offered)
            raise StudyError(f"{answer!r} is no answer to {self.text!r}; choose one of {choices}")
        return answer


def _each_asked_once(questions: list[Question]) -> list[Question]:
    _without_repetition([question.text for question in questions])
    return questions


class StudyPlan(_Part):
    """All that decides what the operators of a study do and read."""

    conditions: Annotated[list[Condition], Once] = Field(["manual"], min_length=1)
    modes: Annotated[list[Mode], Once] = Field(["accurate", "quick"], min_length=1)
    groups: Annotated[
        dict[GroupName, Annotated[int, Field(ge=1, le=LARGEST_GROUP)]], BeforeValidator(_each_group_once)
    ] = Field(
        {"novice": 8, "expert": 8}, min_length=1, max_length=20, description="How many operators are in each."
    )
    tasks: Annotated[list[TaskRef], Once] = Field(
        min_length=1, description="What every operator does in every mode and condition."
    )
    practice: Annotated[list[TaskRef], Once] = Field(
        [], description="Done first, in each condition; not counted."
    )
    consent: Text = Field(
        "", description="What participants agree to first; nothing is asked where it is empty."
    )
    instructions: dict[Mode, Text] = Field({"accurate": ACCURATELY, "quick": QUICKLY})
    questions: Annotated[list[Question], AfterValidator(_each_asked_once)] = Field([], max_length=30)
    break_after: int = Field(6, ge=0, le=LONGEST_ORDER, description="Tasks between two breaks; 0: none.")

    @model_validator(mode="after")
    def _check(self) -> "StudyPlan":
        both = [task for task in self.practice if task in self.tasks]
        if both:
            raise ValueError(
                f"{both[0]} is for practice and counts as well; choose another one to practise on"
            )
        length = len(self.conditions) * (len(self.modes) * len(self.tasks) + len(self.practice))
        if length > LONGEST_ORDER:
            raise ValueError(f"each operator would do {length} tasks; {LONGEST_ORDER} is the most")
        return self


@dataclass(frozen=True)
class Slot:
    """One task in an operator's order."""

    task: TaskRef
    mode: Mode
    condition: Condition
    is_practice: bool = False


def order_of(plan: StudyPlan, row: int, seed: int) -> list[Slot]:
    """What the operator of one row does, in order.

    Practice comes first, in each condition once, in the order and first mode of the row. Then one block for
    each mode and condition, in the order of a balanced Latin square's row; tasks within a block are in that
    of another square, which moves on with the row and with the block. The seed shuffles what the squares'
    numbers stand for, so that rows are balanced whichever seed it is.

    Args:
        plan: The study's.
        row: Counts from 0; rows repeat after `rows_of_balance`.
        seed: The study's.
    """
    rng = np.random.default_rng(seed)
    blocks = _shuffled(list(product(plan.modes, plan.conditions)), rng)
    tasks = _shuffled(plan.tasks, rng)
    practice = _shuffled(plan.practice, rng)
    block_square, task_square = balanced_square(len(blocks)), balanced_square(len(tasks))
    order = block_square[row % len(block_square)]
    first_mode = blocks[order[0]][0]
    conditions = list(dict.fromkeys(blocks[block][1] for block in order))
    slots = [Slot(task, first_mode, condition, True) for condition in conditions for task in practice]
    for block in order:
        # moves on as well when the blocks' square begins anew: else some orders of both never met
        task_row = row + row // len(block_square) + block
        mode, condition = blocks[block]
        slots += [Slot(tasks[i], mode, condition) for i in task_square[task_row % len(task_square)]]
    return slots


def rows_of_balance(plan: StudyPlan) -> int:
    """How many operators a group needs at least for each block to be equally often in each place."""
    return len(balanced_square(len(plan.modes) * len(plan.conditions)))


def expected_minutes(plan: StudyPlan) -> float:
    """How long one operator takes for all tasks, practice included and breaks not, by `MINUTES_A_TASK`."""
    return sum(MINUTES_A_TASK[slot.mode] for slot in order_of(plan, row=0, seed=0))


def balanced_square(size: int) -> list[list[int]]:
    """A Latin square of the numbers below `size` in which each follows each other one equally often.

    Williams, E. J. (1949): Experimental designs balanced for the estimation of residual effects of
    treatments. An odd size needs the square and its mirror image: twice as many rows.
    """
    zigzag = [(i + 1) // 2 if i % 2 else (size - i // 2) % size for i in range(size)]
    square = [[(number + row) % size for number in zigzag] for row in range(size)]
    return square if size % 2 == 0 or size == 1 else square + [row[::-1] for row in square]


def _shuffled(items: Sequence[Item], rng: np.random.Generator) -> list[Item]:
    return [items[i] for i in rng.permutation(len(items))]
