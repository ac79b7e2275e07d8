"""A participant is erased while all are at work: nobody is disturbed, and nothing of theirs is left."""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from threading import Event as Signal
from typing import Any

import httpx
from sqlalchemy import func, select

from app.storage.roles import Role
from app.storage.tables import EstimateRow, Event, Participant, Registration
from registration_core.geometry import pose
from tests.app.api.study_rest import begin_next, invite, new_study, take_part
from tests.app.api.test_exports import finished_export, submit_all
from tests.app.live import LiveServer
from tests.app.rest import begin, log_of, put_pose, url_of
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until

OK = {200, 202}
SHUT_OUT = {401, 404, 409}
ROUNDS = 2


def at_work(stop: Signal, steps: Callable[[int], list[httpx.Response]]) -> list[httpx.Response]:
    """All answers to somebody who goes on until they are stopped, or shut out."""
    answers: list[httpx.Response] = []
    for i in itertools.count():
        answers += steps(i)
        if stop.is_set() or answers[-1].status_code == 401:
            return answers
    raise AssertionError


def hand_of(client: httpx.Client, registration: dict[str, Any]) -> Callable[[int], list[httpx.Response]]:
    """Moves an object, and asks for a snap of it and for the task anew now and then."""

    def steps(i: int) -> list[httpx.Response]:
        T = true_pose(TOOL) @ pose.exp([0.001 * (i % 9), 0, 0, 0, 0, 0])
        answers = [put_pose(client, registration, T)]
        if i % 5 == 0:
            answers.append(client.post(f"{url_of(registration)}/snaps", json={}))
        answers.append(client.post(f"/api/tasks/{registration['task_id']}/registration"))
        return answers

    return steps


def rows_of(server: LiveServer, user_id: int) -> int:
    """What is kept of a user's work."""
    mine = select(Registration.id).where(Registration.user_id == user_id)
    with server.services.database.read() as session:
        counts = [select(func.count(Registration.id)).where(Registration.user_id == user_id)]
        counts += [select(func.count(Event.id)).where(Event.user_id == user_id)]
        counts += [
            select(func.count(table.id)).where(table.registration_id.in_(mine))
            for table in (Event, EstimateRow)
        ]
        return sum(session.scalar(count) or 0 for count in counts)


def has_begun(server: LiveServer, user_id: int) -> bool:
    """Whether there is enough of a user's work to erase."""
    return rows_of(server, user_id) > 10


def test_nothing_of_the_erased_is_left_and_nobody_else_is_disturbed(own_live: LiveServer) -> None:
    chief = own_live.script("chief", Role.ADMIN)
    ann = own_live.script("ann")
    submit_all(own_live.script("a robot that knows"))
    study = new_study(chief)
    mine, stop = begin(ann), Signal()
    with ThreadPoolExecutor(3) as pool:
        others = pool.submit(at_work, stop, hand_of(ann, mine))
        try:
            for _ in range(ROUNDS):
                invited = invite(chief, study, "novice")
                with own_live.services.database.read() as session:
                    user_id = session.get_one(Participant, invited["id"]).user_id
                participant = take_part(own_live, invited["link"])
                export = pool.submit(finished_export, chief)
                theirs = pool.submit(at_work, stop, hand_of(participant, begin_next(participant)))
                wait_until(partial(has_begun, own_live, user_id), "them to be at work")
                erased = chief.delete(f"/api/studies/{study['id']}/participants/{invited['id']}")
                assert erased.status_code == 204
                wrong = [answer for answer in theirs.result() if answer.status_code not in OK | SHUT_OUT]
                assert not [answer.text for answer in wrong]
                assert rows_of(own_live, user_id) == 0
                assert export.result()["state"] == "done"
        finally:
            stop.set()
        assert not [answer.text for answer in others.result() if answer.status_code not in OK]
    sequence = [event["sequence"] for event in log_of(ann, mine["id"])]
    assert sequence == sorted(set(sequence))
