import os
import signal
import threading
import time

import numpy as np
import pytest

import raylign


def test_finds_the_pose_and_says_how_sure_it_is(spine):
    result = raylign.register(spine.volume, spine.views, spine.start)
    assert result.ok and result.reasons == []
    assert spine.error_mm(result.world_from_ct) < 0.3  # recorded: 0.10
    assert spine.error_mm(result.world_from_ct) < 2 * result.expected_error_mm
    assert result.covariance.shape == (6, 6) and np.all(np.linalg.eigvalsh(result.covariance) > 0)
    np.testing.assert_allclose(result.ct_from_world @ result.world_from_ct, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(result.start_world_from_ct, spine.start, atol=1e-12)
    assert [level["volume_size"][0] for level in result.levels] == [32, 64]
    assert result.history[-1]["cost"] <= result.history[0]["cost"]
    assert "expected" in str(result) and "ok" in repr(result)


def test_same_bits_again_and_by_another_name(spine):
    first = raylign.register(spine.volume, spine.views, spine.start, backend="cpu")
    again = raylign.register(spine.volume, spine.views, spine.start, backend=raylign.Backend("cpu", threads=1))
    assert np.array_equal(first.world_from_ct, again.world_from_ct)


def test_takes_files_and_its_pose_is_the_programs(spine, tmp_path):
    volume, views = tmp_path / "ct.mha", spine.views[:1]
    raylign.write_volume(volume, spine.volume)
    raylign.write_pose(tmp_path / "start.json", spine.start)
    read = raylign.read_volume(volume, is_attenuation=True)
    assert read.notes and np.array_equal(read.attenuation, spine.volume.attenuation)
    by_file = raylign.register(read, views, tmp_path / "start.json")
    by_array = raylign.register(spine.volume, views, raylign.read_pose(tmp_path / "start.json"))
    assert np.array_equal(by_file.world_from_ct, by_array.world_from_ct)


def test_starts_in_the_middle_of_the_views_without_a_start(spine):
    result = raylign.register(spine.volume, spine.views)
    np.testing.assert_allclose(result.start_world_from_ct, raylign.default_start(spine.volume, spine.views))
    assert spine.error_mm(result.world_from_ct) < 0.3


def test_refines_views_and_tells_what_it_corrected(spine):
    result = raylign.register(spine.volume, spine.views, spine.start, refine_views=(2, 10))
    assert any(one and one["applied"] for one in result.corrections)
    plain = raylign.register(spine.volume, spine.views, spine.start)
    assert all(not one["applied"] for one in plain.corrections)


def test_progress_rises_and_what_it_raises_ends_the_run(spine):
    seen = []
    raylign.register(spine.volume, spine.views, spine.start, on_progress=lambda fraction, left_s, cost: seen.append(fraction))
    assert seen == sorted(seen) and 0 < seen[-1] <= 1

    def fail(fraction, left_s, cost):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        raylign.register(spine.volume, spine.views, spine.start, on_progress=fail)


def test_ctrl_c_keeps_the_best_until_then(spine):
    def press(fraction, left_s, cost):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.06)  # longer than a run waits between two looks

    with pytest.raises(KeyboardInterrupt) as stopped:
        raylign.register(spine.volume, spine.views, spine.start, on_progress=press)
    assert isinstance(stopped.value, raylign.Interrupted)
    best = stopped.value.result
    assert not best.ok and best.termination == "stopped" and np.isfinite(best.world_from_ct).all()


def test_other_threads_run_meanwhile(spine):
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    raylign.register(spine.volume, spine.views, spine.start, search="near", starts=2000)
    done.set()
    thread.join()
    assert counted[0] > 20


def test_several_threads_share_a_backend(spine):
    backend, poses = raylign.Backend("cpu"), [None] * 4

    def run(i):
        poses[i] = raylign.register(spine.volume, spine.views, spine.start, backend=backend).world_from_ct

    threads = [threading.Thread(target=run, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(pose, poses[0]) for pose in poses)
