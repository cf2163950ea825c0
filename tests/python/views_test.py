import json

import numpy as np
import pytest

import raylign
from conftest import c_arm


def test_one_camera_told_in_three_ways():
    c = c_arm("AP", 30)
    by_matrix = raylign.View.projection("AP", c.projection_matrix, c.size_px)
    by_camera = raylign.View("AP", c.intrinsics, c.camera_from_world, c.size_px, c.sdd_mm)
    points = np.array([[0, 0, 0], [30, -20, 50.0]])
    for view in (by_matrix, by_camera):
        np.testing.assert_allclose(view.project(points), c.project(points), atol=1e-9)
        np.testing.assert_allclose(view.source, c.source, atol=1e-6)
    assert c.sdd_mm == 1500 and by_matrix.sdd_mm is None
    np.testing.assert_allclose(c.project(points[:1]), [[47.5, 47.5]], atol=1e-9)


def test_poses_that_raylign_gave_out_come_back_to_the_last_bit(spine, tmp_path):
    for seed in range(20):
        pose = raylign.perturbed_start(spine.truth, spine.targets, 20, seed)
        raylign.write_pose(tmp_path / "pose.json", pose)
        assert np.array_equal(json.loads((tmp_path / "pose.json").read_text())["world_from_ct"], pose)


def test_images_go_in_and_come_out():
    view = c_arm("AP", 0)
    assert view.image is None
    pixels = np.random.default_rng(1).random((96, 96))
    view.image = pixels
    np.testing.assert_array_equal(view.image, pixels.astype(np.float32))
    view.weights = pixels > 0.5
    np.testing.assert_array_equal(view.weights, (pixels > 0.5).astype(np.float32))
    view.image = None
    assert view.image is None
    with pytest.raises(raylign.Error, match=r"view AP: image: must have the shape \(96, 96\) of the camera, has \(96, 95\)"):
        view.image = pixels[:, :95]


def test_counts_become_line_integrals():
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 96), np.linspace(-1.2, 1.2, 96))
    thickness = 4 * np.sqrt(np.clip(1 - x**2 - y**2, 0, None))  # a ball in air
    counts = np.round(50000 * np.exp(-thickness)).astype(np.uint16)
    image, weights, decided = raylign.line_integral(counts, i0=50000)
    np.testing.assert_allclose(image, thickness, atol=5e-3)
    assert weights is None and decided
    with pytest.raises(raylign.Error, match="kind = counts: must be auto, line-integral or transmission"):
        raylign.line_integral(counts, kind="counts")


@pytest.mark.parametrize("changed, says", [
    ({"size_px": (0, 64)}, r"size_px = \(0, 64\) in view AP: must be whole numbers in \[1, 65536\]"),
    ({"size_px": (1 << 30, 1 << 30)}, "size_px"), ({"size_px": (63.5, 64)}, "size_px"), ({"size_px": (np.nan, 64)}, "size_px"),
    ({"size_px": (64,)}, r"view AP: size_px: must have the shape \(2,\), has \(1,\)"),
    ({"sad_mm": -1}, "sad_mm = -1.0+ in view AP: must be positive"), ({"sdd_mm": np.inf}, "sdd_mm = inf"),
    ({"sdd_mm": 500}, "sdd_mm = 500.0+ in view AP: must be at least sad_mm = 1000"),
    ({"pixel_pitch_mm": (1, 0)}, "pixel_pitch_mm = 0.0+ in view AP: must be positive"), ({"pixel_pitch_mm": 1}, "pixel_pitch_mm: must have the shape"),
    ({"primary_deg": np.inf}, r"primary_deg = inf in view AP: must be in \[-360, 360\]"), ({"secondary_deg": np.nan}, "secondary_deg"),
    ({"principal_point_px": (1, 2, 3)}, r"principal_point_px: must have the shape \(2,\), has \(3,\)"),
])
def test_cameras_are_checked_as_those_of_files(changed, says):
    right = dict(sad_mm=1000, sdd_mm=1500, size_px=(64, 64), pixel_pitch_mm=(1, 1))
    with pytest.raises(raylign.Error, match=says):
        raylign.View.c_arm("AP", **{**right, **changed})


def test_matrices_of_another_shape_are_refused():
    camera = c_arm("AP", 0)
    with pytest.raises(raylign.Error, match=r"matrix: must have the shape \(3, 4\), has \(3, 3\)"):
        raylign.View.projection("AP", np.eye(3), (64, 64))
    with pytest.raises(raylign.Error, match=r"intrinsics: must have the shape \(3, 3\), has \(4, 4\)"):
        raylign.View("AP", np.eye(4), camera.camera_from_world, (64, 64))


@pytest.mark.parametrize("views", [None, 5])
def test_no_views_at_all_is_a_type_error(spine, views):
    with pytest.raises(TypeError, match="views: must be raylign.View or paths, is a (NoneType|int)"):
        raylign.register(spine.volume, views)


def test_without_a_start_and_without_views(spine):
    with pytest.raises(raylign.Error, match="views: at least one is needed"):
        raylign.register(spine.volume, [])


@pytest.mark.parametrize("views, says", [
    ([], "views: at least one is needed"),
    ([c_arm("AP", 0)], "every view needs an image"),
])
def test_views_that_cannot_be_registered_are_named(spine, views, says):
    with pytest.raises(raylign.Error, match=says):
        raylign.register(spine.volume, views, spine.start)


def test_poses_and_options_are_checked(spine):
    def register(**options):
        return raylign.register(spine.volume, spine.views, options.pop("start", spine.start), **options)

    mirrored = np.diag([-1.0, 1, 1, 1])
    for options, says in [({"start": np.eye(3)}, r"start: must have the shape \(4, 4\), has \(3, 3\)"), ({"start": mirrored}, "start"),
                          ({"start": np.full((4, 4), np.nan)}, "finite"), ({"levels": 99}, r"levels = 99: must be in \[1, 8\]"),
                          ({"levels": "two"}, "option levels = 'two': has the wrong type"), ({"method": "simplex"}, "simplex"),
                          ({"search": "far"}, "far"), ({"sigma_px": -1.0}, "sigma"), ({"backend": "cuda"}, "cuda"),
                          ({"time_limit_s": 0}, "time"), ({"refine_views": (99.0, 10.0)}, "99")]:
        with pytest.raises(raylign.Error, match=says):
            register(**options)
    with pytest.raises(TypeError):
        register(no_such_option=1)
    with pytest.raises(TypeError, match="backend: must be a name or a raylign.Backend, is a int"):
        register(backend=3)


def test_sessions_check_poses_and_views(spine):
    session = raylign.Session(spine.volume, spine.views, "cpu")
    with pytest.raises(raylign.Error, match=r"poses: must have the shape \(4, 4\) or \(N, 4, 4\), has \(2, 3, 4\)"):
        session.evaluate(np.zeros((2, 3, 4)))
    with pytest.raises(raylign.Error, match=r"poses\[1\]"):
        session.evaluate(np.stack([spine.truth, np.full((4, 4), np.inf)]))
    with pytest.raises(IndexError, match="view = 2: there are 2"):
        session.render(spine.truth, 2)
    with pytest.raises(raylign.Error):
        session.set_weights([np.ones((96, 96))])
