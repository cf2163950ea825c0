import subprocess
import sys
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
    torchio.numpy = lambda: np.zeros((2, 4, 3, 2))
    with pytest.raises(raylign.Error, match="must have one channel, has 2"):
        raylign.Volume.from_image(torchio)


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
    odd = slice_at(32, 1)
    odd.pixel_array = odd.pixel_array[:2]
    with pytest.raises(raylign.Error, match="the slices must have one shape"):
        raylign.Volume.from_image([slice_at(30, 0), odd])


def itk_image(array, direction, **methods):
    """What SimpleITK's images answer."""
    answers = dict(GetSpacing=lambda: (0.5, 1.0, 2.0), GetOrigin=lambda: (1.0, 2.0, 3.0), GetDirection=lambda: tuple(direction.ravel()),
                   GetDimension=lambda: 3, array=array)
    return types.SimpleNamespace(**{**answers, **methods})


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"])
def test_images_of_simpleitk_of_every_type_of_pixels(kind, monkeypatch):
    """By a stand-in for the package: what it must offer, and no more."""
    monkeypatch.setitem(sys.modules, "SimpleITK", types.SimpleNamespace(GetArrayViewFromImage=lambda image: image.array))
    direction = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    array = (HU / 10).astype(kind)
    array.flags.writeable = False
    volume = raylign.Volume.from_image(itk_image(array, direction))
    assert np.array_equal(volume.attenuation, raylign.Volume(array, (1, 1, 1)).attenuation)
    assert np.array_equal(volume.attenuation, raylign.Volume(array.astype(np.float32), (1, 1, 1)).attenuation)
    np.testing.assert_allclose(volume.spacing, (0.5, 1, 2))
    np.testing.assert_allclose(volume.origin, (1, 2, 3))
    np.testing.assert_allclose(volume.direction, direction)
    with pytest.raises(raylign.Error, match="must have three axes, has 2"):
        raylign.Volume.from_image(itk_image(array[0], np.eye(2), GetDimension=lambda: 2))
    with pytest.raises(raylign.Error, match=r"has \(2, 3, 4, 1\)"):
        raylign.Volume.from_image(itk_image(array[..., None], direction))


def test_images_of_itk_by_a_stand_in(monkeypatch):
    """ITK's own Python says GetImageDimension, and its direction is an itk.Matrix."""
    direction = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    matrix = types.SimpleNamespace(GetVnlMatrix=None, values=direction)
    monkeypatch.setitem(sys.modules, "itk", types.SimpleNamespace(GetArrayViewFromImage=lambda image: image.array,
                                                                  GetArrayFromMatrix=lambda matrix: matrix.values))
    image = itk_image(HU, direction, GetDirection=lambda: matrix, GetImageDimension=lambda: 3)
    del image.GetDimension
    volume = raylign.Volume.from_image(image)
    assert np.array_equal(volume.attenuation, raylign.Volume(HU, (1, 1, 1)).attenuation)
    np.testing.assert_allclose(volume.direction, direction)
    np.testing.assert_allclose(volume.origin, (1, 2, 3))


@pytest.mark.parametrize("pixels", ["sitkUInt8", "sitkInt8", "sitkUInt16", "sitkInt16", "sitkUInt32", "sitkInt32", "sitkUInt64", "sitkInt64",
                                    "sitkFloat32", "sitkFloat64"])
def test_simpleitk_itself(pixels):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.Cast(sitk.GetImageFromArray(HU / 10), getattr(sitk, pixels))
    image.SetSpacing((0.5, 1, 2))
    image.SetOrigin((1, 2, 3))
    image.SetDirection((0, -1, 0, 1, 0, 0, 0, 0, 1))
    volume = raylign.Volume.from_image(image)
    assert np.array_equal(volume.attenuation, raylign.Volume(sitk.GetArrayFromImage(image), (1, 1, 1)).attenuation)
    np.testing.assert_allclose(volume.direction, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(volume.origin, (1, 2, 3))


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


@pytest.mark.parametrize("kind", ["u1", "i2", "i4", "u2", "f4", "f8"])
def test_nibabel_of_every_type_from_memory_and_file(kind, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    array = (HU / 10).astype(kind)
    image = nibabel.Nifti1Image(array.transpose(2, 1, 0)[..., None], np.eye(4))  # one point in time
    expected = raylign.Volume(array, (1, 1, 1)).attenuation
    assert np.array_equal(raylign.Volume.from_image(image).attenuation, expected)
    nibabel.save(image, tmp_path / "ct.nii")
    stored = nibabel.load(tmp_path / "ct.nii")
    assert np.array_equal(raylign.Volume.from_image(stored).attenuation, expected)
    assert not stored.in_memory  # no copy stays in the image
    series = nibabel.Nifti1Image(np.zeros((4, 3, 2, 5), kind), np.eye(4))
    with pytest.raises(raylign.Error, match=r"must have three axes, has the shape \(4, 3, 2, 5\)"):
        raylign.Volume.from_image(series)


def test_pydicom_itself(tmp_path):
    """Slices written and read by pydicom land where raylign's reader puts the folder."""
    pydicom = pytest.importorskip("pydicom")
    from pydicom.dataset import FileDataset, FileMetaDataset

    series = pydicom.uid.generate_uid()
    for k, z_mm in enumerate((30.0, 32.5, 35.0, 37.5)):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = pydicom.uid.CTImageStorage
        meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
        meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        one = FileDataset(None, {}, file_meta=meta, preamble=bytes(128))
        one.is_little_endian, one.is_implicit_VR = True, False
        one.SOPClassUID, one.SOPInstanceUID, one.SeriesInstanceUID, one.Modality = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID, series, "CT"
        one.Rows, one.Columns, one.SamplesPerPixel, one.PhotometricInterpretation = 8, 10, 1, "MONOCHROME2"
        one.BitsAllocated, one.BitsStored, one.HighBit, one.PixelRepresentation = 16, 16, 15, 1
        one.PixelSpacing, one.SliceThickness = ["0.7", "0.9"], "2.5"
        one.ImageOrientationPatient, one.ImagePositionPatient = ["1", "0", "0", "0", "1", "0"], ["-4", "5", str(z_mm)]
        one.RescaleSlope, one.RescaleIntercept, one.InstanceNumber = "2", "-1024", k
        one.PixelData = (np.arange(80, dtype=np.int16).reshape(8, 10) * (k + 1)).tobytes()
        one.save_as(tmp_path / f"{9 - k}.dcm", write_like_original=False)
    by_slices = raylign.Volume.from_image([pydicom.dcmread(path) for path in sorted(tmp_path.glob("*.dcm"))])
    by_folder = raylign.read_volume(tmp_path)
    assert by_slices.shape == by_folder.shape == (4, 8, 10)
    for name in ("spacing", "origin", "direction"):
        np.testing.assert_allclose(getattr(by_slices, name), getattr(by_folder, name), atol=1e-6)
    np.testing.assert_allclose(by_slices.attenuation, by_folder.attenuation, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("kind", [np.int16, np.float32, np.float64])
def test_nothing_of_the_volumes_size_is_copied_on_the_way(kind):
    """The peak of the process rises by the Volume, which has floats, and by little more; what looks at it takes nothing."""
    script = f"""if True:
        import numpy as np, raylign
        def peak_mib():
            return int(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1]) / 1024
        array = np.zeros((128, 256, 256), np.{kind.__name__})
        array += 40
        raylign.Volume(array[:2], (1, 1, 1)).attenuation
        before = peak_mib()
        volume = raylign.Volume(array, (1, 1, 1))
        made = peak_mib()
        assert float(volume.attenuation[-1, -1, -1]) > 0
        print(made - before, peak_mib() - made)
    """
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rise_mib, looked_mib = map(float, done.stdout.split())
    assert 28 < rise_mib < 32 + 6 and looked_mib < 2, done.stdout  # 8 Mi voxels of four bytes


@pytest.mark.parametrize("make, says", [
    (lambda: raylign.Volume(HU[0], (1, 1, 1)), r"array: must have the shape \(slices, rows, columns\), has \(3, 4\)"),
    (lambda: raylign.Volume(np.zeros((0, 3, 3)), (1, 1, 1)), "array: must have the shape"),
    (lambda: raylign.Volume(HU.astype(complex), (1, 1, 1)), "array: must be an array of real numbers, has dtype complex128"),
    (lambda: raylign.Volume("ct.nii", (1, 1, 1)), "array: must be an array of real numbers"),
    (lambda: raylign.Volume(np.where(HU == 100, np.nan, HU), (1, 1, 1)), r"array\[0, 0, 2\] = nan: must be finite"),
    (lambda: raylign.Volume(HU, (1, 0, 1)), "spacing = 0.0+ mm: must be positive and finite"),
    (lambda: raylign.Volume(HU, (1, 1, 1), (0, np.inf, 0)), "origin: must be finite"),
    (lambda: raylign.Volume(HU, (1, 1, 1), direction=np.ones((3, 3))), "direction: its columns must be orthonormal"),
    (lambda: raylign.Volume(HU, (1, 1)), r"spacing: must have the shape \(3,\), has \(2,\)"),
    (lambda: raylign.Volume(HU, "1 mm"), "spacing: must be an array of real numbers, has dtype <U4"),
    (lambda: raylign.Volume(HU, (1, 1, 1), None), "origin: must be an array of real numbers, has dtype object"),
    (lambda: raylign.Volume(HU, (1, 1, 1), direction=np.eye(4)), r"direction: must have the shape \(3, 3\), has \(4, 4\)"),
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
