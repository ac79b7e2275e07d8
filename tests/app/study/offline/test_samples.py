"""What names the input of an offline snap."""

import numpy as np
import pytest

from app.storage.tables import Frame, Object
from app.study.offline.samples import SampledView
from registration_core import SnapConfig

OBJECT = {"mesh_hash": "a", "mesh_format": "ply", "symmetries": {"discrete": [], "continuous": []}}
FRAME = {
    **{"depth_hash": "b", "depth_scale": 0.1, "color_hash": "c", "T_world_camera": np.eye(4).tolist()},
    **{"fx": 500.0, "fy": 500.0, "cx": 319.5, "cy": 239.5},
}


def named(T: np.ndarray, config: SnapConfig | None = None, **changes: object) -> str:
    known, seen = ({key: changes.get(key, of[key]) for key in of} for of in (OBJECT, FRAME))
    return SampledView(Object(**known), Frame(**seen), config or SnapConfig()).input_hash(T)


@pytest.mark.parametrize(
    "changes",
    [{"mesh_hash": "z"}, {"depth_hash": "z"}, {"color_hash": "z"}, {"color_hash": None}, {"fx": 501.0}],
    ids=str,
)
def test_another_input_has_another_name(changes) -> None:
    assert named(np.eye(4), **changes) != named(np.eye(4))


def test_poses_and_configurations_are_told_apart() -> None:
    moved = np.eye(4)
    moved[0, 3] = 1e-6
    assert named(moved) != named(np.eye(4)) != named(np.eye(4), SnapConfig.paper())
    assert named(np.eye(4)) == named(np.eye(4))
