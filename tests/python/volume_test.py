import types

import numpy as np
import pytest

import raylign

HU = np.arange(2 * 3 * 4, dtype=np.float32).reshape(2, 3, 4) * 50


def test_is_indexed_slice_row_column_and_placed_in_lps():
    volume = raylign.Volume(HU, (0.5, 1, 2), (10, 20, 30))
    assert volume.shape == (2, 3, 4)
    np.testing.assert_allclose(volume.centre, (10 + 1.5 * 0.5, 20 + 1, 30 + 0.5 * 2))
    air, water = raylign.Volume(np.array([[[-1000.0, 0.0]]]), (1, 1, 1)).attenuation[0, 0]
    assert air == 0 and 0.015 < water < 0.03  # 1/mm at 60 to 80 keV


def test_any_number_type_and_order_in_memory():
    expected = raylign.Volume(HU, (1, 1, 1)).attenuation
    read_only = HU.copy()
    read_only.flags.writeable = False
    wide = np.zeros((2, 3, 8), np.int16)
    wide[:, :, ::2] = HU
    for array in (np.asfortranarray(HU), HU.astype(np.int16), HU.astype(np.float64), read_only, wide[:, :, ::2], HU.tolist()):
        assert np.array_equal(raylign.Volume(array, (1, 1, 1)).attenuation, expected)


def test_attenuation_is_a_view_that_nobody_can_change():
    volume = raylign.Volume(HU, (1, 1, 1), unit="1/mm")
    array = volume.attenuation
    assert np.array_equal(array, HU) and not array.flags.owndata
    with pytest.raises(ValueError):
        array[0, 0, 0] = 1
    del volume
    assert array[1, 2, 3] == HU[1, 2, 3]  # the array keeps it alive


def test_images_of_other_packages_by_what_they_offer():
    direction = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    plain = types.SimpleNamespace(array=HU, spacing=(0.5, 1, 2), origin=(1, 2, 3), direction=direction.ravel())
    volume = raylign.Volume.from_image(plain)
    np.testing.assert_allclose(volume.direction, direction)
    affine = np.eye(4)
    affine[:3, :3] = np.diag([-1, -1, 1]) @ direction @ np.diag([0.5, 1, 2])
    affine[:3, 3] = -1, -2, 3
    torchio = types.SimpleNamespace(affine=affine, spatial_shape=(4, 3, 2), numpy=lambda: HU.transpose(2, 1, 0)[None])
    same = raylign.Volume.from_image(torchio)
    np.testing.assert_allclose(same.spacing, (0.5, 1, 2))
    np.testing.assert_allclose(same.origin, (1, 2, 3))
    np.testing.assert_allclose(same.direction, direction, atol=1e-15)
    assert np.array_equal(same.attenuation, volume.attenuation)


def test_slices_of_pydicom_in_any_order():
    def slice_at(z_mm, k):
        return types.SimpleNamespace(ImageOrientationPatient=["1", "0", "0", "0", "1", "0"], ImagePositionPatient=["5", "6", str(z_mm)],
                                     PixelSpacing=["2", "0.5"], RescaleSlope="1", RescaleIntercept="-1024",
                                     pixel_array=(HU[k] + 1024).astype(np.int16))

    volume = raylign.Volume.from_image([slice_at(32, 1), slice_at(30, 0)])
    np.testing.assert_allclose(volume.spacing, (0.5, 2, 2))
    np.testing.assert_allclose(volume.origin, (5, 6, 30))
    assert np.array_equal(volume.attenuation, raylign.Volume(HU, (1, 1, 1)).attenuation)
    with pytest.raises(raylign.Error, match="evenly spaced"):
        raylign.Volume.from_image([slice_at(30, 0), slice_at(30, 0)])


def test_nibabel_lands_where_the_file_reader_lands(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    affine = np.array([[0, -1.5, 0, 40], [0.5, 0, 0, -30], [0, 0, 2.5, 7], [0, 0, 0, 1]])
    image = nibabel.Nifti1Image(HU.transpose(2, 1, 0), affine)
    nibabel.save(image, tmp_path / "ct.nii.gz")
    by_file, by_image = raylign.read_volume(tmp_path / "ct.nii.gz"), raylign.Volume.from_image(image)
    world = [volume.direction @ (np.array([3, 2, 1]) * volume.spacing) + volume.origin for volume in (by_file, by_image)]
    if not np.allclose(by_file.direction, by_image.direction):
        pytest.fail("the file's reader turned the axes")
    np.testing.assert_allclose(*world, atol=1e-4)
    np.testing.assert_allclose(by_file.attenuation, by_image.attenuation, rtol=1e-6)


@pytest.mark.parametrize("make, says", [
    (lambda: raylign.Volume(HU[0], (1, 1, 1)), r"array: must have the shape \(slices, rows, columns\), has \(3, 4\)"),
    (lambda: raylign.Volume(np.zeros((0, 3, 3)), (1, 1, 1)), "array: must have the shape"),
    (lambda: raylign.Volume(HU.astype(complex), (1, 1, 1)), "array: must be an array of real numbers, has dtype complex128"),
    (lambda: raylign.Volume("ct.nii", (1, 1, 1)), "array: must be an array of real numbers"),
    (lambda: raylign.Volume(np.where(HU == 100, np.nan, HU), (1, 1, 1)), r"array\[0, 0, 2\] = nan: must be finite"),
    (lambda: raylign.Volume(HU, (1, 0, 1)), "spacing = 0.0+ mm: must be positive and finite"),
    (lambda: raylign.Volume(HU, (1, 1, 1), (0, np.inf, 0)), "origin: must be finite"),
    (lambda: raylign.Volume(HU, (1, 1, 1), direction=np.ones((3, 3))), "direction: its columns must be orthonormal"),
    (lambda: raylign.Volume(HU, (1, 1, 1), unit="mm"), "unit = mm: must be HU or 1/mm"),
    (lambda: raylign.Volume(HU, (1, 1, 1), hu_preset="nobody"), "nobody"),
    (lambda: raylign.read_volume("nowhere.nii"), "nowhere.nii"),
])
def test_bad_input_says_what_and_what_is_allowed(make, says):
    with pytest.raises(raylign.Error, match=says):
        make()


def test_something_else_is_a_type_error():
    with pytest.raises(TypeError, match="int is no raylign.Volume"):
        raylign.register(3, [])


def test_a_mirrored_direction_is_a_place_like_any_other():
    mirrored = raylign.Volume(HU, (1, 1, 1), (3, 0, 0), np.diag([-1.0, 1, 1]))
    np.testing.assert_allclose(mirrored.centre, raylign.Volume(HU[:, :, ::-1], (1, 1, 1)).centre)
