"""Volumes of other packages, known by what they offer and not by their type: none of them needs to be installed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._native import Error, Volume

_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])


def _from_affine(array: NDArray[Any], affine: Any) -> Volume:
    """array[x, y, z] and RAS affine, as nibabel and TorchIO have them. The columns must be at right angles: LPS, mm."""
    matrix = np.asarray(affine, dtype=float)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise Error(f"affine: must be a finite 4 x 4 matrix, has the shape {matrix.shape}")
    axes = _LPS_FROM_RAS @ matrix[:3, :3]
    spacing = np.linalg.norm(axes, axis=0)
    if not (spacing > 0).all():
        raise Error("affine: an axis has no length")
    while array.ndim > 3 and array.shape[-1] == 1:  # one point in time
        array = array[..., 0]
    if array.ndim != 3:
        raise Error(f"image: must have three axes, has the shape {array.shape}")
    return Volume(np.transpose(array, (2, 1, 0)), spacing, _LPS_FROM_RAS @ matrix[:3, 3], axes / spacing)


def _nibabel_array(image: Any) -> NDArray[Any]:
    """What is in memory as it is; what is in a file, scaled, as floats, and not kept in the image."""
    stored = getattr(image, "dataobj", None)
    return stored if isinstance(stored, np.ndarray) else np.asarray(image.get_fdata(dtype=np.float32, caching="unchanged"))


def _from_itk(image: Any) -> Volume:
    """SimpleITK and ITK: LPS, mm; the array has slices first, and is theirs, not a copy."""
    axes = image.GetDimension() if hasattr(image, "GetDimension") else image.GetImageDimension()
    if axes != 3:
        raise Error(f"image: must have three axes, has {axes}")
    if hasattr(image, "GetDirection") and not hasattr(image.GetDirection(), "GetVnlMatrix"):
        import SimpleITK

        array, direction = SimpleITK.GetArrayViewFromImage(image), np.reshape(image.GetDirection(), (3, 3))
    else:
        import itk

        array, direction = itk.GetArrayViewFromImage(image), itk.GetArrayFromMatrix(image.GetDirection())
    return Volume(array, tuple(image.GetSpacing()), tuple(image.GetOrigin()), direction)


def _from_datasets(datasets: list[Any]) -> Volume:
    """Slices as pydicom reads them, in any order: at right angles to their axes and evenly spaced."""
    across = np.array(datasets[0].ImageOrientationPatient, dtype=float).reshape(2, 3)
    normal = np.cross(across[0], across[1])
    slices = sorted(datasets, key=lambda one: float(np.dot(normal, np.array(one.ImagePositionPatient, dtype=float))))
    places = np.array([one.ImagePositionPatient for one in slices], dtype=float)
    if any(not np.allclose(np.array(one.ImageOrientationPatient, dtype=float), across.ravel(), atol=1e-4) for one in slices):
        raise Error("datasets: the slices do not have one orientation")
    steps = np.diff(places, axis=0)
    gaps = steps @ normal
    if len(slices) < 2 or not gaps.mean() > 0 or np.ptp(gaps) > 0.01 * gaps.mean() or np.abs(steps - np.outer(gaps, normal)).max() > 0.01:
        raise Error("datasets: must be two slices or more, evenly spaced along their normal, each once")
    shapes = {one.pixel_array.shape for one in slices}
    if len(shapes) > 1 or len(min(shapes)) != 2:
        raise Error(f"datasets: the slices must have one shape (rows, columns), have {sorted(shapes)}")
    hu = np.empty((len(slices), *shapes.pop()), np.float32)
    for into, one in zip(hu, slices):
        into[:] = one.pixel_array * float(getattr(one, "RescaleSlope", 1)) + float(getattr(one, "RescaleIntercept", 0))
    rows_mm, columns_mm = (float(side) for side in slices[0].PixelSpacing)
    return Volume(hu, (columns_mm, rows_mm, float(gaps.mean())), places[0], np.column_stack([across[0], across[1], normal]))


def volume_from_image(image: Any) -> Volume:
    """A Volume of an image in HU: of SimpleITK or ITK, of nibabel (RAS), of TorchIO (RAS, one channel), of a list of pydicom's
    slices, or of anything with array [slice, row, column], spacing, origin and direction (LPS, mm). Nothing is resampled: a sheared
    affine is an Error."""
    if isinstance(image, (list, tuple)) and image and all(hasattr(one, "ImagePositionPatient") for one in image):
        return _from_datasets(list(image))
    if hasattr(image, "GetSpacing"):
        return _from_itk(image)
    if hasattr(image, "affine") and hasattr(image, "spatial_shape"):  # TorchIO: (channel, x, y, z)
        channels = np.asarray(image.numpy())
        if len(channels) != 1:
            raise Error(f"image: must have one channel, has {len(channels)}")
        return _from_affine(channels[0], image.affine)
    if hasattr(image, "affine") and hasattr(image, "get_fdata"):
        return _from_affine(_nibabel_array(image), image.affine)
    if all(hasattr(image, name) for name in ("array", "spacing", "origin", "direction")):
        return Volume(image.array, image.spacing, image.origin, np.reshape(image.direction, (3, 3)))
    raise TypeError(f"volume: a {type(image).__name__} is no raylign.Volume, path, or image of SimpleITK, ITK, nibabel, TorchIO or "
                    "pydicom; an array becomes one by raylign.Volume(array, spacing, origin, direction)")
