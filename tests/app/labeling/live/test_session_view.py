"""The view of a session, as a page has it, follows the session, and its gizmo is followed."""

import numpy as np

from app.storage.roles import Actor
from registration_core.geometry import pose
from tests.app.labeling.viser_client import ViserClient
from tests.app.small_dataset import TOOL, true_pose
from tests.app.waiting import wait_until


def test_the_view_shows_the_ghost_of_what_is_live_until_it_is_taken(services, live_session):
    near = pose.perturbed(true_pose(TOOL), 0.012, np.radians(10), np.random.default_rng(3))
    with ViserClient(services.live_sessions.view_socket(live_session)) as client:
        live_session.session.set_pose(near, Actor.HUMAN)
        live_session.session.set_live(True, Actor.HUMAN)
        live = wait_until(lambda: live_session.session.snapshot().live, "a live result")
        centre = pose.apply(live.T_world_object, live_session.model.centre)
        client.wait_for(
            "SetPositionMessage",
            lambda m: m["name"] == "/ghost" and np.allclose(m["position"], centre, atol=1e-5),
        )
        live_session.session.accept(Actor.HUMAN)
        client.wait_for("SetSceneNodeVisibilityMessage", lambda m: m["name"] == "/ghost" and not m["visible"])


def test_the_view_follows_the_session_and_the_session_the_view(services, live_session):
    T_object_gizmo = pose.from_rotation_translation(np.eye(3), live_session.model.centre)

    def arrived_at(T_world_object):
        expected = (T_world_object @ T_object_gizmo)[:3, 3]
        return lambda m: m["name"] == "/object" and np.allclose(m["position"], expected, atol=1e-5)

    with ViserClient(services.live_sessions.view_socket(live_session)) as client:
        live_session.session.set_pose(true_pose(TOOL), Actor.SCRIPT)
        client.wait_for("SetPositionMessage", arrived_at(true_pose(TOOL)))
        dragged = true_pose(TOOL) @ T_object_gizmo @ pose.exp([0, 0, 0, 0, 0, 0.4])
        client.drag([dragged])

        def drags():
            return [
                event for event in services.log.events(live_session.registration.id) if event.kind == "drag"
            ]

        (event,) = wait_until(drags, "the drag")
        assert (event.actor, event.dof) == ("human", ["rz"])
        assert np.allclose(event.T_after, dragged @ pose.inverse(T_object_gizmo), atol=1e-9)
        other_frame = max(live_session.frames)
        count = len([m for m in client.messages if m["type"] == "PointCloudMessage"])
        live_session.session.show_frame(other_frame, Actor.HUMAN)
        expected = services.data.cloud(live_session.frames[other_frame]).points
        client.wait_for(
            "PointCloudMessage", lambda m: np.array_equal(m["props"]["points"], expected.reshape(-1))
        )
        assert count <= 1
        live_session.session.submit(Actor.HUMAN)
        client.wait_for("SceneNodeUpdateMessage", lambda m: "disable_axes" in m["updates"])
