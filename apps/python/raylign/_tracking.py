"""Following one object through frames."""

from __future__ import annotations

import os
from numbers import Integral
from typing import Any, Iterable, Iterator, Optional, Sequence, Union

from numpy.typing import ArrayLike

from . import _native
from ._native import Backend, TrackFrame


def as_backend(backend: Union[str, Backend]) -> Backend:
    if isinstance(backend, Backend):
        return backend
    if not isinstance(backend, str):
        raise TypeError(f"backend: must be a name or a raylign.Backend, is a {type(backend).__name__}")
    return Backend(backend)


def as_start(start: Optional[Any], volume: Any, views: Sequence[Any]) -> ArrayLike:
    if start is None:
        return _native.default_start(volume, list(views))
    if isinstance(start, (str, os.PathLike)):
        return _native.read_pose(os.fspath(start))
    pose: ArrayLike = start
    return pose


class Tracker(_native.Tracker):
    """Follows an object: feed(frame, views) the frames in order, skip(frame, reason) those without images.

    options are those of raylign.register for the first frame; recovery: the widest search that may bring a lost frame back ("none",
    "near", "global"); max_jump_mm: the largest believable distance from the prediction.
    """

    def __init__(self, volume: Any, start: Any, backend: Union[str, Backend] = "auto", *, recovery: str = "auto",
                 max_jump_mm: Optional[float] = None, frame_step: float = 1, **options: Any):
        super().__init__(volume, start, as_backend(backend), options, recovery, max_jump_mm, frame_step)


def track(volume: Any, frames: Iterable[Any], start: Optional[Any] = None, backend: Union[str, Backend] = "auto",
          **options: Any) -> Iterator[TrackFrame]:
    """Yields a TrackFrame for each frame as soon as it is found.

    frames: any iterable (a generator will do) of lists of View, of (number, list of View), or of None where images are missing;
    without numbers they count from 0. start: as raylign.register takes it; None: where the first frame's views look. options: as
    Tracker takes them.
    """
    from . import as_views, as_volume

    ct = as_volume(volume)
    tracker: Optional[Tracker] = None
    waiting: list[int] = []
    for count, item in enumerate(frames):
        numbered = isinstance(item, tuple) and len(item) == 2 and isinstance(item[0], Integral)
        number, views = (int(item[0]), item[1]) if numbered else (count, item)
        if views is None and tracker is None and start is None:
            waiting.append(number)  # told when the first views say where to begin
            continue
        xrays = None if views is None else as_views(views)
        if tracker is None:
            tracker = Tracker(ct, as_start(start, ct, xrays or []), backend, **options)
            for missing in waiting:
                yield tracker.skip(missing, "no images")
        yield tracker.skip(number, "no images") if xrays is None else tracker.feed(number, xrays)
