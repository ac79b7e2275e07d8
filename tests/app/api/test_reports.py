"""Reports over REST: curves, choices, files, and who may see them."""

import numpy as np
import pytest

from tests.app.analysis.hand_made import at
from tests.app.analysis.hand_made_study import HandMadeStudy, every_half_second, two_moves
from tests.app.rest import begin, sentence


@pytest.fixture(scope="module")
def study(server) -> HandMadeStudy:
    """Two novices by hand with snaps from every sample; no expert."""
    study = HandMadeStudy(server.services.database, groups={"novice": 2, "expert": 1})
    for code, end in (("P1", 6.0), ("P2", 8.0)):
        participant = study.participant(code)
        for mode in ("accurate", "quick"):
            registration = study.trial(participant, two_moves(3.0, end, at(0.0)), mode=mode)
            assert registration is not None
            study.snaps(registration, every_half_second(end, at(0.002, 0.02)))
    return study


@pytest.fixture(scope="module")
def url(study: HandMadeStudy) -> str:
    return f"/api/reports/{study.id}"


def test_a_report_tells_curves_and_all_that_is_read_off_them(url, reviewer):
    report = reviewer.get(url).json()
    assert report["choices"]["group"] == ["novice", "expert"] and report["groups"] == {
        "novice": 2,
        "expert": 0,
    }
    assert report["trials"] == 4 and len(report["cells"]) == 4
    cell = next(one for one in report["cells"] if (one["mode"], one["error"]) == ("accurate", "translation"))
    first, *_, last = cell["human"]["points"]
    assert first["margin"] == pytest.approx(0.1) and first["seconds"] == 0.0 and first["operators"] == 2
    assert last["seconds"] == pytest.approx(6.0) and (last["low"], last["high"]) == (5.0, 7.0)
    assert last["registration_id"] is not None
    assert (
        cell["stg"]["default"]["points"][-1]["seconds"] is None
        and cell["stg"]["default"]["points"][-1]["share"] == 0.0
    )
    assert cell["stg"]["default"]["hand_off"]["saved"] == pytest.approx(5.9)
    assert cell["stg"]["default"]["hand_off"]["caution"].startswith("This point tells little: 2 operators")
    assert cell["human"]["fitts_caution"].startswith("There is no line") == (cell["human"]["fitts"] is None)
    assert any("a snap worsens it; rotation error" in gain["sentence"] for gain in report["gains"])
    assert "group expert" in [remark["about"] for remark in report["remarks"]]


def test_a_part_can_be_asked_for(url, reviewer):
    quick = reviewer.get(url, params={"mode": "quick", "error": "rotation"}).json()
    assert [(one["mode"], one["error"]) for one in quick["cells"]] == [("quick", "rotation")]
    assert quick["choices"]["mode"] == ["accurate", "quick"]
    charged = reviewer.get(url, params={"snap_seconds": 2.0, "error": "translation"}).json()
    assert charged["cells"][0]["stg"]["default"]["points"][0]["seconds"] == 2.0


def test_files_are_served_and_are_the_same_bytes_each_time(url, reviewer):
    for name, start in (
        ("figure.svg", b"<?xml"),
        ("figure.pdf", b"%PDF"),
        ("report.html", b"<!doctype"),
        ("curves.parquet", b"PAR1"),
    ):
        answer, again = (reviewer.get(f"{url}/files/{name}") for _ in range(2))
        assert answer.status_code == 200 and answer.content.startswith(start)
        assert answer.content == again.content and name in answer.headers["content-disposition"]
    table = reviewer.get(f"{url}/files/curves.csv", params={"mode": "quick"})
    assert "quick" in table.text and "accurate" not in table.text
    assert "it has figure.svg" in sentence(reviewer.get(f"{url}/files/secrets.txt"), 404)


def test_new_results_are_seen_at_once(study, url, reviewer):
    before = reviewer.get(url).json()["trials"]
    study.trial(study.participant("P3"), two_moves(2.0, 4.0, at(0.0)), condition="snap")
    after = reviewer.get(url).json()
    assert after["trials"] == before + 1 and after["choices"]["condition"] == ["manual", "snap"]


def test_what_is_not_there_is_said_in_one_sentence(url, reviewer):
    assert sentence(reviewer.get("/api/reports/9999"), 404) == "There is no study 9999."
    assert "there are: novice, expert" in sentence(reviewer.get(url, params={"group": "masters"}), 422)
    sentence(reviewer.get(url, params={"snap_seconds": -1}), 422)


def test_the_team_s_own_work_has_a_report_too(server, operator, reviewer):
    registration = begin(operator)
    base = f"/api/registrations/{registration['id']}"
    T = np.array(registration["T_world_object"])
    T[0, 3] += 0.05
    operator.put(f"{base}/pose", json={"T_world_object": T.tolist()})
    assert operator.post(f"{base}/submit").status_code == 200
    team = reviewer.get("/api/reports/team").json()
    (row,) = team["rows"]
    assert (row["operator"], row["registrations"], row["accepted"]) == ("olga", 1, None)
    assert team["choices"]["operator"] == ["olga"] and "Too few snaps" in team["advice"][0]["text"]
    assert team["cells"][0]["human"]["points"][-1]["share"] == 1.0
    week = reviewer.get("/api/reports/team", params={"week": row["week"]}).json()
    assert len(week["rows"]) == 1
    assert "'nobody' is not in any submitted work" in sentence(
        reviewer.get("/api/reports/team", params={"operator": "nobody"}), 422
    )


def test_only_reviewers_see_reports(url, operator):
    for path in (url, f"{url}/files/curves.csv", "/api/reports/team"):
        assert "needs the role reviewer" in sentence(operator.get(path), 403)
