"""Taking part: the way through a study, and that a participant sees and does nothing else."""

import re

import numpy as np
import pytest

from app.storage.roles import Role
from tests.app.api.study_rest import (
    AGREE,
    QUESTION,
    begin_next,
    do_next,
    invite,
    new_study,
    next_of,
    take_part,
)
from tests.app.api.test_openapi import OPERATIONS, names
from tests.app.rest import begin, put_pose, sentence

OWN = {
    "/api/health",
    "/api/sign-in",
    "/api/sign-in/link",
    "/api/sign-in/study",
    "/api/sign-out",
    "/api/me",
    "/api/participation",
    "/api/participation/consent",
    "/api/participation/answers",
    "/api/participation/withdraw",
    "/api/tasks/{task_id}",
    "/api/tasks/{task_id}/registration",
    "/api/scenes/{scene_id}",
    "/api/frames/{frame_id}/color.png",
    "/api/objects/{object_id}",
    "/api/objects/{object_id}/outline.mesh",
    "/api/objects/{object_id}/textured.mesh",
    "/api/snaps/{snap_id}",
    "/api/searches/{search_id}",
}
"""What participants may ask for at all, beside their own registrations."""
NOT_OF_REGISTRATIONS = {"events", "trace", "replay"}


@pytest.fixture
def study(chief):
    return new_study(chief, practice=[])


@pytest.fixture
def ann(server, chief, study):
    """A participant."""
    return take_part(server, invite(chief, study)["link"])


def test_the_way_from_consent_to_thanks(server, chief):
    study = new_study(chief, consent=AGREE, questions=[QUESTION])
    client = take_part(server, invite(chief, study)["link"])
    place = next_of(client)
    assert (place["study"], place["code"], place["consent"]) == (study["name"], "P01", AGREE)
    assert place["screens"] == ["consent", "questions", "practice", "instructions", "task"]
    refused = client.post(f"/api/tasks/{place['task']['id']}/registration")
    assert "begins with its first page" in sentence(refused, 409)
    assert client.post("/api/participation/consent").json()["screens"][0] == "questions"
    wrong = client.post("/api/participation/answers", json={"answers": {QUESTION["text"]: "perhaps"}})
    assert "choose one of yes, no" in sentence(wrong, 409)
    answered = client.post("/api/participation/answers", json={"answers": {QUESTION["text"]: "no"}})
    assert answered.json()["screens"] == ["practice", "instructions", "task"]
    seen = []
    while (place := next_of(client))["task"]:
        seen.append((place["done"], place["task"]["is_practice"], place["screens"]))
        do_next(client)
    assert seen == [
        (0, True, ["practice", "instructions", "task"]),
        (0, False, ["instructions", "task"]),
        (1, False, ["task"]),
        (2, False, ["break", "instructions", "task"]),  # the other mode begins
        (3, False, ["task"]),
    ]
    assert (place["done"], place["total"], place["screens"]) == (4, 4, ["thanks"])
    (row,) = chief.get(f"/api/studies/{study['id']}").json()["participants"]
    assert row["finished_at"] and row["answers"] == {QUESTION["text"]: "no"}


def test_the_page_is_told_what_may_be_left_empty_and_what_is_offered(server, chief):
    optional = {"text": "Hand?", "choices": ["left", "right"], "optional": True}
    study = new_study(chief, practice=[], questions=[QUESTION, optional])
    client = take_part(server, invite(chief, study)["link"])
    assert next_of(client)["questions"] == [
        QUESTION | {"optional": False},
        optional | {"choices": ["left", "right", "Rather not say"]},
    ]
    answered = client.post("/api/participation/answers", json={"answers": {QUESTION["text"]: "no"}})
    assert answered.json()["screens"] == ["instructions", "task"]


def test_who_stopped_goes_on_where_they_were(server, chief, study):
    link = invite(chief, study)["link"]
    client = take_part(server, link)
    registration = begin_next(client)
    later = take_part(server, link)
    assert next_of(later)["screens"] == ["task"]
    assert begin_next(later)["id"] == registration["id"]


def test_instructions_are_those_of_the_mode(ann, study):
    task = next_of(ann)["task"]
    assert task["instructions"] == study["plan"]["instructions"][task["mode"]]


def test_tasks_are_done_in_their_order(ann, study, chief):
    tasks = {next_of(ann)["task"]["id"]}
    rows = chief.get("/api/tasks").json()["items"]
    assert "no task" in sentence(ann.post(f"/api/tasks/{rows[-1]['id']}/registration"), 404)
    do_next(ann)
    later = next_of(ann)["task"]["id"]
    assert later not in tasks
    done = tasks.pop()
    assert ann.post(f"/api/tasks/{done}/registration").json()["state"] == "submitted"


def test_a_later_task_has_to_wait(server, chief, study):
    one, other = (take_part(server, invite(chief, study, "expert")["link"]) for _ in range(2))
    ids = [next_of(one)["task"]["id"], next_of(other)["task"]["id"]]
    assert ids[0] != ids[1]  # of another row
    assert "not your next task" in sentence(one.post(f"/api/tasks/{ids[1]}/registration"), 409)


def test_withdrawing_ends_it_at_once(server, chief, study):
    invited = invite(chief, study)
    client = take_part(server, invited["link"])
    registration = begin_next(client)
    assert client.post("/api/participation/withdraw").status_code == 204
    sentence(client.get("/api/participation"), 401)
    assert server.services.live_sessions.live_state(registration["id"]) is None
    (row,) = chief.get(f"/api/studies/{study['id']}").json()["participants"]
    assert row["withdrawn_at"]


def is_open_to_participants(path):
    of_registration = path.startswith("/api/registrations/")
    return path in OWN or (of_registration and path.rpartition("/")[2] not in NOT_OF_REGISTRATIONS)


FOREIGN = [operation for operation in OPERATIONS if not is_open_to_participants(operation[0])]


@pytest.mark.parametrize(("path", "method"), FOREIGN, ids=names(FOREIGN))
def test_everything_else_is_refused(ann, path, method):
    url = re.sub(r"{\w+}", "1", path)
    assert re.search(
        r"needs the role (operator|reviewer|admin)", sentence(ann.request(method, url, json={}), 403)
    )


def test_of_registrations_tasks_scenes_and_objects_only_their_own_are_there(server, ann, operator, chief):
    theirs = begin(operator)
    unknown = theirs["task_id"]
    mine = begin_next(ann)
    task = ann.get(f"/api/tasks/{mine['task_id']}").json()
    assert task["mine"] == mine["id"]
    assert [one["registration_id"] for one in task["operators"]] == [mine["id"]]
    assert ann.get(f"/api/scenes/{task['scene']['id']}").status_code == 200
    assert ann.get(f"/api/frames/{mine['frame_id']}/color.png").status_code == 200
    assert ann.get(f"/api/objects/{task['object']['id']}/outline.mesh").status_code == 200
    for path in (
        f"registrations/{theirs['id']}",
        f"tasks/{unknown}",
        "scenes/999",
        "objects/999",
        f"registrations/{theirs['id']}/things",
    ):
        sentence(ann.get(f"/api/{path}"), 404)


def test_nothing_of_others_is_known_in_a_trial(server, ann, operator, chief):
    for index, _ in enumerate(operator.get("/api/tasks").json()["items"]):
        operator.post(f"/api/registrations/{begin(operator, index)['id']}/submit")
    mine = begin_next(ann)
    url = f"/api/registrations/{mine['id']}"
    (thing,) = ann.get(f"{url}/things").json()["items"]
    assert thing["is_current"] and thing["state"] == "open" and thing["T_world_object"] is None
    assert server.live_session(mine["id"]).neighbours.known == ()
    assert "'copy'" in sentence(ann.get(f"{url}/copies"), 409)


def test_nothing_of_a_study_is_known_outside(server, chief, study, ann, operator, reviewer):
    do_next(ann)
    for client in (operator, reviewer, chief):
        tasks = client.get("/api/tasks").json()["items"]
        assert {t["condition"] for t in tasks} == {"snap"}
        assert not any("study" in one["name"] for t in tasks for one in t["operators"])
    mine = begin(operator)
    copies = operator.get(f"/api/registrations/{mine['id']}/copies").json()["items"]
    assert not any("study" in copy["operator"] for copy in copies)
    dataset = chief.get("/api/datasets/1").json()
    assert dataset["tasks"] == len(tasks)


def test_a_task_of_studies_becomes_everybodys_when_it_is_asked_for(chief):
    study = new_study(chief, practice=[], conditions=["auto"])
    ref = study["plan"]["tasks"][0]
    body = {"scene_id": ref["scene_id"], "object_id": ref["object_id"], "mode": "quick", "condition": "auto"}
    created = chief.post("/api/tasks", json=body).json()
    assert created["instance"] == 0
    assert created["id"] in {task["id"] for task in chief.get("/api/tasks?limit=500").json()["items"]}
    assert chief.post("/api/tasks", json=body).json()["instance"] == 1


def test_by_hand_alone_means_the_gizmo(ann):
    mine = begin_next(ann)
    url = f"/api/registrations/{mine['id']}"
    assert mine["tools"] == [] and mine["agreement"] is None
    assert "'precision'" in sentence(put_pose(ann, mine, np.eye(4)), 409)
    refused = {
        "snaps": {},
        "searches": {},
        "nudge": {"axes": "view"},
        "rest": {},
        "place": {"frame_id": mine["frame_id"], "column": 80, "row": 60},
        "skip": {"reason": "no depth"},
        "copy": {"registration_id": 1},
    }
    for action, body in refused.items():
        sentence(ann.post(f"{url}/{action}", json=body), 409)
    assert ann.post(f"{url}/submit").status_code == 200
    assert "'ending'" in sentence(ann.post(f"{url}/reopen"), 409)


def test_participation_is_for_participants(server, operator):
    assert "take part in no study" in sentence(operator.get("/api/participation"), 403)
    stray = server.script("stray", Role.PARTICIPANT)
    assert "take part in no study" in sentence(stray.get("/api/participation"), 409)


def test_pages_lead_participants_to_their_study(ann):
    for path in ("/", "/export", "/studies", "/replay/1"):
        answer = ann.get(path)
        assert (answer.status_code, answer.headers["location"]) == (303, "/participate")
    assert ann.get("/label/1").status_code == 200
