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


def differences(value, poses, centre):
    """Of value(poses) (N,) along move, by central differences: (N, 6)."""
    step = np.diag([5e-4] * 3 + [0.05] * 3)  # rad, mm
    columns = [(value(raylign.move(poses, np.tile(row, (len(poses), 1)), centre)) -
                value(raylign.move(poses, np.tile(-row, (len(poses), 1)), centre))) / (2 * row.max()) for row in step]
    return np.stack(columns, axis=1)


def assert_close(gradients, expected):
    scale = np.array([60.0] * 3 + [1.0] * 3)  # rotations as the millimetres that they move the spine's side
    assert np.linalg.norm((gradients - expected) / scale) < 0.02 * np.linalg.norm(expected / scale), (gradients, expected)


def test_drr_gradient_is_the_derivative_of_what_is_rendered(spine, session):
    poses = np.stack([spine.start, spine.truth])
    upstream = np.random.default_rng(3).normal(0.2, 1, (2, 2, 96, 96))
    upstream[0, 1] = 1  # a constant: what a sum has

    def product(at):
        return (raylign.drr(spine.volume, spine.views, at, "cpu") * upstream).sum(axis=(1, 2, 3), dtype=float)

    gradients = session.drr_gradient(poses, upstream)
    assert gradients.shape == (2, 6) and gradients.dtype == float
    assert_close(gradients, differences(product, poses, session.centre))
    assert np.array_equal(session.drr_gradient(poses[1], [list(upstream[1])])[0], gradients[1])  # lists will do, too
    elsewhere = session.drr_gradient(poses, upstream, centre_ct_mm=session.centre + [10, 0, 0])
    np.testing.assert_allclose(elsewhere[:, 3:], gradients[:, 3:], rtol=1e-5)  # a shift is one about any point
    assert not np.allclose(elsewhere[:, :3], gradients[:, :3])


@pytest.mark.parametrize("upstream, says", [
    (np.ones((1, 2, 96, 95)), r"upstream\[0\]\[0\]: must have the shape \(96, 96\) of the camera, has \(96, 95\)"),
    (np.ones((1, 1, 96, 96)), r"upstream\[0\]: must have the length 2, has 1"),
    (np.ones((2, 2, 96, 96)), "upstream: must have the length 1, has 2"),
    (np.full((1, 2, 96, 96), np.nan), r"upstream\[0\]\[0\]: must be finite"),
    (3, "upstream: must be an array or lists of images"),
])
def test_what_is_no_upstream_is_refused(spine, session, upstream, says):
    with pytest.raises(raylign.Error, match=says):
        session.drr_gradient(spine.start, upstream)


def test_torch_has_the_gradient_of_the_cost(spine, session):
    torch = pytest.importorskip("torch")
    from raylign.torch import cost

    poses = np.stack([spine.start, spine.truth])
    twists = torch.zeros((2, 6), dtype=torch.float64, requires_grad=True)
    costs = cost(twists, poses, session)
    np.testing.assert_allclose(costs.detach().numpy(), session.evaluate(poses), atol=1e-7)
    (costs * torch.tensor([1.0, -3.0])).sum().backward()
    np.testing.assert_allclose(twists.grad.numpy(), session.linearize(poses)[1] * [[1], [-3]])


def test_torch_has_the_gradient_of_drrs(spine, session):
    """Through a loss that PyTorch differentiates: what one would train with."""
    torch = pytest.importorskip("torch")
    from raylign.torch import drr

    poses = np.stack([spine.start, spine.truth])
    xrays = torch.tensor(np.stack([view.image for view in spine.views]), dtype=torch.float64)

    def losses(images):
        return ((images - xrays) ** 2).mean(dim=(2, 3)).sum(dim=1) + torch.tanh(images).mean(dim=(1, 2, 3))

    for kind in (torch.float64, torch.float32):
        twists = torch.zeros((2, 6), dtype=kind, requires_grad=True)
        images = drr(twists, torch.tensor(poses), session)
        assert images.shape == (2, 2, 96, 96) and images.dtype == kind
        assert np.array_equal(images.detach().numpy(), raylign.drr(spine.volume, spine.views, poses, "cpu").astype(images.detach().numpy().dtype))
        losses(images).sum().backward()
        assert twists.grad.dtype == kind
        assert_close(twists.grad.double().numpy(), differences(
            lambda at: losses(torch.tensor(raylign.drr(spine.volume, spine.views, at, "cpu"), dtype=torch.float64)).numpy(), poses, session.centre))
    with pytest.raises(raylign.Error, match=r"twists: must have the shape \(2, 6\) for 2 poses, has \(1, 6\)"):
        drr(torch.zeros((1, 6)), poses, session)


def test_torch_descends_to_the_pose(spine, session):
    """The loop of docs/python.md: a step, then the poses move and the twists begin at zero again."""
    torch = pytest.importorskip("torch")
    from raylign.torch import drr

    pose = raylign.perturbed_start(spine.truth, spine.targets, 1.5, 4)[None]
    xrays = torch.tensor(np.stack([view.image for view in spine.views]))
    scale = torch.tensor([1 / 60] * 3 + [1.0] * 3)
    assert spine.error_mm(pose[0]) > 1.4
    for _ in range(25):
        twists = torch.zeros((1, 6), requires_grad=True)
        loss = ((drr(twists, pose, session) - xrays) ** 2).mean()
        loss.backward()
        direction = scale**2 * twists.grad
        pose = raylign.move(pose, (-0.15 * direction / (scale * twists.grad).norm()).numpy(), session.centre)
    assert spine.error_mm(pose[0]) < 0.4  # recorded: 0.13


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


def test_threads_are_for_every_backend_that_has_any():
    names = [status["name"] for status in raylign.backends() if status["available"] and status["name"] != "reference"]
    assert {name: raylign.Backend(name, threads=3).info["threads"] for name in names} == dict.fromkeys(names, 3)
