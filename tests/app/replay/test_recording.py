"""What a log made by hand shows at any time."""

import numpy as np
import pytest

from app.replay.recording import Recording
from tests.app.analysis.hand_made import START, Entry, at, drag, moved, view

SNAPPED = {"actor": "machine", "detail": {"confidence": 0.8}}


def recording(*events: Entry) -> Recording:
    return Recording(START.tolist(), 7, [Entry(0.0, "opened"), *events])


def confidences_of_ghosts(played: Recording, *times: float) -> list[float | None]:
    ghosts = [played.at(seconds).ghost for seconds in times]
    return [None if ghost is None else ghost.confidence for ghost in ghosts]


def test_the_frame_and_whose_the_pose_is():
    played = recording(
        Entry(1.0, "frame", detail={"frame_id": 9}),
        moved(2.0, "snap_applied", at(0.1), **SNAPPED),
        drag(5.0, 1.0, at(0.1), at(0.2)),
        moved(6.0, "undo", at(0.1), detail={"confidence": 0.8}),
        moved(7.0, "submit", at(0.1)),
    )
    assert [played.at(t).frame_id for t in (0.0, 0.9, 1.0, 7.0)] == [7, 7, 9, 9]
    assert [played.at(t).confidence for t in (1.9, 2.0, 3.9, 4.5, 6.0, 7.0)] == [
        None,
        0.8,
        0.8,
        None,
        0.8,
        0.8,
    ]
    assert np.allclose(played.at(4.5).T_world_object, at(0.15), atol=1e-6)


def test_an_offer_stands_until_the_drag_is_over():
    played = recording(moved(3.0, "snap_offered", at(0.5), **SNAPPED), drag(5.0, 3.0, START, at(0.1)))
    assert confidences_of_ghosts(played, 2.9, 3.0, 4.9, 5.0) == [None, 0.8, 0.8, None]
    ghost = played.at(4.0).ghost
    assert ghost is not None and ghost.on_offer and np.allclose(ghost.T_world_object, at(0.5))


@pytest.mark.parametrize("kind", ["dismiss", "snap_requested", "submit"])
def test_an_offer_ends_unmoved(kind):
    played = recording(moved(3.0, "snap_offered", at(0.5), **SNAPPED), Entry(5.0, kind))
    assert confidences_of_ghosts(played, 4.9, 5.0) == [0.8, None]


def test_an_estimate_that_was_applied_stands_until_the_object_leaves_it():
    applied = moved(2.0, "snap_applied", at(0.1), **SNAPPED)
    played = recording(applied, Entry(3.0, "snap_requested"), drag(5.0, 1.0, at(0.1), at(0.2)))
    assert confidences_of_ghosts(played, 3.9, 4.0) == [0.8, None]
    assert confidences_of_ghosts(recording(applied, moved(3.0, "undo", START)), 2.9, 3.0) == [0.8, None]


def test_an_offer_outlives_undo():
    offered = moved(2.0, "snap_offered", at(0.1), **SNAPPED)
    played = recording(moved(1.0, "set_pose", at(0.3)), offered, moved(3.0, "undo", START))
    assert confidences_of_ghosts(played, 3.5) == [0.8]


def test_the_camera_stands_moves_and_stands_again():
    played = recording(view(1.0, 0.5, x=0.0), view(4.0, 1.0, x=1.0))
    places = []
    for seconds in (0.0, 1.0, 3.0, 3.5, 4.0, 9.0):
        viewpoint = played.at(seconds).viewpoint
        assert viewpoint is not None
        assert np.allclose(viewpoint.target, viewpoint.position - [0, 0, 1])
        places.append(viewpoint.position[0])
    assert places == pytest.approx([0, 0, 0, 0.5, 1, 1])


def test_a_log_without_a_camera_has_no_view():
    assert recording().at(0.0).viewpoint is None


def test_a_candidate_that_was_taken_is_played_back_as_the_machines():
    taken = moved(2.0, "set_pose", at(0.1), detail={"technique": "proposal"})
    played = recording(taken, drag(5.0, 1.0, at(0.1), at(0.2)), moved(6.0, "undo", at(0.1)))
    assert [played.at(t).posed_by for t in (1.9, 2.0, 3.9, 4.5, 6.0)] == [
        "start",
        "machine",
        "machine",
        "human",
        "machine",
    ]
