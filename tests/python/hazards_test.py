"""What must never end the interpreter: threads, Ctrl-C, objects that go early or late, arrays that are none."""

import gc
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import raylign


def in_threads(count, work):
    """Runs work(i) at the same time in each; raises what one of them raised."""
    failed = []

    def run(i):
        try:
            work(i)
        except BaseException as error:  # told below
            failed.append(error)

    threads = [threading.Thread(target=run, args=(i,)) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failed:
        raise failed[0]


def run_alone(script):
    """A process of its own, whose end is looked at."""
    return subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=120)


SMALL_SCENE = """
    import threading, time
    import numpy as np, raylign
    volume = raylign.phantom_volume("spine", 160, 32)
    views = [raylign.phantom_xray("spine", 160, raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(64, 64),
                                                                   pixel_pitch_mm=(4.5, 4.5), primary_deg=degrees), np.eye(4))
             for name, degrees in (("AP", 0), ("LAT", 90))]
"""


def test_a_session_is_read_while_others_work_on_it(spine):
    session = raylign.Session(spine.volume, spine.views, "cpu")
    expected = session.evaluate(spine.start)[0]

    def work(i):
        for _ in range(15):
            if i % 2:
                assert session.volume_bytes > 0 and session.view_count == 2 and session.evaluations > 0
            elif i % 4 == 0:
                assert session.evaluate(spine.start)[0] == expected
            else:
                assert session.render(spine.start, 1).shape == (96, 96)

    in_threads(8, work)
    assert session.evaluations == 1 + 2 * 15


def test_sessions_come_and_go_in_many_threads(spine):
    backend = raylign.Backend("cpu", threads=2)
    parent = raylign.Session(spine.volume, spine.views, backend)
    expected = parent.evaluate(spine.truth)[0]

    def work(i):
        for _ in range(4):
            session = parent.with_views(spine.views) if i % 2 else raylign.Session(spine.volume, spine.views, backend)
            assert session.evaluate(spine.truth)[0] == expected

    in_threads(4, work)
    child = parent.with_views(spine.views)
    del parent, backend
    gc.collect()
    assert child.evaluate(spine.truth)[0] == expected


def test_on_progress_may_use_the_backend_of_the_run(spine):
    backend = raylign.Backend("cpu")
    session = raylign.Session(spine.volume, spine.views, backend)
    expected = raylign.register(spine.volume, spine.views, spine.start, backend=backend).world_from_ct
    seen, dropped = [], [raylign.Session(spine.volume, spine.views, backend)]

    def look(fraction, left_s, cost):
        seen.append(session.evaluate(spine.truth)[0])
        dropped.clear()  # the last reference: it ends here, in the middle of the run

    found = raylign.register(spine.volume, spine.views, spine.start, backend=backend, on_progress=look)
    assert np.array_equal(found.world_from_ct, expected) and len(set(seen)) == 1


def test_views_changed_during_a_run_do_not_change_it(spine):
    views = spine.xrays(spine.truth)
    expected = raylign.register(spine.volume, views, spine.start).world_from_ct
    running, found = threading.Event(), []

    def run():
        found.append(raylign.register(spine.volume, views, spine.start, on_progress=lambda *_: running.set()))

    thread = threading.Thread(target=run)
    thread.start()
    assert running.wait(60)
    for view in views:
        view.image = None
        view.weights = np.zeros((96, 96))
    thread.join()
    assert np.array_equal(found[0].world_from_ct, expected)


def test_a_view_may_change_while_its_x_ray_is_taken(spine):
    view = spine.xrays(spine.truth)[0]
    images = [np.ones((96, 96)), None]

    def work(i):
        for k in range(20):
            if i:
                view.image = images[k % 2]
            else:
                assert raylign.phantom_xray("spine", 160, view, spine.truth).image.shape == (96, 96)

    in_threads(2, work)


def test_ctrl_c_while_tracking_keeps_the_frame_and_the_tracker(spine):
    tracker = raylign.Tracker(spine.volume, spine.start, "cpu", search="near", starts=4000)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(raylign.Interrupted) as stopped:
        tracker.feed(0, spine.views)
    assert stopped.value.result.frame == 0 and np.isfinite(stopped.value.result.world_from_ct).all()
    assert tracker.feed(1, spine.views).frame == 1


def test_a_handler_of_ones_own_may_let_the_run_go_on(spine):
    heard = []
    before = signal.signal(signal.SIGUSR1, lambda *_: heard.append(1))
    try:
        timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGUSR1))
        timer.start()
        result = raylign.register(spine.volume, spine.views, spine.start, search="near", starts=500)
        timer.join()
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert result.ok and heard


def test_no_images_no_costs_but_drrs(spine):
    bare = [raylign.View(view.name, view.intrinsics, view.camera_from_world, view.size_px, view.sdd_mm) for view in spine.views]
    session = raylign.Session(spine.volume, bare, "cpu")
    for call in (session.evaluate, session.linearize):
        with pytest.raises(raylign.Error, match="every view needs an image"):
            call(spine.truth)
    with pytest.raises(raylign.Error, match="every view needs an image"):
        session.set_weights([np.ones((96, 96))] * 2)
    assert session.render(spine.truth).shape == (96, 96)
    lost = raylign.Tracker(spine.volume, spine.truth, "cpu").feed(0, bare)
    assert lost.status == "lost" and lost.reasons == ["evaluate: every view needs an image"]


@pytest.mark.parametrize("bad", [None, "pose", {}, [[1, 2], [3]], np.zeros((4, 4), complex), np.zeros((4, 4), object), np.zeros(()),
                                 np.zeros((4, 4, 4, 4)), np.zeros((3, 4)), np.full((4, 4), np.nan), np.zeros((4, 4))])
def test_poses_that_are_none(spine, bad):
    session = raylign.Session(spine.volume, spine.views[:1], "cpu")
    for call in (session.evaluate, session.linearize, session.render, lambda pose: raylign.move(pose, np.zeros(6), session.centre),
                 lambda pose: raylign.phantom_xray("spine", 160, spine.views[0], pose)):
        with pytest.raises((raylign.Error, TypeError)):
            call(bad)


def test_arrays_in_any_order_are_read_as_they_are_indexed(spine):
    session = raylign.Session(spine.volume, spine.views, "cpu")
    poses = np.stack([spine.truth, spine.start])
    expected = session.evaluate(poses)
    frozen = poses.copy()
    frozen.flags.writeable = False
    for same in (np.asfortranarray(poses), frozen, np.repeat(poses, 2, axis=0)[::2], poses.astype(">f8"), poses.tolist()):
        assert np.array_equal(session.evaluate(same), expected)
    half = np.ones((96, 96), order="F")
    half[:, :40] = 0
    session.set_weights([half, half])
    masked = session.evaluate(poses)
    session.set_weights([np.ascontiguousarray(half)] * 2)
    assert np.array_equal(session.evaluate(poses), masked)


def test_the_interpreter_ends_while_all_of_it_lives():
    done = run_alone(SMALL_SCENE + """
    backend = raylign.Backend("cpu")
    session = raylign.Session(volume, views, backend)
    session.evaluate(np.eye(4))
    other = session.with_views(views)
    result = raylign.register(volume, views, np.eye(4), backend=backend)
    tracker = raylign.Tracker(volume, np.eye(4), backend)
    session.cycle = session  # collected last, if at all
    """)
    assert done.returncode == 0 and not done.stderr, done.stderr


def test_the_interpreter_ends_while_a_thread_works():
    done = run_alone(SMALL_SCENE + """
    def work():
        session = raylign.Session(volume, views, "cpu")
        while True:
            session.evaluate(np.stack([np.eye(4)] * 20))
            raylign.register(volume, views, np.eye(4), on_progress=lambda *_: None)
    for _ in range(3):
        threading.Thread(target=work, daemon=True).start()
    time.sleep(0.5)
    """)
    assert done.returncode == 0 and not done.stderr, done.stderr
