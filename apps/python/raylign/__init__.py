"""raylign: 2-D/3-D rigid registration of CT volumes to X-ray images.

    import raylign
    result = raylign.register("ct.nii.gz", "views.json")
    print(result)

A pose is world_from_ct, a 4 x 4 matrix that maps points of the CT (LPS, mm) to the world in which the cameras stand (mm). Arrays of
volumes are indexed [slice, row, column], images [row, column]; images are line integrals, denser = larger. Docstrings name units.
Errors are raylign.Error (a ValueError: bad input) and raylign.Unavailable (a RuntimeError: a backend that cannot run here), with the
words of the program `raylign`. Ctrl-C during a run raises raylign.Interrupted, a KeyboardInterrupt whose .result is the best until then.
"""

from __future__ import annotations

import os
from typing import Any, Callable, Iterable, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._images import volume_from_image
from ._native import (
    Backend,
    Error,
    Interrupted,
    Result,
    TrackFrame,
    Unavailable,
    View,
    Volume,
    __version__,
    backends,
    default_start,
    default_targets,
    move,
    perturbed_start,
    phantom_volume,
    phantom_xray,
    read_pose,
    target_errors,
    write_pose,
    write_volume,
)
from ._tracking import Tracker, track
from ._tracking import as_backend as _as_backend
from ._tracking import as_start as _as_start

PathLike = Union[str, "os.PathLike[str]"]
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

__all__ = [
    "Backend", "Error", "Interrupted", "Result", "Session", "TrackFrame", "Tracker", "Unavailable", "View", "Volume", "__version__",
    "backends", "default_start", "default_targets", "drr", "line_integral", "move", "perturbed_start", "phantom_volume", "phantom_xray",
    "read_pose", "read_views", "read_volume", "register", "target_errors", "track", "write_pose", "write_volume",
]


def read_volume(path: PathLike, **options: Any) -> Volume:
    """A CT from NIfTI, MHA/MHD, NRRD, TIFF or a folder of DICOM, as attenuation in 1/mm.

    options: labels (a label map's path) with label_names or label_numbers, bone_threshold_hu, series, hu_preset, is_attenuation
    (voxels are 1/mm already), hu_offset; see `raylign register --help`. What was decided on reading is in `volume.notes`.
    """
    volume, notes = _native.read_volume(os.fspath(path), **options)
    volume.notes = notes
    return volume


def read_views(paths: Union[PathLike, Sequence[PathLike]], *, needs_images: bool = True, auto_mask: bool = False,
               notes: Optional[list[str]] = None) -> list[View]:
    """Views from views.json or geometry files (FILE or FILE=IMAGE; a DICOM X-ray is its own image): one path or several. notes: a list
    to which is added what was decided on reading."""
    several = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    views, decided = _native.read_views([os.fspath(path) for path in several], needs_images, auto_mask)
    if notes is not None:
        notes.extend(decided)
    return views


def line_integral(pixels: ArrayLike, *, kind: str = "auto", polarity: str = "auto", i0: Optional[float] = None,
                  auto_mask: bool = False) -> tuple[Floats, Optional[Floats], list[str]]:
    """A detector's pixels as line integrals: (image, weights or None, what was decided).

    kind: "auto" (integers are transmission, floats line integrals), "line-integral" or "transmission" (-log(I / I0)); polarity:
    "auto", "bone-bright" or "bone-dark"; i0: the open beam's pixel value; auto_mask: leave out collimator, letters, saturation.
    """
    return _native.line_integral(pixels, kind=kind, polarity=polarity, i0=i0, auto_mask=auto_mask)


def as_volume(volume: Any) -> Volume:
    """A Volume, a path, or an image in HU of SimpleITK, ITK, nibabel, TorchIO, or with array, spacing, origin and direction."""
    if isinstance(volume, Volume):
        return volume
    if isinstance(volume, (str, os.PathLike)):
        return read_volume(volume)
    return volume_from_image(volume)


def as_views(views: Any, *, needs_images: bool = True) -> list[View]:
    """A list of View, one View, or paths as read_views takes them."""
    if isinstance(views, View):
        return [views]
    if isinstance(views, (str, os.PathLike)):
        return read_views(views, needs_images=needs_images)
    if not isinstance(views, Iterable):
        raise TypeError(f"views: must be raylign.View or paths, is a {type(views).__name__}")
    several = list(views)
    if several and all(isinstance(view, (str, os.PathLike)) for view in several):
        return read_views(several, needs_images=needs_images)
    for view in several:
        if not isinstance(view, View):
            raise TypeError(f"views: must be raylign.View or paths, one is a {type(view).__name__}")
    return several


def register(volume: Any, views: Any, start: Optional[Any] = None, method: str = "auto", backend: Union[str, Backend] = "auto", *,
             metric: str = "gc", sigma_px: Optional[float] = None, levels: Optional[int] = None, content: str = "auto",
             search: str = "auto", range_mm: Optional[float] = None, range_deg: Optional[float] = None, starts: Optional[int] = None,
             seed: int = 1, robust: bool = True, look_around: bool = True, suspect_mirrored: bool = True, compare_views: bool = True,
             refine_views: Union[bool, tuple[float, float]] = False, time_limit_s: Optional[float] = None,
             max_iterations: Optional[int] = None, projector: Optional[str] = None, step_mm: Optional[float] = None,
             rotation_centre: Optional[Sequence[float]] = None,
             on_progress: Optional[Callable[[float, float, float], None]] = None) -> Result:
    """Finds world_from_ct at which the volume's DRRs match the views' images.

    volume: as as_volume takes it. views: as as_views does; each with an image. start: 4 x 4 world_from_ct or a pose's file; None: the
    CT's centre where the views look. method: "auto", "gauss-newton", "steepest-descent", "bobyqa". backend: "auto", "cpu", "gl", ...
    or a Backend. content: "whole" or "part" of what the X-ray shows. search: "near" (range_mm, range_deg, starts) or "global" where
    the start is rough. refine_views: True, or the prior (degrees, mm) of the cameras' errors, to correct these, too. on_progress:
    called with (fraction, seconds left, cost) after each step.

    The result's `ok` is the verdict; `reasons` say why not. The interpreter's lock is released while it works.
    """
    ct, xrays = as_volume(volume), as_views(views)
    if not xrays:
        raise Error("views: at least one is needed")
    options = dict(method=method, metric=metric, sigma_px=sigma_px, levels=levels, content=content, search=search, range_mm=range_mm,
                   range_deg=range_deg, starts=starts, seed=seed, robust=robust, look_around=look_around,
                   suspect_mirrored=suspect_mirrored, compare_views=compare_views, refine_views=refine_views,
                   time_limit_s=time_limit_s, max_iterations=max_iterations, projector=projector, step_mm=step_mm,
                   rotation_centre=rotation_centre)
    return _native.register(ct, xrays, _as_start(start, ct, xrays), _as_backend(backend), options, on_progress)


class Session:
    """A volume and views made resident on a backend: the building blocks for an optimizer of one's own.

    Poses are (N, 4, 4) or (4, 4). Several threads may share a session: they take turns. It keeps what it needs alive; volume and views
    may go.
    """

    def __init__(self, volume: Any, views: Any, backend: Union[str, Backend] = "auto", *, metric: str = "gc",
                 sigma_px: Optional[float] = None, projector: Optional[str] = None, step_mm: Optional[float] = None):
        options = dict(metric=metric, sigma_px=sigma_px, projector=projector, step_mm=step_mm)
        ct = as_volume(volume)
        self._session = _native.Session(ct, as_views(views, needs_images=False), _as_backend(backend), options)
        self.centre: Doubles = ct.centre  #: of the volume's grid: what linearize and move turn about by default

    def evaluate(self, poses: Any) -> Doubles:
        """Costs (N,) in [0, 2]; a batch costs less than its parts. Every view needs an image."""
        return self._session.evaluate(poses)

    def linearize(self, poses: Any, centre_ct_mm: Optional[ArrayLike] = None) -> tuple[Doubles, Doubles, Doubles]:
        """Costs (N,), gradients (N, 6) and Gauss-Newton matrices (N, 6, 6) with respect to a twist (rad, mm) in world about the point
        centre_ct_mm of the volume (default: centre); raylign.move goes along it."""
        return self._session.linearize(poses, self.centre if centre_ct_mm is None else centre_ct_mm)

    def render(self, pose: Any, view: int = 0) -> Floats:
        """The DRR of one view at one pose, (rows, columns) float32: line integrals."""
        return self._session.render(pose, view)

    def drr_gradient(self, poses: Any, upstream: Any, centre_ct_mm: Optional[ArrayLike] = None) -> Doubles:
        """Vector-Jacobian products of the DRRs, (N, 6): the sum over views and pixels of upstream times the derivative of the DRR with
        respect to a twist (rad, mm), as linearize has it. upstream: (N, V, rows, columns), or lists [pose][view] of (rows, columns);
        finite. Views need no images; masks and weights do not matter. For chains of derivatives of one's own."""
        return self._session.drr_gradient(poses, upstream, self.centre if centre_ct_mm is None else centre_ct_mm)

    def set_weights(self, weights: Sequence[Any]) -> None:
        """One image of weights per view, finite and not negative, until the next call; pixels that masks exclude stay excluded."""
        self._session.set_weights(weights)

    def with_views(self, views: Any, *, metric: str = "gc", sigma_px: Optional[float] = None) -> "Session":
        """A session of other views on the same resident volume: for the next frame."""
        other = object.__new__(Session)
        other._session = self._session.with_views(as_views(views, needs_images=False), dict(metric=metric, sigma_px=sigma_px))
        other.centre = self.centre
        return other

    @property
    def view_count(self) -> int:
        """V, the number of views."""
        return self._session.view_count

    @property
    def volume_bytes(self) -> int:
        """What the backend's own copy of the volume takes."""
        return self._session.volume_bytes

    @property
    def evaluations(self) -> int:
        """Poses evaluated so far."""
        return self._session.evaluations

    @property
    def backend(self) -> Backend:
        """What it works on; sessions that share one take turns."""
        return self._session.backend


def drr(volume: Any, views: Any, poses: Any, backend: Union[str, Backend] = "auto", *, projector: Optional[str] = None,
        step_mm: Optional[float] = None) -> Floats:
    """Simulated X-rays (line integrals): (N, V, H, W) float32 for poses (N, 4, 4) and V views of one size."""
    several = as_views(views, needs_images=False)
    sizes = {tuple(int(side) for side in view.size_px) for view in several}
    if len(sizes) > 1:
        raise Error(f"views: must have one size for an array of DRRs, have {sorted(sizes)}; render them one by one by a Session")
    session = Session(volume, several, backend, projector=projector, step_mm=step_mm)
    at = np.asarray(poses, dtype=float)
    at = at[None] if at.ndim == 2 else at
    width, height = sizes.pop()
    images = np.empty((len(at), len(several), height, width), np.float32)
    for i, pose in enumerate(at):
        for view in range(len(several)):
            images[i, view] = session.render(pose, view)
    return images


def _plot(self: Result, figure: Any = None) -> Any:
    """The DRR's edges over each X-ray, and the cost of each step, by matplotlib; returns the figure."""
    from .plots import plot

    return plot(self, figure)


def _html(self: Result) -> str:
    from .plots import html

    return html(self)


# The module in C++ gets what is easier said in Python; its stub declares these, too.
for _owner, _name, _function in ((Result, "plot", _plot), (Result, "_repr_html_", _html), (Volume, "read", staticmethod(read_volume)),
                                 (Volume, "from_image", staticmethod(volume_from_image))):
    setattr(_owner, _name, _function)
