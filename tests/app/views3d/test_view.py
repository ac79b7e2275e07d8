"""The view over the wire: what a page receives, and what the operator's drags become."""

import io
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import pytest
import trimesh
import viser
from scipy.spatial.transform import Rotation

from app.datasets.outline_mesh import MOST_FACES, drawable
from app.datasets.textured_mesh import textured_mesh
from app.labeling.layers import Layers
from app.labeling.moves.camera_watch import CameraWatch
from app.views3d.cloud_view import COARSE_POINTS, NEAR
from app.views3d.view import DragHandlers, FirstView, SceneView
from registration_core import ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.mesh_file import plain_ply
from tests.app.export.site import NEAR_VIEW, TOOL, mesh_of, model_of
from tests.app.labeling.viser_client import CAMERA, Message, ViserClient
from tests.app.waiting import wait_until

T_WORLD_OBJECT = pose.exp([0.1, -0.2, 0.3, 0.2, 0.4, -0.3])
FIRST_VIEW = FirstView(T_world_camera=NEAR_VIEW, field_of_view=0.8, distance=0.5)
COLORS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255]], dtype=np.uint8)
POINTS = np.array([[0.1, 0.2, 0.3], [1.00001, 2.0, 3.0], [-1.0, -2.0, -3.0]], dtype=np.float32)


@dataclass
class Hand:
    """What the view told of the operator's hand, in order."""

    calls: list[str] = field(default_factory=list)
    poses: list[np.ndarray] = field(default_factory=list)
    broken: bool = False
    lost: bool = False
    """Whether the last drag ended with its connection."""

    def start(self) -> None:
        self.calls.append("start")

    def move(self, T_world_object: np.ndarray) -> None:
        self.calls.append("move")
        self.poses.append(T_world_object)

    def end(self, broken: bool) -> None:
        self.calls.append("end")
        self.lost = broken
        if self.broken:
            raise OSError("no space left")

    def wait_for_ends(self, count: int) -> None:
        wait_until(lambda: self.calls.count("end") >= count, f"{count} drags to end")


@pytest.fixture
def hand() -> Hand:
    return Hand()


@pytest.fixture
def model() -> ObjectModel:
    model = model_of(mesh_of(TOOL))
    assert np.linalg.norm(model.centre) > 0.01  # so that the gizmo stands off the object's origin
    return model


@pytest.fixture
def view(hand: Hand, model: ObjectModel) -> Iterator[SceneView]:
    opened = SceneView(
        model, T_WORLD_OBJECT, FIRST_VIEW, DragHandlers(hand.start, hand.move, hand.end), drawable
    )
    yield opened
    opened.close()


def rotation_of(wxyz) -> np.ndarray:
    return Rotation.from_quat(wxyz, scalar_first=True).as_matrix()


def connect(view: SceneView) -> ViserClient:
    return ViserClient(view.socket_path)


def gizmo_at(T_world_object: np.ndarray, model: ObjectModel) -> np.ndarray:
    return T_world_object @ pose.from_rotation_translation(np.eye(3), model.centre)


def test_the_mesh_stands_at_the_gizmo(view, model):
    with connect(view) as client:
        gizmo = client.node("TransformControlsMessage", "/object")
        assert gizmo["props"]["scale"] == pytest.approx(0.75 * model.diameter)
        assert gizmo["props"]["depth_test"] is False
        mesh = client.node("MeshMessage", "/object/mesh")["props"]
        vertices = mesh["vertices"].reshape(-1, 3)
        assert vertices == pytest.approx((model.vertices - model.centre).astype(np.float32))
        assert mesh["faces"].reshape(-1, 3).tolist() == model.faces.tolist()
        assert 0 < mesh["opacity"] < 1
        position = client.wait_for("SetPositionMessage", lambda m: m["name"] == "/object")["position"]
        assert position == pytest.approx(pose.apply(T_WORLD_OBJECT, model.centre), abs=1e-6)


def test_a_dense_mesh_is_drawn_in_few_faces_where_it_is(hand):
    ring = trimesh.creation.torus(0.08, 0.03, major_sections=400, minor_sections=160)
    dense = ObjectModel(np.asarray(ring.vertices) + 0.1, np.asarray(ring.faces, np.int32))
    handlers = DragHandlers(hand.start, hand.move, hand.end)
    view = SceneView(dense, T_WORLD_OBJECT, FIRST_VIEW, handlers, drawable)
    with closing(view), connect(view) as client:
        mesh = client.node("MeshMessage", "/object/mesh")["props"]
        assert len(mesh["faces"]) // 3 <= MOST_FACES < len(dense.faces)
        vertices = mesh["vertices"].reshape(-1, 3)
        for bound in (np.min, np.max):
            expected = bound(dense.vertices, axis=0) - dense.centre
            assert bound(vertices, axis=0) == pytest.approx(expected, abs=dense.diameter / 100)


def test_the_cloud_arrives_in_full_precision_and_is_replaced(view):
    view.show_cloud(POINTS, COLORS, point_size=0.002)
    with connect(view) as client:
        cloud = client.node("PointCloudMessage", "/cloud")["props"]
        assert cloud["points"].dtype == np.float32
        assert np.array_equal(cloud["points"].reshape(-1, 3), POINTS)
        assert np.array_equal(cloud["colors"].reshape(-1, 3), COLORS)
        assert cloud["point_size"] == pytest.approx(0.002)
        view.show_cloud(POINTS[:1], COLORS[:1], point_size=0.001)
        client.wait_for("PointCloudMessage", lambda m: m["props"]["points"].size == 3)


def hides(name: str, message: Message) -> bool:
    return message["name"] == name and not message["visible"]


def test_cloud_and_mesh_are_put_away_and_the_gizmo_stays(view):
    view.show_cloud(POINTS, COLORS, point_size=0.002)
    with connect(view) as client:
        view.show_layers(Layers(cloud=False, mesh=False))
        for name in ("/cloud", "/object/mesh"):
            client.wait_for("SetSceneNodeVisibilityMessage", partial(hides, name))
        view.show_cloud(POINTS[:1], COLORS[:1], point_size=0.001)  # of another frame
        client.wait_for("PointCloudMessage", lambda m: m["props"]["points"].size == 3)
    with connect(view) as again:
        again.wait_for("SetSceneNodeVisibilityMessage", lambda m: m["name"] == "/cloud" and not m["visible"])
        again.node("TransformControlsMessage", "/object")


def test_an_object_in_its_own_colours_is_where_its_mesh_is(hand, model):
    painted = mesh_of(TOOL)
    painted.visual.vertex_colors = [255, 0, 0, 255]
    textured = textured_mesh(plain_ply(painted), "ply", None, model)
    assert textured is not None
    handlers = DragHandlers(hand.start, hand.move, hand.end)
    view = SceneView(model, T_WORLD_OBJECT, FIRST_VIEW, handlers, drawable, textured)
    with closing(view), connect(view) as client:
        received = client.node("GlbMessage", "/object/textured")["props"]["glb_data"]
        scene = trimesh.load_scene(io.BytesIO(received), file_type="glb")
        assert scene.bounds == pytest.approx(textured.bounds - model.centre, abs=1e-6)
        (mesh,) = scene.geometry.values()
        assert np.unique(mesh.visual.vertex_attributes["color"], axis=0).tolist() == [[255, 0, 0, 255]]
        visibility(client, "/object/mesh", False)

        view.move_object(T_WORLD_OBJECT, "world")
        turned = T_WORLD_OBJECT[:3, :3]
        client.wait_for(
            "SetOrientationMessage",
            lambda m: m["name"] == "/object/textured" and np.allclose(rotation_of(m["wxyz"]), turned),
        )
        for layers, is_textured in (
            (Layers(texture=False), False),
            (Layers(), True),
            (Layers(agreement=True), False),
        ):
            client.messages.clear()
            view.show_layers(layers)
            visibility(client, "/object/textured", is_textured)
            visibility(client, "/object/mesh", not is_textured)
        view.show_layers(Layers())
        client.messages.clear()
        view.show_layers(Layers(mesh=False))
        visibility(client, "/object/textured", False)


def visibility(client: ViserClient, name: str, visible: bool) -> None:
    """Return when the client was told whether a node is to be seen."""
    client.wait_for("SetSceneNodeVisibilityMessage", lambda m: m["name"] == name and m["visible"] is visible)


def test_a_coarse_cloud_has_few_points_that_cover_as_much(view):
    far_off = 5.0 + np.random.default_rng(0).uniform(size=(4 * COARSE_POINTS, 3))
    points = far_off.astype(np.float32)
    colors = np.zeros(points.shape, dtype=np.uint8)
    with connect(view) as client:
        view.show_layers(Layers(fine=False))
        view.show_cloud(points, colors, point_size=0.002)
        coarse = client.node("PointCloudMessage", "/cloud")["props"]
        shown = coarse["points"].reshape(-1, 3)
        assert coarse["point_size"] == pytest.approx(0.004)
        assert len(np.unique(shown, axis=0)) == COARSE_POINTS
        assert np.isin(shown[:, 0], points[:, 0]).all()
        assert shown.mean(axis=0) == pytest.approx([5.5, 5.5, 5.5], abs=0.02)
        view.show_layers(Layers())
        client.wait_for("PointCloudMessage", lambda m: m["props"]["points"].size == points.size)


def test_a_coarse_cloud_is_finer_near_the_object_wherever_that_goes(view, model):
    centre = pose.apply(T_WORLD_OBJECT, model.centre)
    reach = NEAR * model.diameter
    spread = np.random.default_rng(0).uniform(-4, 4, size=(20 * COARSE_POINTS, 3))
    points = (centre + model.diameter * spread).astype(np.float32)
    view.show_layers(Layers(fine=False))
    view.show_cloud(points, np.zeros(points.shape, dtype=np.uint8), point_size=0.002)
    with connect(view) as client:
        far, near = (client.node("PointCloudMessage", name)["props"] for name in ("/cloud", "/cloud-near"))
        places = near["points"].reshape(-1, 3)
        assert np.linalg.norm(places - centre, axis=1).max() < reach
        assert np.linalg.norm(far["points"].reshape(-1, 3) - centre, axis=1).min() >= reach - 1e-4
        assert len(places) + far["points"].size // 3 == COARSE_POINTS
        assert near["point_size"] == pytest.approx(0.002) and far["point_size"] > 3 * 0.002

        moved = pose.from_rotation_translation(np.eye(3), [2 * model.diameter, 0.0, 0.0]) @ T_WORLD_OBJECT
        view.move_object(moved)
        there = pose.apply(moved, model.centre)
        client.wait_for(
            "PointCloudMessage",
            lambda m: (
                m["name"] == "/cloud-near"
                and np.linalg.norm(m["props"]["points"].reshape(-1, 3) - there, axis=1).max() < reach
            ),
        )
        view.show_layers(Layers())
        client.wait_for("RemoveSceneNodeMessage", lambda m: m["name"] == "/cloud-near")


def test_points_on_the_object_hang_on_its_mesh_and_are_replaced(view, model):
    with connect(view) as client:
        on_object = model.vertices[:3]
        view.show_on_object(on_object, COLORS)
        cloud = client.node("PointCloudMessage", "/object/mesh/surface")["props"]
        expected = 1.03 * (on_object - model.centre)
        assert cloud["points"].reshape(-1, 3) == pytest.approx(expected, abs=2e-4)
        view.show_on_object(on_object[:1], COLORS[:1])
        client.wait_for("SceneNodeUpdateMessage", lambda m: m["updates"].get("points", POINTS).size == 3)


def visible(client: ViserClient, shown: bool) -> None:
    client.wait_for(
        "SetSceneNodeVisibilityMessage", lambda m: m["name"] == "/ghost" and m["visible"] is shown
    )


def puts_the_ghost(at: np.ndarray, message: Message) -> bool:
    return message["name"] == "/ghost" and np.allclose(message["position"], at, atol=1e-6)


def test_a_ghost_comes_moves_and_goes(view, model):
    with connect(view) as client:
        view.show_ghost(None)
        for T in (T_WORLD_OBJECT, T_WORLD_OBJECT @ pose.exp([0.05, 0, 0, 0, 0, 0.3])):
            view.show_ghost(T)
            centre = pose.apply(T, model.centre)
            client.wait_for("SetPositionMessage", partial(puts_the_ghost, centre))
        ghost = client.node("MeshMessage", "/ghost")["props"]
        mesh = client.node("MeshMessage", "/object/mesh")["props"]
        assert ghost["color"] != mesh["color"] and 0 < ghost["opacity"] < 1
        assert ghost["vertices"] == pytest.approx(1.03 * mesh["vertices"], rel=1e-5)
        view.show_ghost(None)
        visible(client, False)
    with connect(view) as again:
        visible(again, False)


def test_a_reloaded_page_sees_where_the_object_is_now(view, model):
    moved = T_WORLD_OBJECT @ pose.exp([0.05, 0, 0, 0, 0, 0.3])
    view.move_object(moved)
    for _ in range(2):
        with connect(view) as client:
            place = client.wait_for("SetPositionMessage", lambda m: m["name"] == "/object")
            assert place["position"] == pytest.approx(pose.apply(moved, model.centre), abs=1e-6)


def test_the_first_view_is_the_sensors_from_a_little_further_back(view):
    with connect(view) as client:
        look_at = np.array(client.wait_for("SetCameraLookAtMessage")["look_at"])
        position = np.array(client.wait_for("SetCameraPositionMessage")["position"])
    seen = pose.apply(NEAR_VIEW, [0.0, 0.0, 0.5])
    assert look_at == pytest.approx(seen, abs=1e-6)
    direction = (look_at - position) / np.linalg.norm(look_at - position)
    assert direction == pytest.approx(NEAR_VIEW[:3, 2], abs=1e-6)
    assert 0.5 < np.linalg.norm(look_at - position) < 0.7


def test_a_drag_over_the_wire_tells_start_moves_and_end_in_order(view, hand, model):
    way = [T_WORLD_OBJECT @ pose.exp([0.01 * i, 0, 0, 0, 0, 0.1 * i]) for i in range(1, 6)]
    with connect(view) as client:
        client.drag(gizmo_at(T, model) for T in way)
        hand.wait_for_ends(1)
    assert hand.calls == ["start"] + ["move"] * 6 + ["end"]
    for told, T in zip(hand.poses, [*way, way[-1]], strict=True):
        assert told == pytest.approx(T, abs=1e-9)


def test_a_gizmo_in_the_worlds_axes_carries_the_turned_mesh(view, hand, model):
    """It stands upright at first, turns with the hand, and is set upright again while the mesh stays."""
    centre = pose.apply(T_WORLD_OBJECT, model.centre)
    turn = pose.exp([0.02, 0, 0, 0, 0, 0.4])
    with connect(view) as client:
        view.move_object(T_WORLD_OBJECT, "world")
        upright = client.wait_for(
            "SetOrientationMessage", lambda m: m["name"] == "/object" and m["wxyz"][0] == 1
        )
        mesh = client.wait_for(
            "SetOrientationMessage", lambda m: m["name"] == "/object/mesh" and m["wxyz"][0] < 1
        )
        assert upright["wxyz"] == pytest.approx((1, 0, 0, 0))
        assert rotation_of(mesh["wxyz"]) == pytest.approx(T_WORLD_OBJECT[:3, :3])
        client.drag([pose.from_rotation_translation(np.eye(3), centre) @ turn])
        hand.wait_for_ends(1)
        moved = hand.poses[-1]
        assert moved[:3, :3] == pytest.approx(turn[:3, :3] @ T_WORLD_OBJECT[:3, :3])
        assert pose.apply(moved, model.centre) == pytest.approx(np.add(centre, [0.02, 0, 0]))
        seen = len(client.messages)
        view.move_object(moved, "world")
        client.wait_for(
            "SetOrientationMessage",
            lambda m: m["name"] == "/object/mesh" and np.allclose(rotation_of(m["wxyz"]), moved[:3, :3]),
        )
        assert any(
            m["type"] == "SetOrientationMessage" and m["name"] == "/object" for m in client.messages[seen:]
        )


def test_what_the_page_looks_from_is_known_and_can_be_changed(view):
    before = view.viewpoint
    assert before is None
    with connect(view) as client:
        wait_until(lambda: view.viewpoint is not None, "the page to be known")
        there = view.viewpoint
        assert there.position == pytest.approx([1, 1, 1])
        assert there.distance == pytest.approx(np.sqrt(3))
        assert there.aspect == pytest.approx(800 / 600)
        view.look(replace(there, T_world_camera=NEAR_VIEW, distance=0.4, up=-NEAR_VIEW[:3, 1]))
        position = client.wait_for("SetCameraPositionMessage", lambda m: not m["initial"])["position"]
        assert position == pytest.approx(NEAR_VIEW[:3, 3])
        wait_until(lambda: np.allclose(view.viewpoint.T_world_camera, NEAR_VIEW), "the camera's new place")


def test_many_quick_drags_stay_apart(view, hand, model):
    with connect(view) as client:
        for i in range(20):
            client.drag([gizmo_at(T_WORLD_OBJECT @ pose.exp([0.001 * i, 0, 0, 0, 0, 0]), model)])
        hand.wait_for_ends(20)
    assert hand.calls == ["start", "move", "move", "end"] * 20
    assert not hand.lost


def test_a_connection_lost_in_mid_drag_ends_the_drag(view, hand, model):
    with connect(view) as client:
        client.take()
        client.move(gizmo_at(T_WORLD_OBJECT, model))
        wait_until(lambda: "move" in hand.calls, "the drag to begin")
    hand.wait_for_ends(1)
    assert hand.lost


def test_a_drag_that_cannot_be_saved_does_not_break_the_view(view, hand, model):
    hand.broken = True
    with connect(view) as client:
        for _ in range(2):
            client.drag([gizmo_at(T_WORLD_OBJECT, model)])
        hand.wait_for_ends(2)


def updates_the_object(what: str, message: Message) -> bool:
    return message["name"] == "/object" and what in message["updates"]


def test_a_locked_object_has_no_handles_left(view):
    with connect(view) as client:
        client.node("TransformControlsMessage", "/object")
        view.lock_object(True)
        for name in ("disable_axes", "disable_sliders", "disable_rotations"):
            update = client.wait_for("SceneNodeUpdateMessage", partial(updates_the_object, name))
            assert update["updates"][name] is True


def test_a_request_for_a_public_tunnel_is_refused(view, hand, model, monkeypatch):
    asked: list[viser.ViserServer] = []
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda server: asked.append(server))  # noqa: PLW0108 - a function binds
    with connect(view) as client:
        client.send("ShareUrlRequest")
        client.send("ShareUrlDisconnect")
        client.drag([gizmo_at(T_WORLD_OBJECT, model)])
        hand.wait_for_ends(1)
        view.show_cloud(POINTS, COLORS, point_size=0.002)
        client.node("PointCloudMessage", "/cloud")  # whatever was answered came before this
        assert not [m for m in client.messages if m["type"] == "ShareUrlUpdated"]
    assert not asked


def test_a_closed_view_serves_nobody(hand, model):
    view = SceneView(
        model, T_WORLD_OBJECT, FIRST_VIEW, DragHandlers(hand.start, hand.move, hand.end), drawable
    )
    folder = view.socket_path.parent
    view.close()
    assert not folder.exists()


def test_a_place_that_is_no_number_moves_nothing_and_the_drag_still_ends(view, hand):
    with connect(view) as client:
        client.take()
        client.send(
            "TransformControlsUpdateMessage",
            name="/object",
            owner=client.node("TransformControlsMessage", "/object").get("owner", ""),
            wxyz=[float("nan")] * 4,
            position=[0.0, 0.0, float("inf")],
        )
        client.let_go()
        hand.wait_for_ends(1)
    assert hand.calls == ["start", "end"]


def test_the_camera_is_told_of_when_a_page_comes_and_when_it_is_moved(view):
    told = []
    view.watch_camera(CameraWatch(lambda camera, seconds: told.append(camera)))
    with connect(view) as client:
        wait_until(lambda: told, "the first view")
        client.send("ViewerCameraMessage", **CAMERA | {"position": [float("nan")] * 3})
        client.send("ViewerCameraMessage", **CAMERA | {"up_direction": CAMERA["position"]})  # no up at all
        client.send("ViewerCameraMessage", **CAMERA | {"position": [0.5, 0.25, 2.00001]})
        wait_until(lambda: len(told) == 2, "the second view")
    assert told[0] == {
        "position": [1.0, 1.0, 1.0],
        "look_at": [0.0, 0.0, 0.0],
        "up": [0.0, 0.0, 1.0],
        "fov": 1.3,
    }
    assert told[1] == told[0] | {"position": [0.5, 0.25, 2.0]}
