"""Groups of views show what they promise."""

from pathlib import Path

import numpy as np

from benchmarks.registration.several_views import (
    VIEWS,
    bunny_groups,
    camera_pose,
    mug_groups,
    tells_the_handle,
)


def test_of_two_views_of_a_mug_only_the_second_tells_where_the_handle_is() -> None:
    groups = mug_groups(2, 1)
    assert len(groups) == 2
    for group in groups:
        hidden, seen = group.views
        assert not tells_the_handle(hidden) and tells_the_handle(seen)
        first, second = (camera_pose(view) @ view.truth for view in group.views)
        assert np.allclose(first, second)


def test_views_of_the_bunny_go_around_it(shared_data: Path) -> None:
    groups = bunny_groups(1)
    assert [len(group.views) for group in groups] == [VIEWS, VIEWS]
