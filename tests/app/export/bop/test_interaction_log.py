"""The interaction log says everything that happened, and no names."""

import json
from datetime import UTC, timedelta
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from app.export.bop.interaction_log import LOOSE_FIELDS, ROWS_AT_ONCE, write_interaction_log
from app.storage.tables import Dataset, EstimateRow, Event, Frame
from registration_core.geometry import pose
from tests.app.export.site import POSED, START, TOOL, Site, true_pose

BEFORE, AFTER = np.eye(4).tolist(), true_pose(POSED, TOOL).tolist()
FREE_TURN = {"kind": "free motion", "motion": "turn", "axis": [0.0, 0.0, 1.0], "extent": 0.4}
PATH = [[0.0, 0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0], [0.05, 0.1, 0.2, 0.4, 1.0, 0.0, 0.0, 0.0]]


def event(site: Site, registration_id: int, sequence: int, kind: str, **values: object) -> Event:
    return Event(
        registration_id=registration_id,
        sequence=sequence,
        kind=kind,
        **({"actor": "human", "user_id": site.users[0]} | values),
        utc=START + timedelta(seconds=sequence),
        monotonic_seconds=100.0 + sequence,
        boot_id="boot-1",
    )


def fill(site: Site) -> int:
    """A registration with a drag, a snap with its estimate, and a submission; its id."""
    registration_id = site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL))
    with site.database.write() as session:
        frame = session.query(Frame).filter(Frame.image_id == 5).one()
        session.add_all(
            [
                event(site, registration_id, 1, "opened"),
                event(
                    site, registration_id, 2, "drag",
                    T_before=BEFORE, T_after=AFTER, dof=["tx", "rz"], path=PATH, duration_seconds=0.7,
                ),
                event(
                    site, registration_id, 3, "snap_applied",
                    actor="machine", T_before=AFTER, T_after=AFTER, snap_id="s1", detail={"confidence": 0.9},
                ),
                event(site, registration_id, 4, "submit", actor="script", user_id=site.users[1]),
                EstimateRow(
                    snap_id="s1",
                    registration_id=registration_id,
                    frame_id=frame.id,
                    T_world_object_start=BEFORE,
                    T_world_object=AFTER,
                    T_camera_object=AFTER,
                    confidence=0.9,
                    covariance=np.eye(6).tolist(),
                    hypotheses=[{"T_camera_object": AFTER, "weight": 1.0}],
                    ambiguities=[FREE_TURN],
                    certificates={"non_degenerate": False, "unused": []},
                    assessment={"verdict": "look", "reasons": ["two poses fit"]},
                    converged=True,
                    seed=2**40,
                    config={"particles": 625, "nested": {"a": 1}},
                    start_spread=[0.03, 0.35],
                    version="0.1.0",
                    algorithm="0123456789ab",
                    hardware="a machine",
                    seconds=0.02,
                    evaluations=14000,
                    utc=START,
                ),
            ]
        )  # fmt: skip
    return registration_id


def written(site: Site, folder: Path) -> tuple[list[dict], list[dict]]:
    """Events and estimates of the JSON lines."""
    with site.database.read() as session:
        write_interaction_log(session, site.dataset_id, folder)
    events, estimates = (
        [json.loads(line) for line in (folder / f"{name}.jsonl").read_text().splitlines()]
        for name in ("events", "estimates")
    )
    return events, estimates


def test_every_event_is_there_in_order_with_all_that_is_known_of_it(site: Site, tmp_path: Path) -> None:
    registration_id = fill(site)
    events, _ = written(site, tmp_path / "log")
    assert [row["kind"] for row in events] == ["opened", "drag", "snap_applied", "submit"]
    assert [row["actor"] for row in events] == ["human", "human", "machine", "script"]
    drag = events[1]
    assert drag == {
        "registration_id": registration_id,
        "task_id": site.tasks[POSED, TOOL],
        "operator": f"operator-{site.users[0]}",
        "split": "test",
        "scene_id": 1,
        "obj_id": TOOL,
        "instance": 0,
        "mode": "accurate",
        "condition": "snap",
        "sequence": 2,
        "kind": "drag",
        "actor": "human",
        "utc": "2026-01-02T03:04:07Z",
        "monotonic_seconds": 102.0,
        "boot_id": "boot-1",
        "duration_seconds": 0.7,
        "T_world_object_before": BEFORE,
        "T_world_object_after": AFTER,
        "dof": ["tx", "rz"],
        "path": PATH,
        "snap_id": None,
        "detail": {},
    }
    assert events[3]["operator"] == f"operator-{site.users[1]}"


def test_an_estimate_has_what_repeats_it(site: Site, tmp_path: Path) -> None:
    fill(site)
    _, (estimate,) = written(site, tmp_path / "log")
    assert (estimate["image_id"], estimate["seed"], estimate["version"]) == (5, 2**40, "0.1.0")
    assert estimate["algorithm"] == "0123456789ab"
    assert estimate["config"] == {"particles": 625, "nested": {"a": 1}}
    assert estimate["start_spread"] == [0.03, 0.35]
    assert estimate["T_world_object_start"] == BEFORE
    assert estimate["hypotheses"] == [{"T_camera_object": AFTER, "weight": 1.0}]
    assert estimate["ambiguities"] == [FREE_TURN]
    assert estimate["certificates"]["non_degenerate"] is False
    assert estimate["assessment"]["verdict"] == "look"


def test_parquet_holds_the_same(site: Site, tmp_path: Path) -> None:
    fill(site)
    folder = tmp_path / "log"
    loose = LOOSE_FIELDS
    for name, rows in zip(("events", "estimates"), written(site, folder), strict=True):
        table = pq.read_table(folder / f"{name}.parquet").to_pylist()
        assert len(table) == len(rows)
        for got, wanted in zip(table, rows, strict=True):
            got["utc"] = got["utc"].astimezone(UTC).isoformat().replace("+00:00", "Z")
            got |= {key: json.loads(got[key]) for key in loose if key in got}
            assert got == wanted


def test_no_name_of_a_person_is_written(site: Site, tmp_path: Path) -> None:
    fill(site)
    written(site, tmp_path / "log")
    for path in (tmp_path / "log").iterdir():
        content = path.read_bytes()
        assert b"Lovelace" not in content and b"Hopper" not in content


def test_other_datasets_stay_out(site: Site, tmp_path: Path) -> None:
    fill(site)
    with site.database.write() as session:
        other = Dataset(name="other")
        session.add(other)
        session.flush()
        site.dataset_id = other.id
    assert written(site, tmp_path / "log") == ([], [])
    assert pq.read_table(tmp_path / "log" / "events.parquet").num_rows == 0


def test_long_logs_are_written_in_parts(site: Site, tmp_path: Path) -> None:
    count = 2 * ROWS_AT_ONCE + 1
    registration_id = site.submit(site.tasks[POSED, TOOL], pose.exp(np.zeros(6)))
    with site.database.write() as session:
        session.add_all(event(site, registration_id, index + 1, "undo") for index in range(count))
    events, _ = written(site, tmp_path / "log")
    assert [row["sequence"] for row in events] == list(range(1, count + 1))
    assert pq.ParquetFile(tmp_path / "log" / "events.parquet").metadata.num_rows == count
