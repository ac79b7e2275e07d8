"""What is done of a scene beside the thing that is worked on: told, shown, and known to snaps."""

from functools import partial

import numpy as np

from app.access.auth import Identity
from app.datasets.scene_data import camera_of
from app.labeling.live.live_session import LiveSession
from app.services import Services
from app.storage.roles import Actor, Role
from app.storage.tables import Task
from registration_core import SnapConfig, explained_pixels, propose
from registration_core.geometry import pose
from tests.app.labeling.live_sessions import sign_up, wait_for_snap
from tests.app.labeling.viser_client import Message, ViserClient
from tests.app.small_dataset import BLOCK, TOOL, true_pose
from tests.app.waiting import wait_until


def submitted(services: Services, task_id: int, user: Identity, T_world_object: np.ndarray) -> LiveSession:
    other = services.live_sessions.start(task_id, user)
    other.session.set_pose(T_world_object, Actor.HUMAN)
    other.session.submit(Actor.HUMAN)
    return other


def states(live_session: LiveSession) -> list[tuple[str, str, bool]]:
    return [(thing.name, thing.state, thing.known is not None) for thing in live_session.neighbours.things]


def test_things_are_those_of_the_scene_and_follow_what_happens(services, live_session, ann):
    assert states(live_session) == [("angle tool", "open", False), ("block", "open", False)]
    assert [thing.is_current for thing in live_session.neighbours.things] == [True, False]
    block = submitted(services, 2, ann, true_pose(BLOCK))
    assert states(live_session)[1] == ("block", "submitted", True)
    (known,) = live_session.neighbours.known
    assert known.registration_id == block.registration.id
    assert np.array_equal(known.T_world_object, true_pose(BLOCK))
    block.session.reopen(Actor.HUMAN)
    assert states(live_session)[1] == ("block", "open", False) and live_session.neighbours.known == ()
    block.session.skip(Actor.HUMAN, "no depth")
    assert states(live_session)[1] == ("block", "skipped", False)
    assert live_session.neighbours.things[1].skip_reason == "no depth"
    assert live_session.neighbours.known == ()


def test_other_worlds_are_not_known(services, live_session, ann):
    submitted(services, 4, ann, true_pose(BLOCK, posed=False))
    assert live_session.neighbours.known == ()


def test_mine_goes_before_the_newest_of_others(services, live_session, ann):
    bob, cid = sign_up(services, "bob"), sign_up(services, "cid")
    theirs = [submitted(services, 2, user, true_pose(BLOCK)) for user in (bob, cid)]
    assert live_session.neighbours.known[0].registration_id == theirs[1].registration.id
    mine = submitted(services, 2, ann, true_pose(BLOCK))
    theirs[0].session.reopen(Actor.HUMAN)
    theirs[0].session.submit(Actor.HUMAN)
    assert live_session.neighbours.known[0].registration_id == mine.registration.id


def test_own_thing_of_another_operator_or_condition_is_no_neighbour(services, live_session, ann):
    with services.database.write() as session:
        first = session.get_one(Task, 1)
        columns = ("scene_id", "object_id", "instance", "mode", "frame_id", "T_world_object_start")
        values = {name: getattr(first, name) for name in columns}
        by_hand = Task(**values, condition="manual")
        twin = Task(**(values | {"instance": 1}), condition="snap")
        session.add_all([by_hand, twin])
    submitted(services, 1, sign_up(services, "bob"), true_pose(TOOL))
    submitted(services, by_hand.id, ann, true_pose(TOOL))
    assert live_session.neighbours.known == ()
    assert [name for name, _, _ in states(live_session)] == ["angle tool #1", "block", "angle tool #2"]


def test_a_snap_says_what_it_knew_and_passes_it_by(services, live_session, ann):
    start = true_pose(BLOCK) @ pose.exp([0.005, 0.0, 0.0, 0.0, 0.0, 0.1])
    block = services.live_sessions.start(2, ann)
    twin = submitted(services, 1, sign_up(services, "bob", Role.OPERATOR), true_pose(TOOL))
    block.session.set_pose(start, Actor.HUMAN)
    block.session.snap(Actor.HUMAN, seed=3)
    assert wait_for_snap(block) == "done"
    events = services.log.events(block.registration.id)
    (requested,) = [event for event in events if event.kind == "snap_requested"]
    estimate = services.log.estimate(requested.snap_id)
    expected = [
        {
            "registration_id": twin.registration.id,
            "object_id": twin.registration.task.object_id,
            "T_world_object": true_pose(TOOL).tolist(),
        }
    ]
    assert requested.detail["known_objects"] == estimate.known_objects == expected
    assert np.allclose(estimate.T_world_object, true_pose(BLOCK), atol=0.05)


def test_a_search_passes_by_what_is_known(services, live_session, ann):
    block = submitted(services, 2, ann, true_pose(BLOCK))
    live_session.session.search(Actor.HUMAN, seed=5)
    wait_until(lambda: not live_session.session.snapshot().search.is_live, "the search to end")
    requested, done = services.log.events(live_session.registration.id)[-2:]
    assert requested.detail["known_objects"][0]["registration_id"] == block.registration.id
    frame = live_session.frames[requested.detail["frame_id"]]
    depth, camera = services.data.depth(frame), camera_of(frame)
    T_camera_block = pose.inverse(np.array(frame.T_world_camera)) @ true_pose(BLOCK)
    explained = explained_pixels(depth, camera, [(block.model, T_camera_block)])
    assert explained.any()
    rest = np.where(explained, 0.0, depth)
    here = propose(live_session.model, rest, camera, None, SnapConfig(), np.random.default_rng(5))
    assert [one["weight"] for one in done.detail["candidates"]] == [one.weight for one in here]


def test_the_view_shows_what_is_done_in_its_colour_until_it_is_hidden(services, live_session, ann):
    with ViserClient(services.live_sessions.view_socket(live_session)) as client:
        client.node("TransformControlsMessage", "/object")
        block = submitted(services, 2, ann, true_pose(BLOCK))
        mesh = client.node("MeshMessage", "/neighbours/2")
        assert (
            "#{:02x}{:02x}{:02x}".format(*mesh["props"]["color"]) == live_session.neighbours.things[1].color
        )
        label = client.node("LabelMessage", "/neighbour-names/2")
        assert label["props"]["text"] == "block"
        for hide in (lambda: live_session.neighbours.show(False), lambda: block.session.reopen(Actor.HUMAN)):
            hide()
            client.wait_for("RemoveSceneNodeMessage", lambda m: m["name"] == "/neighbours/2")
            live_session.neighbours.show(True)


def locks_the_object(locked: bool, message: Message) -> bool:
    return message["name"] == "/object" and message["updates"].get("disable_axes") is locked


def test_an_object_that_was_reopened_gets_its_handles_back(services, live_session):
    with ViserClient(services.live_sessions.view_socket(live_session)) as client:
        client.node("TransformControlsMessage", "/object")
        for act, locked in ((live_session.session.submit, True), (live_session.session.reopen, False)):
            act(Actor.HUMAN)
            client.wait_for("SceneNodeUpdateMessage", partial(locks_the_object, locked))


def test_who_cannot_be_told_does_not_take_back_what_happened(services, live_session, ann, monkeypatch):
    def broken() -> tuple[()]:
        raise OSError("no such mesh")

    monkeypatch.setattr(live_session.neighbours, "_read", broken)
    block = submitted(services, 2, ann, true_pose(BLOCK))
    assert block.session.snapshot().state == "submitted"
    assert block.neighbours.things[1].state == "submitted"
