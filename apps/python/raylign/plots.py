"""Pictures of results, by matplotlib where it is installed."""

from __future__ import annotations

import base64
import html as escape
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

_EDGE_SHARE = 0.15  # of the steepest gradient: what counts as an edge


def _edges(image: Any) -> NDArray[Any]:
    """How steep the image is, in [0, 1], and nothing where it is flat."""
    down, right = np.gradient(np.asarray(image, dtype=float))
    steep = np.hypot(down, right)
    top = steep.max()
    return np.where(steep > _EDGE_SHARE * top, steep / top, np.nan) if top > 0 else np.full(steep.shape, np.nan)


def plot(result: Any, figure: Any = None) -> Any:
    """The DRR's edges at the pose, red over each X-ray, and the cost of each step of the finest level; returns the figure."""
    import matplotlib.pyplot as plt

    from . import Session

    views = list(result.views)
    figure = figure or plt.figure(figsize=(4 * (len(views) + 1), 4), layout="constrained")
    axes = figure.subplots(1, len(views) + 1, squeeze=False)[0]
    session = Session(result.volume, views, result.backend)
    for index, (view, ax) in enumerate(zip(views, axes)):
        ax.imshow(view.image, cmap="gray")
        ax.imshow(_edges(session.render(result.world_from_ct, index)), cmap="autumn_r", vmin=0, vmax=1)
        ax.set_title(f"{view.name}: cost {result.view_costs[index]:.3f}" if result.view_costs else view.name)
        ax.set_axis_off()
    for level in sorted({step["level"] for step in result.history}):
        steps = [step["cost"] for step in result.history if step["level"] == level]
        axes[-1].plot(steps, marker=".", label=f"level {level}")
    axes[-1].set(xlabel="step", ylabel="cost", title="ok" if result.ok else "doubtful")
    if result.history:
        axes[-1].legend()
    return figure


def html(result: Any) -> str:
    """What a notebook shows: the verdict, the numbers, and the pictures where matplotlib is installed."""
    text = f"<pre>{escape.escape(str(result))}</pre>"
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return text
    views = len(list(result.views))
    figure = plot(result, Figure(figsize=(4 * (views + 1), 4), layout="constrained"))
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=80)
    return f'{text}<img alt="edges of the DRR over the X-rays" src="data:image/png;base64,{base64.b64encode(picture.getvalue()).decode()}">'
