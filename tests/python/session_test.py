import gc
import threading

import numpy as np
import pytest

import raylign
from conftest import moved
from own_optimizer import gauss_newton


@pytest.fixture(scope="module")
def session(spine):
    return raylign.Session(spine.volume, spine.views, "cpu")


def test_costs_are_least_at_the_truth(spine, session):
    costs = session.evaluate(np.stack([moved(spine.truth, x=x) for x in (-4, 0, 4)]))
    assert costs.shape == (3,) and costs.argmin() == 1 and np.all((costs >= 0) & (costs <= 2))
    assert session.evaluate(spine.truth).shape == (1,)
    assert session.evaluate(np.empty((0, 4, 4))).shape == (0,)


def test_linearize_is_the_derivative_along_move(spine, session):
    costs, gradients, curvatures = session.linearize(spine.start)
    assert costs.shape == (1,) and gradients.shape == (1, 6) and curvatures.shape == (1, 6, 6)
    assert costs[0] == pytest.approx(session.evaluate(spine.start)[0], rel=1e-6)
    step = np.diag([5e-4] * 3 + [0.05] * 3)  # rad, mm
    ahead, behind = (session.evaluate(raylign.move(spine.start, sign * step, session.centre)) for sign in (1, -1))
    np.testing.assert_allclose(gradients[0], (ahead - behind) / (2 * np.diag(step)), rtol=0.03, atol=1e-4 * np.abs(gradients).max())


def test_move_turns_about_the_centre(spine, session):
    turned = raylign.move(spine.truth, [0, 0, np.pi / 2, 0, 0, 0], session.centre)[0]
    np.testing.assert_allclose(turned[:3, :3] @ session.centre + turned[:3, 3], spine.truth[:3, :3] @ session.centre + spine.truth[:3, 3])
    np.testing.assert_allclose(turned[:3, :3], np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]) @ spine.truth[:3, :3], atol=1e-12)
    with pytest.raises(raylign.Error, match="twists: must have the shape"):
        raylign.move(spine.truth, [0, 0, 0], session.centre)


def test_torch_has_the_gradient(spine, session):
    torch = pytest.importorskip("torch")
    from raylign.torch import cost

    twists = torch.zeros((2, 6), dtype=torch.float64, requires_grad=True)
    cost(twists, np.stack([spine.start, spine.truth]), session).sum().backward()
    np.testing.assert_allclose(twists.grad.numpy(), session.linearize(np.stack([spine.start, spine.truth]))[1])


def test_an_optimizer_of_ones_own_ends_right(spine, session):
    pose = gauss_newton(session, raylign.perturbed_start(spine.truth, spine.targets, 2, 1), steps=20)
    assert spine.error_mm(pose) < 0.5


def test_drrs_are_what_the_session_renders_and_the_phantom_is(spine, session):
    images = raylign.drr(spine.volume, spine.views, np.stack([spine.truth, spine.start]), "cpu")
    assert images.shape == (2, 2, 96, 96) and images.dtype == np.float32
    assert np.array_equal(images[1, 0], session.render(spine.start, 0))
    exact = raylign.phantom_xray("spine", 160, spine.views[0], spine.truth).image
    assert np.corrcoef(images[0, 0].ravel(), exact.ravel())[0, 1] > 0.999


def test_other_views_on_the_same_volume(spine, session):
    one = session.with_views(spine.views[:1])
    fresh = raylign.Session(spine.volume, spine.views[:1], "cpu")
    assert one.view_count == 1 and np.array_equal(one.evaluate(spine.start), fresh.evaluate(spine.start))
    assert np.array_equal(one.linearize(spine.start)[1], fresh.linearize(spine.start)[1])


def test_weights_leave_pixels_out_and_ones_bring_them_back(spine):
    session = raylign.Session(spine.volume, spine.views, "cpu")
    before = session.evaluate(spine.start)
    half = np.ones((96, 96))
    half[:, :48] = 0
    session.set_weights([half, half])
    assert not np.array_equal(session.evaluate(spine.start), before)
    session.set_weights([np.ones((96, 96))] * 2)
    assert np.array_equal(session.evaluate(spine.start), before)


def test_outlives_what_it_was_made_of(spine):
    session = raylign.Session(raylign.phantom_volume("spine", 160, 32), list(spine.views), "cpu")
    other = session.with_views(spine.views)
    expected = session.evaluate(spine.start)
    del session
    gc.collect()
    assert np.array_equal(other.evaluate(spine.start), expected)


def test_threads_take_turns(spine, session):
    expected, wrong = session.evaluate(spine.start), []

    def work():
        for _ in range(20):
            if not np.array_equal(session.evaluate(spine.start), expected):
                wrong.append(1)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
