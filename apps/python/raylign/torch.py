"""The cost and the DRRs as differentiable functions of PyTorch, for those who train."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from . import Error, move


def _moved(twists: Any, poses: NDArray[Any], session: Any) -> NDArray[Any]:
    if twists.shape != (len(poses), 6):
        raise Error(f"twists: must have the shape ({len(poses)}, 6) for {len(poses)} poses, has {tuple(twists.shape)}")
    return move(poses, twists.detach().cpu().double().numpy(), session.centre)


def _poses(poses: Any) -> NDArray[Any]:
    matrices = np.asarray(poses.detach().cpu() if isinstance(poses, torch.Tensor) else poses, dtype=float)
    return matrices[None] if matrices.ndim == 2 else matrices


class _Cost(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, twists: Any, poses: NDArray[Any], session: Any) -> Any:
        costs, gradients, _ = session.linearize(_moved(twists, poses, session))
        ctx.save_for_backward(torch.as_tensor(gradients, dtype=twists.dtype, device=twists.device))
        return torch.as_tensor(costs, dtype=twists.dtype, device=twists.device)

    @staticmethod
    def backward(ctx: Any, upstream: Any) -> Any:
        (gradients,) = ctx.saved_tensors
        return upstream[:, None] * gradients, None, None


class _Drr(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, twists: Any, poses: NDArray[Any], session: Any) -> Any:
        ctx.at, ctx.session = _moved(twists, poses, session), session
        images = [np.stack([session.render(pose, view) for view in range(session.view_count)]) for pose in ctx.at]
        return torch.as_tensor(np.stack(images), dtype=twists.dtype, device=twists.device)

    @staticmethod
    def backward(ctx: Any, upstream: Any) -> Any:
        gradients = ctx.session.drr_gradient(ctx.at, upstream.detach().cpu().numpy())
        return torch.as_tensor(gradients, dtype=upstream.dtype, device=upstream.device), None, None


def cost(twists: Any, poses: Any, session: Any) -> Any:
    """Costs (N,) at poses (N, 4, 4) moved by twists (N, 6; rad, mm in world about the volume's middle). The gradient is
    Session.linearize's, which is exact at twists of zero: after each step move the poses (raylign.move) and begin at zero again, as
    optimizers on SE(3) do."""
    return _Cost.apply(twists, _poses(poses), session)


def drr(twists: Any, poses: Any, session: Any) -> Any:
    """DRRs (N, V, rows, columns; line integrals) of the session's views, which need no images but one size, at poses (N, 4, 4) moved by
    twists (N, 6; rad, mm). The gradient is Session.drr_gradient's, from the derivative images that the backend makes; exact at twists of
    zero, as cost's."""
    return _Drr.apply(twists, _poses(poses), session)
