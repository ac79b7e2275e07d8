"""The risk of a dataset, which a lead sets, and what snaps make of it and of the dataset's calibration."""

import httpx
import numpy as np
import pytest

from app.config import RISK
from app.storage.roles import Role
from app.storage.tables import CalibrationRow
from registration_core import ALGORITHM, acceptance
from registration_core.geometry import pose
from registration_core.judge.acceptance import shipped_calibration
from tests.app.live import LiveServer
from tests.app.rest import begin, finished_snap, put_pose, sentence, url_of
from tests.app.small_dataset import TOOL, true_pose

NEAR = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))


def calibrate(server: LiveServer, **changes: object) -> None:
    """Let 150 registrations of dataset 1 have taught that it is right from a confidence of 0.01 on."""
    values = {
        "dataset_id": 1,
        "algorithm": ALGORITHM,
        "stretch": 1.0,
        "shift": 3.0,
        "confidences": list(np.linspace(0.01, 0.99, 150)),
        "right": [True] * 150,
        "gains": {"registrations": 150},
    }
    with server.services.database.write() as session:
        session.query(CalibrationRow).delete()
        session.add(CalibrationRow(**(values | changes)))


def test_a_lead_sets_the_risk_and_takes_it_back(operator: httpx.Client, reviewer: httpx.Client) -> None:
    url = "/api/datasets/1"
    assert operator.get(url).json()["risk"] == RISK
    assert "needs the role reviewer" in sentence(operator.put(f"{url}/risk", json={"risk": 0.1}), 403)
    assert reviewer.put(f"{url}/risk", json={"risk": 0.1}).json()["risk"] == 0.1
    assert operator.get(url).json()["risk"] == 0.1
    assert reviewer.put(f"{url}/risk", json={"risk": None}).json()["risk"] == RISK
    assert "no dataset" in sentence(reviewer.put("/api/datasets/99/risk", json={"risk": 0.1}), 404)


@pytest.mark.parametrize("risk", [0, 1, -0.1, 1e-5, "much"])
def test_a_risk_that_is_no_share_is_refused(reviewer: httpx.Client, risk: float | str) -> None:
    assert "risk" in sentence(reviewer.put("/api/datasets/1/risk", json={"risk": risk}), 422)
    assert "risk" in sentence(reviewer.get("/api/datasets/1/acceptance", params={"risk": risk}), 422)


def test_a_dataset_tells_which_confidence_its_risk_asks_for(
    server: LiveServer, operator: httpx.Client, reviewer: httpx.Client
) -> None:
    shipped = {"is_own": False, "rests_on": len(shipped_calibration())}
    told = operator.get("/api/datasets/1").json()
    assert (told["risk_is_set"], told["risk_of_settings"]) == (False, RISK)
    assert told["acceptance"] == {"risk": RISK, "threshold": acceptance(RISK), "needs": 45} | shipped
    tried = reviewer.get("/api/datasets/1/acceptance", params={"risk": 0.0001}).json()
    assert tried == {"risk": 0.0001, "threshold": None, "needs": 23_025} | shipped
    assert not operator.get("/api/datasets/1").json()["risk_is_set"]  # trying one sets none
    assert "reviewer" in sentence(operator.get("/api/datasets/1/acceptance", params={"risk": 0.1}), 403)

    calibrate(server)
    told = reviewer.put("/api/datasets/1/risk", json={"risk": 0.02}).json()
    assert told["risk_is_set"]
    assert told["acceptance"] == {
        "risk": 0.02,
        "threshold": 0.0,
        "is_own": True,
        "rests_on": 150,
        "needs": 114,
    }
    too_little = reviewer.get("/api/datasets/1/acceptance", params={"risk": 0.01}).json()
    assert (too_little["is_own"], too_little["needs"]) == (False, 230)
    calibrate(server, algorithm="another")
    assert not reviewer.get("/api/datasets/1/acceptance").json()["is_own"]
    reviewer.put("/api/datasets/1/risk", json={"risk": None})


def test_a_snap_says_what_is_to_be_thought_of_it(server: LiveServer, operator: httpx.Client) -> None:
    calibrate(server)
    registration = begin(operator)
    put_pose(operator, registration, NEAR)
    snap_id = operator.post(f"{url_of(registration)}/snaps", json={"seed": 7}).json()["id"]
    snap = finished_snap(operator, snap_id)
    estimate, assessment = snap["estimate"], snap["estimate"]["assessment"]
    certificates = estimate["certificates"]
    assert snap["withheld"] is None
    assert assessment["confidence"] > estimate["confidence"]
    assert (assessment["risk"], assessment["threshold"]) == (RISK, 0.0)
    sure = certificates["observably_correct"] and certificates["non_degenerate"]
    assert sure == (assessment["verdict"] == "accept")
    assert assessment["reasons"]
    state = operator.get(url_of(registration)).json()
    assert state["assessment"] == assessment
    assert state["confidence"] == assessment["confidence"]


def test_leads_see_in_the_list_what_to_look_at(own_live: LiveServer) -> None:
    worker, lead = own_live.script("worker"), own_live.script("lead", Role.REVIEWER)
    registration = begin(worker)
    put_pose(worker, registration, NEAR)
    for seed in (7, 8):
        snap_id = worker.post(f"{url_of(registration)}/snaps", json={"seed": seed}).json()["id"]
        last = finished_snap(worker, snap_id)["estimate"]["assessment"]
    begin(own_live.script("idler"))
    seen_by = lambda who: [one["assessment"] for one in who.get("/api/tasks").json()["items"][0]["operators"]]  # noqa: E731
    assert seen_by(lead) == [last, None]
    assert seen_by(worker) == [None, None]


def test_a_dataset_tells_of_its_calibration(server: LiveServer, operator: httpx.Client) -> None:
    calibrate(server)
    told = operator.get("/api/datasets/1").json()["calibration"]
    assert (told["registrations"], told["is_current"], told["shift"]) == (150, True, 3.0)
    calibrate(server, algorithm="another")
    assert not operator.get("/api/datasets/1").json()["calibration"]["is_current"]
