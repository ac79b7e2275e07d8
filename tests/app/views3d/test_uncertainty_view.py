"""The ellipsoid and the motions that depth cannot tell, over the wire and as lines."""

from collections.abc import Iterator

import numpy as np
import pytest

from app.confidence.uncertainty import Uncertainty, UnknownMotion
from app.datasets.outline_mesh import drawable
from app.views3d.uncertainty_view import lines_of
from app.views3d.view import DragHandlers, FirstView, SceneView
from tests.app.export.site import NEAR_VIEW, TOOL, mesh_of, model_of
from tests.app.labeling.viser_client import ViserClient

CENTRE = np.array([0.1, 0.2, 0.3])
AXIS = np.array([0.0, 0.6, 0.8])
ELLIPSOID, MOTIONS = "/uncertainty/ellipsoid", "/uncertainty/motions"


def unsure(semi_axes: list[float], *unknown: UnknownMotion) -> Uncertainty:
    return Uncertainty(CENTRE, np.diag(semi_axes), 0.1, unknown)


@pytest.fixture
def view() -> Iterator[SceneView]:
    first = FirstView(T_world_camera=NEAR_VIEW, field_of_view=0.8, distance=0.5)
    hands = DragHandlers(lambda: None, lambda T: None, lambda broken: None)
    opened = SceneView(model_of(mesh_of(TOOL)), np.eye(4), first, hands, drawable)
    yield opened
    opened.close()


def connect(view: SceneView) -> ViserClient:
    return ViserClient(view.socket_path)


def test_a_turn_is_an_arc_about_the_axis():
    segments = lines_of(UnknownMotion("free motion", "turn", AXIS, 0.5, "the z axis"), CENTRE, 0.2)
    axis_line, arc = segments[0], segments[1:-2]
    assert np.allclose(np.cross(axis_line[1] - axis_line[0], AXIS), 0.0)
    assert axis_line.mean(axis=0) == pytest.approx(CENTRE)
    assert np.allclose((arc - CENTRE) @ AXIS, 0.0)
    radii = np.linalg.norm(arc - CENTRE, axis=2)
    assert np.allclose(radii, radii[0, 0]) and radii[0, 0] > 0.1
    begin, end = arc[0, 0] - CENTRE, arc[-1, 1] - CENTRE
    assert np.arccos(begin @ end / radii[0, 0] ** 2) == pytest.approx(1.0)
    assert np.array_equal(arc[:-1, 1], arc[1:, 0])


def test_a_shift_is_a_piece_of_the_axis():
    free = lines_of(UnknownMotion("free motion", "shift", AXIS, 0.05, "the z axis"), CENTRE, 0.2)
    mode = lines_of(UnknownMotion("other mode", "shift", AXIS, 0.05, "the z axis"), CENTRE, 0.2)
    assert free[1] == pytest.approx(np.array([CENTRE - 0.05 * AXIS, CENTRE + 0.05 * AXIS]))
    assert mode[1] == pytest.approx(np.array([CENTRE, CENTRE + 0.05 * AXIS]))


def test_the_ellipsoid_has_its_size_and_goes_away(view):
    view.uncertainty.show(unsure([0.002, 0.005, 0.003]))
    with connect(view) as client:
        ball = client.node("IcosphereMessage", ELLIPSOID)
        assert np.allclose(ball["props"]["scale"], [0.002, 0.005, 0.003])
        view.uncertainty.show(None)
        client.wait_for("RemoveSceneNodeMessage", lambda message: message["name"] == ELLIPSOID)


def test_what_is_as_good_as_a_point_is_not_drawn(view):
    view.uncertainty.show(unsure([0.0005] * 3, UnknownMotion("free motion", "turn", AXIS, 0.5, "the z axis")))
    with connect(view) as client:
        client.node("LineSegmentsMessage", MOTIONS)
        assert not [m for m in client.messages if m.get("name") == ELLIPSOID]


def test_it_can_be_hidden_without_being_forgotten(view):
    assert view.uncertainty.visible
    view.uncertainty.visible = False
    view.uncertainty.show(unsure([0.01] * 3))
    with connect(view) as client:
        client.node("IcosphereMessage", ELLIPSOID)
        client.wait_for(
            "SetSceneNodeVisibilityMessage",
            lambda message: message["name"] == "/uncertainty" and not message["visible"],
        )
    assert not view.uncertainty.visible


def test_several_motions_are_named_where_they_end(view):
    turn, shift = (
        UnknownMotion("free motion", motion, AXIS, 0.05, "the z axis") for motion in ("turn", "shift")
    )
    view.uncertainty.show(unsure([0.0005] * 3, turn, shift))
    with connect(view) as client:
        for name in ("arc 1", "line 2"):
            assert (
                client.node("LabelMessage", f"/uncertainty/{name.replace(' ', '-')}")["props"]["text"] == name
            )
        view.uncertainty.show(unsure([0.0005] * 3, turn))
        client.wait_for("RemoveSceneNodeMessage", lambda message: message["name"] == "/uncertainty/arc-1")
