"""Run-length codes and COCO entries."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from app.export.bop.coco import CocoScene, full_box, mask_from_run_lengths, run_lengths


def test_run_lengths_go_down_the_columns_and_begin_outside() -> None:
    mask = np.array([[0, 1, 1], [0, 1, 0]], dtype=bool)
    assert run_lengths(mask) == {"counts": [2, 3, 1], "size": [2, 3]}
    assert run_lengths(~mask) == {"counts": [0, 2, 3, 1], "size": [2, 3]}


@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=8), elements=st.booleans()))
def test_a_mask_comes_back_from_its_run_lengths(mask: np.ndarray) -> None:
    code = run_lengths(mask)
    assert sum(code["counts"]) == mask.size
    np.testing.assert_array_equal(mask_from_run_lengths(code), mask)


def test_an_instance_has_the_visible_area_and_the_box_of_the_whole() -> None:
    mask = np.zeros((6, 8), dtype=bool)
    mask[1:4, 2:7] = True
    visible = mask.copy()
    visible[:, 4:] = False
    scene = CocoScene("name", "test", "2026-01-02", [5])
    scene.add_image(3, "rgb/000003.png", 8, 6)
    scene.add_instance(3, 5, mask, visible, 0.4)
    scene.add_instance(3, 5, mask, np.zeros_like(mask), 0.0)
    (annotation,) = scene.content()["annotations"]
    assert annotation["area"] == 6
    assert annotation["bbox"] == [2, 1, 5, 3]
    assert (annotation["id"], annotation["image_id"], annotation["category_id"]) == (1, 3, 5)
    assert annotation["ignore"] is False
    assert scene.content()["images"] == [{"id": 3, "file_name": "rgb/000003.png", "width": 8, "height": 6}]


def test_a_single_pixel_is_one_wide() -> None:
    mask = np.zeros((4, 4), dtype=bool)
    mask[2, 1] = True
    assert full_box(mask) == [1, 2, 1, 1]
