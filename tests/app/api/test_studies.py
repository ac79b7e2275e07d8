"""Studies for those who run them: set up, previewed, followed, closed; erased and withdrawn participants."""

import csv
import io

import httpx
import pytest

from tests.app.api.study_rest import begin_next, do_next, invite, new_study, next_of, plan_of, take_part
from tests.app.rest import sentence


def test_the_order_is_shown_before_anything_is_kept(chief):
    plan = plan_of(chief)
    before = chief.get("/api/studies").json()
    answer = chief.post("/api/studies/preview", json={"plan": plan, "seed": 5})
    preview = answer.json()
    assert preview["rows_of_balance"] == 2
    assert preview["minutes"] in (7.0, 8.0) and preview["minutes_a_task"] == {"accurate": 2.0, "quick": 1.0}
    first, second = preview["orders"]
    assert [slot["is_practice"] for slot in first] == [True] + [False] * 4
    assert {slot["mode"] for slot in first[1:3]} != {slot["mode"] for slot in second[1:3]}
    assert chief.get("/api/studies").json() == before


def test_a_participant_does_what_the_preview_showed(server, chief):
    study = new_study(chief)
    orders = chief.post("/api/studies/preview", json={"plan": study["plan"], "seed": study["seed"]}).json()[
        "orders"
    ]
    client = take_part(server, invite(chief, study)["link"])
    for slot in orders[0]:
        task = chief.get(f"/api/tasks/{next_of(client)['task']['id']}").json()
        shown = {
            "scene_id": task["scene"]["id"],
            "object_id": task["object"]["id"],
            "instance": task["instance"],
        }
        assert (shown, task["mode"], task["condition"]) == (slot["task"], slot["mode"], slot["condition"])
        do_next(client)
    assert next_of(client)["screens"] == ["thanks"]


def test_a_seed_is_drawn_and_told_where_none_is_given(chief):
    body = {"name": "with a drawn seed", "plan": plan_of(chief)}
    study = chief.post("/api/studies", json=body).json()
    assert study["seed"] >= 0
    assert "already is a study named" in sentence(chief.post("/api/studies", json=body), 409)


@pytest.mark.parametrize(
    ("change", "status", "words"),
    [
        ({"tasks": []}, 422, "body.plan.tasks"),
        ({"groups": {"novice": 0}}, 422, "body.plan.groups.novice"),
        ({"groups": {"novice": 1, " novice": 3}}, 422, "body.plan.groups: novice is there twice"),
        ({"tasks": [{"scene_id": 999, "object_id": 1}]}, 409, "there is no scene 999"),
        ({"tasks": [{"scene_id": 1, "object_id": 999}]}, 409, "object 999 is none of the dataset"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_by_preview_and_set_up(chief, change, status, words):
    plan = plan_of(chief, **change)
    for path, body in (("preview", {"seed": 1}), ("", {"name": "impossible"})):
        answer = chief.post(f"/api/studies/{path}".rstrip("/"), json=body | {"plan": plan})
        assert words in sentence(answer, status)


def test_progress_tells_how_far_everybody_is(server, chief):
    study = new_study(chief)
    client = take_part(server, invite(chief, study)["link"])
    invite(chief, study, "expert")
    do_next(client)  # practice
    do_next(client)
    participants = chief.get(f"/api/studies/{study['id']}").json()["participants"]
    assert [(p["code"], p["group"], p["done"], p["total"]) for p in participants] == [
        ("P01", "novice", 1, 4),
        ("P02", "expert", 0, 4),
    ]


def test_answers_are_a_table_that_tells_empty_from_declined_and_runs_nothing(server, chief):
    optional = {"text": "Hand?", "choices": ["left", "right"], "optional": True}
    free = {"text": "Where?", "optional": True}
    study = new_study(chief, questions=[optional, free])
    for answers in ({"Where?": '=HYPERLINK("http://x","y")'}, {"Hand?": "Rather not say"}):
        client = take_part(server, invite(chief, study, "expert")["link"])
        assert client.post("/api/participation/answers", json={"answers": answers}).status_code == 200
    gone = invite(chief, study)
    left = take_part(server, gone["link"])
    assert left.post("/api/participation/answers", json={"answers": {"Hand?": "left"}}).status_code == 200
    chief.post(f"/api/studies/{study['id']}/participants/{gone['id']}/withdraw")
    answer = chief.get(f"/api/studies/{study['id']}/answers.csv")
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert list(csv.reader(io.StringIO(answer.text))) == [
        ["code", "group", "is_simulated", "question", "answer", "status"],
        ["P01", "expert", "False", "Hand?", "", "left empty"],
        ["P01", "expert", "False", "Where?", '\'=HYPERLINK("http://x","y")', "answered"],
        ["P02", "expert", "False", "Hand?", "Rather not say", "declined"],
        ["P02", "expert", "False", "Where?", "", "left empty"],
    ]


def test_a_complete_group_takes_nobody_more(chief):
    study = new_study(chief)
    invite(chief, study)
    answer = chief.post(f"/api/studies/{study['id']}/participants", json={"group": "novice"})
    assert "'novice' is complete: 1 of 1 operators" in sentence(answer, 409)


def test_closing_ends_it_for_everybody(server, chief):
    study = new_study(chief)
    link = invite(chief, study)["link"]
    client = take_part(server, link)
    registration = begin_next(client)
    assert chief.post(f"/api/studies/{study['id']}/close").json()["state"] == "closed"
    assert server.services.live_sessions.live_state(registration["id"]) is None
    sentence(client.get("/api/participation"), 401)
    again = server.stranger().post("/api/sign-in/study", json={"token": link.partition("#")[2]})
    assert "this link is not valid" in sentence(again, 401)


def test_a_new_link_replaces_the_old(server, chief):
    study = new_study(chief)
    invited = invite(chief, study)
    fresh = chief.post(f"/api/studies/{study['id']}/participants/{invited['id']}/link").json()
    assert fresh["code"] == invited["code"] and fresh["link"] != invited["link"]
    take_part(server, fresh["link"])
    old = server.stranger().post("/api/sign-in/study", json={"token": invited["link"].partition("#")[2]})
    sentence(old, 401)


def test_erasing_takes_everything_but_that_somebody_was_there(server, chief):
    study = new_study(chief)
    invited = invite(chief, study)
    client = take_part(server, invited["link"])
    registration = begin_next(client)
    url = f"/api/studies/{study['id']}/participants/{invited['id']}"
    assert chief.delete(url).status_code == 204
    sentence(client.get(f"/api/registrations/{registration['id']}"), 401)
    assert server.services.log.events(registration["id"]) == []
    (erased,) = chief.get(f"/api/studies/{study['id']}").json()["participants"]
    assert erased["withdrawn_at"] and erased["total"] == 0


def test_a_participant_of_another_study_is_not_found(chief):
    one, other = new_study(chief), new_study(chief)
    invited = invite(chief, one)
    url = f"/api/studies/{other['id']}/participants/{invited['id']}"
    for answer in (chief.delete(url), chief.post(f"{url}/withdraw"), chief.post(f"{url}/link")):
        assert f"no participant {invited['id']} of study {other['id']}" in sentence(answer, 404)
    sentence(chief.get("/api/studies/999999"), 404)


def test_studies_are_for_administrators(reviewer: httpx.Client, operator: httpx.Client):
    for client in (reviewer, operator):
        assert "needs the role admin" in sentence(client.get("/api/studies"), 403)
        sentence(client.post("/api/studies", json={}), 403)
