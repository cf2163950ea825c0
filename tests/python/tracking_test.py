import numpy as np
import pytest

import raylign
from conftest import moved


def path(spine, frame):
    return moved(spine.truth, x=4 * np.sin(0.5 * frame), y=2 * frame)


def test_follows_a_path_across_a_missing_frame(spine):
    frames = (None if frame == 2 else spine.xrays(path(spine, frame)) for frame in range(6))
    for found in raylign.track(spine.volume, frames, spine.start):
        assert found.status == ("missing" if found.frame == 2 else "ok"), found.reasons
        if found.frame != 2:
            assert spine.error_mm(moved(found.world_from_ct, x=-4 * np.sin(0.5 * found.frame), y=-2 * found.frame)) < 0.6


def test_numbers_frames_and_begins_where_the_first_views_look(spine):
    found = list(raylign.track(spine.volume, [(3, None), (5, spine.views), (6, spine.views)]))
    assert [frame.frame for frame in found] == [3, 5, 6]
    assert [frame.status for frame in found] == ["missing", "ok", "ok"]
    with pytest.raises(raylign.Error, match="frame = 5"):
        list(raylign.track(spine.volume, [(5, spine.views), (5, spine.views)]))


def test_a_tracker_fed_by_hand(spine):
    tracker = raylign.Tracker(spine.volume, spine.start, "cpu", recovery="none", max_jump_mm=50)
    assert tracker.feed(0, spine.views).ok
    assert spine.error_mm(tracker.predicted(1)) < 0.5
    with pytest.raises(raylign.Error, match="max_jump_mm"):
        raylign.Tracker(spine.volume, spine.start, "cpu", max_jump_mm=-1)
