"""Whole exports: the same bytes each time, nothing half-written, and a job that says how it ended."""

import csv
import errno
import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from sqlalchemy import select

from app.export import job
from app.export.content.selection import ExportError
from app.export.gate.instance import GateError
from app.export.job import ExportSummary, export_dataset, run_job
from app.storage.tables import Export, Scene, User
from registration_core.bop.dataset import read_dataset
from registration_core.geometry import pose
from tests.app.export.site import NEAR_VIEW, POSED, TOOL, Site, ignore_progress, true_pose


def export(site: Site, target: Path) -> ExportSummary:
    return export_dataset(site.database, site.files, site.dataset_id, target, ignore_progress)


def request(site: Site, scene_ids: list[int] | None = None, without: Sequence[int] = ()) -> int:
    """A queued export; its id."""
    choice = {"scene_ids": scene_ids, "without": list(without)}
    with site.database.write() as session:
        row = Export(dataset_id=site.dataset_id, format="bop", choice=choice, user_id=site.users[0])
        session.add(row)
        session.flush()
        return row.id


def row_of(site: Site, export_id: int) -> Export:
    with site.database.read() as session:
        return session.get_one(Export, export_id)


def submit_floating(site: Site, user: int = 0) -> None:
    """A pose 6 cm too near to the camera of image 0: the tool floats in the air."""
    T_camera_object = pose.inverse(NEAR_VIEW) @ true_pose(POSED, TOOL)
    T_camera_object[2, 3] -= 0.06
    site.submit(site.tasks[POSED, TOOL], NEAR_VIEW @ T_camera_object, user, minutes=1.0)


@pytest.mark.slow
def test_the_same_annotations_give_the_same_bytes(site: Site, tmp_path: Path) -> None:
    site.submit_all()
    summary = export(site, tmp_path / "1.zip")
    export(site, tmp_path / "2.zip")
    assert (tmp_path / "1.zip").read_bytes() == (tmp_path / "2.zip").read_bytes()
    assert summary == ExportSummary("Two_boxes_v1", scenes=2, images=7, annotations=6)


def test_a_zip_holds_what_a_folder_gets(site: Site, tmp_path: Path) -> None:
    site.submit_all()
    export(site, tmp_path / "data.zip")
    export(site, tmp_path / "folder")
    with zipfile.ZipFile(tmp_path / "data.zip") as zipped:
        packed = {name.removeprefix("Two_boxes_v1/"): zipped.read(name) for name in zipped.namelist()}
    on_disk = {
        path.relative_to(tmp_path / "folder").as_posix(): path.read_bytes()
        for path in (tmp_path / "folder").rglob("*")
        if path.is_file()
    }
    assert packed == on_disk
    assert "interaction_log/events.parquet" in packed


def test_progress_never_goes_back_and_ends_at_1(site: Site, tmp_path: Path) -> None:
    site.submit_all()
    reports: list[tuple[float, str]] = []
    export_dataset(
        site.database, site.files, site.dataset_id, tmp_path / "x.zip", lambda *report: reports.append(report)
    )
    shares = [share for share, _ in reports]
    assert shares == sorted(shares) and shares[0] >= 0.0 and shares[-1] == 1.0
    assert any("writing test/000001, image 5" in message for _, message in reports)


def test_an_existing_folder_is_not_touched(site: Site, tmp_path: Path) -> None:
    site.submit_all()
    (tmp_path / "folder").mkdir()
    with pytest.raises(ExportError, match="exists; choose another folder"):
        export(site, tmp_path / "folder")


def test_a_pose_off_the_measured_surface_stops_the_export(site: Site, tmp_path: Path) -> None:
    submit_floating(site)
    before = set(tmp_path.iterdir())
    with pytest.raises(
        GateError,
        match=r"^test/000001, image 0, object 3 \(entry 0\): the surface in this pose is \d+ mm off",
    ):
        export(site, tmp_path / "x.zip")
    assert set(tmp_path.iterdir()) == before


def test_a_pose_a_few_millimetres_off_passes(site: Site, tmp_path: Path) -> None:
    site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL) @ pose.exp([0.004, 0.003, 0, 0, 0, 0.05]))
    assert export(site, tmp_path / "x.zip").annotations == 1


def test_a_job_ends_with_a_stored_zip(site: Site) -> None:
    site.submit_all()
    export_id = request(site)
    assert run_job(site.database, site.files, export_id)
    row = row_of(site, export_id)
    assert (row.state, row.progress) == ("done", 1.0)
    assert row.message == "Scenes: 2, images: 7, annotated objects: 6."
    assert row.file_hash is not None
    with zipfile.ZipFile(site.files.path(row.file_hash)) as zipped:
        assert zipped.testzip() is None
        gt = json.loads(zipped.read("Two_boxes_v1/test/000002/scene_gt.json"))
    np.testing.assert_allclose(
        gt["0"][0]["cam_t_m2c"], 1000 * (pose.inverse(NEAR_VIEW) @ true_pose(POSED, TOOL))[:3, 3]
    )


@pytest.mark.slow
def test_equal_exports_are_stored_once(site: Site) -> None:
    site.submit_all()
    jobs = [request(site) for _ in range(2)]
    assert all(run_job(site.database, site.files, export_id) for export_id in jobs)
    assert len({row_of(site, export_id).file_hash for export_id in jobs}) == 1


@pytest.mark.parametrize(
    ("prepare", "message"),
    [
        (lambda site: None, "has no submitted registration; submit at least one, then export again"),
        (submit_floating, "test/000001, image 0, object 3 (entry 0): the surface in this pose is"),
    ],
)
def test_a_failed_job_says_why_and_serves_nothing(
    site: Site, prepare: Callable[[Site], None], message: str
) -> None:
    prepare(site)
    export_id = request(site)
    stored = sorted(site.files.root.rglob("*"))
    assert not run_job(site.database, site.files, export_id)
    row = row_of(site, export_id)
    assert row.state == "failed" and message in row.message and row.file_hash is None
    pictures = {site.files.path(failure["picture_hash"]) for failure in row.failures}
    new = set(site.files.root.rglob("*")) - set(stored)
    assert {path for path in new if path.is_file()} == pictures


def test_objects_that_do_not_pass_are_named_and_the_rest_goes_without_them(site: Site) -> None:
    site.submit_all()
    submit_floating(site, user=1)
    export_id = request(site)
    assert not run_job(site.database, site.files, export_id)
    (failure,) = row_of(site, export_id).failures
    with site.database.read() as session:
        operator = session.get_one(User, site.users[1]).name
    assert (failure["object"], failure["scene"], failure["image_id"]) == ("angle tool", "test/000001", 0)
    assert failure["operator"] == operator and failure["task_id"] == site.tasks[POSED, TOOL]
    assert "64 mm off" in failure["reason"]
    with Image.open(site.files.path(failure["picture_hash"])) as picture:
        picture.load()
        assert picture.format == "JPEG" and (np.asarray(picture).std() > 5)
    rest = request(site, without=[failure["registration_id"]])
    assert run_job(site.database, site.files, rest)
    assert row_of(site, rest).message == "Scenes: 2, images: 7, annotated objects: 6."  # the one before it


def test_a_pose_out_of_all_reach_is_named(site: Site) -> None:
    site.submit_all()
    T = np.eye(4)
    T[0, 3] = 1e308
    site.submit(site.tasks[POSED, TOOL], T, user=1, minutes=1.0)
    export_id = request(site)
    assert not run_job(site.database, site.files, export_id)
    row = row_of(site, export_id)
    assert "object 3" in row.message and "out of all reach" in row.message
    assert [failure["object"] for failure in row.failures] == ["angle tool"]


def test_one_scene_alone(site: Site) -> None:
    site.submit_all()
    with site.database.read() as session:
        scene = session.scalars(select(Scene).where(Scene.label == POSED)).one()
    export_id = request(site, scene_ids=[scene.id])
    assert run_job(site.database, site.files, export_id)
    assert row_of(site, export_id).message.startswith("Scenes: 1,")


def test_poses_alone_are_those_of_the_dataset(site: Site, tmp_path: Path) -> None:
    site.submit_all()
    export(site, tmp_path / "whole")
    export_dataset(
        site.database, site.files, site.dataset_id, tmp_path / "poses", ignore_progress, format_name="csv"
    )
    (path,) = (tmp_path / "poses").iterdir()
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    found = []
    for scene in read_dataset(tmp_path / "whole").scenes:
        for image in scene.images:
            found += [(scene.scene_id, image.image_id, truth) for truth in image.ground_truth or ()]
    assert len(rows) == len(found) > 0
    for row, (scene_id, image_id, truth) in zip(rows, found, strict=True):
        assert (int(row["scene_id"]), int(row["im_id"])) == (scene_id, image_id)
        assert int(row["obj_id"]) == truth.obj_id
        assert np.allclose(np.array(row["R"].split(), float), truth.T_camera_object[:3, :3].ravel())
        assert np.allclose(np.array(row["t"].split(), float) / 1000, truth.T_camera_object[:3, 3])


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "the disk is full; free some space"),
        (RuntimeError("surprise"), "the export failed unexpectedly (RuntimeError: surprise)"),
    ],
)
def test_what_nobody_foresaw_fails_the_job_too(
    site: Site, monkeypatch: pytest.MonkeyPatch, error: Exception, message: str
) -> None:
    def broken(*arguments: object) -> None:
        raise error

    site.submit_all()
    export_id = request(site)
    monkeypatch.setattr(job, "pack", broken)
    assert not run_job(site.database, site.files, export_id)
    assert row_of(site, export_id).state == "failed"
    assert message in row_of(site, export_id).message
    assert not list(site.files.root.glob("*export*"))


def test_a_stopped_job_says_so(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*arguments: object) -> None:
        raise SystemExit(1)

    site.submit_all()
    export_id = request(site)
    monkeypatch.setattr(job, "pack", stopped)
    with pytest.raises(SystemExit):
        run_job(site.database, site.files, export_id)
    row = row_of(site, export_id)
    assert (row.state, row.message) == ("failed", "the export was stopped; start it again")
    assert not list(site.files.root.glob("*export*"))


def test_only_a_queued_export_is_started(site: Site) -> None:
    site.submit_all()
    export_id = request(site)
    run_job(site.database, site.files, export_id)
    with pytest.raises(ExportError, match=rf"export {export_id} is done; only a queued export"):
        run_job(site.database, site.files, export_id)
    with pytest.raises(ExportError, match="export 99 does not exist"):
        run_job(site.database, site.files, 99)


@pytest.mark.slow
def test_a_job_runs_as_a_process_of_its_own(site: Site) -> None:
    site.submit_all()
    export_id = request(site)
    environment = {**os.environ, "SNAP6D_STATE_DIR": str(site.folder)}

    def run(argument: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "app.export", argument]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)

    assert run(str(export_id)).returncode == 0
    assert row_of(site, export_id).state == "done"
    again = run(str(export_id))
    assert again.returncode == 1
    assert again.stderr.strip() == f"export {export_id} is done; only a queued export can be started"
