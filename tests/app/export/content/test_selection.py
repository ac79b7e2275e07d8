"""Which images and which of several poses go into an export."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from app.export.bop.dataset_info import dataset_info
from app.export.content.selection import ExportError, Selection, select_dataset
from app.storage.clock import Clock
from app.storage.event_log import EventLog, NewEvent
from app.storage.roles import Actor
from app.storage.tables import Registration, Scene
from registration_core.geometry import pose
from tests.app.export.site import BLOCK, POSED, START, TOOL, UNPOSED, Site, true_pose


def selected(site: Site) -> Selection:
    with site.database.read() as session:
        return select_dataset(session, site.dataset_id)


def test_a_dataset_without_a_submission_is_refused(site: Site) -> None:
    with pytest.raises(ExportError, match=r"'Two boxes / v1' has no submitted registration; submit at least"):
        selected(site)


def test_a_dataset_that_is_not_there_is_refused(site: Site) -> None:
    with site.database.read() as session, pytest.raises(ExportError, match="dataset 99 does not exist"):
        select_dataset(session, 99)


def test_only_scenes_with_a_submission_are_exported_with_all_their_images(site: Site) -> None:
    site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL))
    selection = selected(site)
    (scene,) = selection.scenes
    assert [image.image_id for image in scene.images] == [0, 5, 6, 7, 8]
    assert selection.images_left_out == 2
    assert selection.instances_open == 1
    assert len(selection.annotations) == 1


def test_images_imported_as_worlds_of_their_own_meet_in_their_scene(site: Site) -> None:
    site.submit_all()
    selection = selected(site)
    assert [scene.folder for scene in selection.scenes] == ["test/000001", "test/000002"]
    unposed = selection.scenes[1]
    assert [(image.image_id, image.posed) for image in unposed.images] == [(0, False), (4, False)]
    for image in unposed.images:
        tool = image.annotations[0]
        np.testing.assert_array_equal(tool.T_world_object, true_pose(UNPOSED[image.image_id], TOOL))
    assert selection.images_left_out == selection.instances_open == 0


def test_what_was_skipped_is_left_out_and_counted_by_its_reason(site: Site) -> None:
    site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL))
    for task, user in ((POSED, BLOCK), 1), ((POSED, TOOL), 2):  # somebody else did submit the tool
        with site.database.write() as session:
            row = Registration(
                task_id=site.tasks[task], user_id=user, state="skipped", skip_reason="no depth"
            )
            session.add(row)
    selection = selected(site)
    assert selection.instances_skipped == (("no depth", 1),)
    assert selection.instances_open == 1
    assert len(selection.annotations) == 1
    assert "skipped by those who looked for them: 1 as 'no depth'." in dataset_info(selection)


def test_annotations_are_in_the_order_of_objects(site: Site) -> None:
    site.submit(site.tasks[POSED, BLOCK], true_pose(POSED, BLOCK))
    site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL))
    image = selected(site).scenes[0].images[0]
    assert [found.obj_id for found in image.annotations] == [TOOL, BLOCK]


def test_of_several_submissions_the_newest_is_kept(site: Site) -> None:
    task = site.tasks[POSED, TOOL]
    newer = true_pose(POSED, TOOL) @ pose.exp([0.001, 0, 0, 0, 0, 0])
    site.submit(task, newer, user=1, minutes=2.0)
    site.submit(task, true_pose(POSED, TOOL), user=0, minutes=1.0)
    (annotation,) = selected(site).annotations
    np.testing.assert_array_equal(annotation.T_world_object, newer)
    assert annotation.candidates == 2


@pytest.mark.parametrize("step", [timedelta(hours=1), timedelta(days=365)])
@pytest.mark.parametrize("direction", [-1, 1])
def test_the_newest_is_kept_also_where_the_clock_was_put(site: Site, step: timedelta, direction: int) -> None:
    class PutClock(Clock):
        def utc(self) -> datetime:
            return START + next(steps)

    steps = iter([timedelta(), direction * step])
    task, newer = site.tasks[POSED, TOOL], true_pose(POSED, TOOL) @ pose.exp([0.001, 0, 0, 0, 0, 0])
    log = EventLog(site.database, PutClock())
    for user, T in ((1, true_pose(POSED, TOOL)), (0, newer)):
        with site.database.write() as session:
            row = Registration(task_id=task, user_id=site.users[user])
            session.add(row)
        log.append(row.id, row.user_id, NewEvent("submit", Actor.HUMAN, T_after=T.tolist()))
    (annotation,) = selected(site).annotations
    np.testing.assert_array_equal(annotation.T_world_object, newer)


def test_tasks_of_several_conditions_for_one_thing_give_one_annotation_the_accurate_one(site: Site) -> None:
    quick = site.add_task(POSED, TOOL, mode="quick")
    site.submit(quick, np.eye(4), minutes=9.0)
    site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL), minutes=1.0)
    (annotation,) = selected(site).annotations
    np.testing.assert_array_equal(annotation.T_world_object, true_pose(POSED, TOOL))
    assert annotation.candidates == 2


def test_instances_of_one_object_stay_apart(site: Site) -> None:
    second = site.add_task(POSED, TOOL, instance=1)
    moved = true_pose(POSED, TOOL) @ pose.exp([0.0, 0.0, 0.2, 0, 0, 0])
    site.submit(second, moved)
    site.submit(site.tasks[POSED, TOOL], true_pose(POSED, TOOL))
    image = selected(site).scenes[0].images[0]
    assert [(found.obj_id, found.instance) for found in image.annotations] == [(TOOL, 0), (TOOL, 1)]
    assert [found.name.rsplit(" ", 1)[1] for found in image.annotations] == ["#1", "#2"]


def test_an_image_id_that_two_worlds_share_is_refused(site: Site) -> None:
    site.submit_all()
    with site.database.write() as session:
        session.query(Scene).filter(Scene.bop_scene_id == 2).update({"bop_scene_id": 1})
    with pytest.raises(ExportError, match=r"test/000001 has image 0 twice"):
        selected(site)
