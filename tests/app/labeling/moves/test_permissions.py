"""Tools: what each condition has, in a study and outside, and that a session refuses all others."""

from dataclasses import replace

import numpy as np
import pytest

from app.labeling.layers import Layers
from app.labeling.moves.permissions import ALL, COMPARED, MACHINES, methods_of, require, tools_of
from app.labeling.moves.pose_record import ActionError
from app.storage.roles import Actor
from app.storage.tables import Condition
from tests.app.labeling.bench import START, Bench, result

T_ELSEWHERE = START + np.eye(4, k=3)

USES = {
    "snap": lambda session: session.snap(Actor.HUMAN),
    "live snap": lambda session: session.set_live(True, Actor.HUMAN),
    "find it": lambda session: session.search(Actor.HUMAN),
    "three points": lambda session: session.set_pose(T_ELSEWHERE, Actor.HUMAN, "three points"),
    "click-to-place": lambda session: session.set_pose(T_ELSEWHERE, Actor.HUMAN, "place"),
    "precision": lambda session: session.set_pose(T_ELSEWHERE, Actor.HUMAN, "nudge"),
    "copy": lambda session: session.set_pose(T_ELSEWHERE, Actor.HUMAN, "copy"),
    "agreement": lambda session: session.show_layers(replace(Layers(), agreement=True)),
    "ending": lambda session: session.skip(Actor.HUMAN, "no depth"),
}


@pytest.mark.parametrize("condition", list(COMPARED))
@pytest.mark.parametrize("tool", list(USES))
def test_a_trial_has_the_tools_of_its_condition_and_no_others(condition, tool):
    bench = Bench(condition=condition, in_study=True)
    if tool in COMPARED[condition]:
        USES[tool](bench.session)
        return
    with pytest.raises(ActionError, match=r"done without the tool|by hand alone"):
        USES[tool](bench.session)
    assert bench.log.kinds == []


@pytest.mark.parametrize("condition", list(COMPARED))
def test_the_gizmo_and_undo_are_in_every_trial(condition):
    bench = Bench(condition=condition, in_study=True)
    bench.drag(T_ELSEWHERE)
    bench.session.undo(Actor.HUMAN)
    bench.session.redo(Actor.HUMAN)
    bench.session.reset(Actor.HUMAN)
    bench.session.submit(Actor.HUMAN)
    with pytest.raises(ActionError, match="'ending'"):
        bench.session.reopen(Actor.HUMAN)


def test_a_bare_pose_is_refused_in_a_trial():
    with pytest.raises(ActionError, match="'precision'"):
        Bench(condition="snap", in_study=True).session.set_pose(T_ELSEWHERE, Actor.SCRIPT)


def test_the_machine_takes_its_turn_in_a_trial_with_auto_alone():
    turns_of: dict[Condition, int] = {"auto": 1, "snap": 0}
    for condition, turns in turns_of.items():
        bench = Bench(condition=condition, in_study=True)
        bench.drag(T_ELSEWHERE)
        assert len(bench.workers.snaps) == turns


def test_a_mode_of_a_snap_may_be_taken_where_there_are_snaps():
    bench = Bench(condition="snap", in_study=True)
    bench.session.snap(Actor.HUMAN)
    bench.workers.snaps[-1].end(result(T_ELSEWHERE))
    bench.session.preview(START)
    bench.session.set_pose(START, Actor.HUMAN, "mode")
    with pytest.raises(ActionError, match="'find it'"):
        bench.session.set_pose(T_ELSEWHERE, Actor.HUMAN, "proposal")


def test_ordinary_work_has_everything_or_all_but_the_machine():
    assert tools_of("snap", False) == tools_of("auto", False) == ALL
    assert tools_of("manual", False) == ALL - MACHINES


def test_ordinary_work_with_a_technique_has_it_and_what_is_no_technique():
    tools = tools_of("three points", False)
    assert {"snap", "three points", "copy", "ending"} <= tools
    assert not tools & {"click-to-place", "precision", "find it", "live snap"}


def test_a_trial_has_one_method_whatever_its_task_says():
    for condition in COMPARED:
        expected = ("paper",) if condition == "paper snap" else ("default",)
        assert methods_of(condition, True, "paper") == expected
        bench = Bench(condition=condition, in_study=True)
        with pytest.raises(ActionError, match=r"method|by hand alone"):
            bench.session.choose_method("default" if condition == "paper snap" else "paper")


def test_the_operator_has_the_choice_where_snap_is_not_compared_with_anything():
    for condition in ("snap", "auto"):
        assert methods_of(condition, False) == ("default", "paper")
        assert methods_of(condition, False, "paper") == ("paper", "default")
    assert methods_of("live snap", False, "paper") == ("default",)


def test_what_is_refused_is_named():
    with pytest.raises(ActionError, match="without the tool 'copy'"):
        require({"snap"}, "copy")
    with pytest.raises(ActionError, match="by hand alone"):
        require({"copy"}, "snap")
