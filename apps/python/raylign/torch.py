"""The cost as a differentiable function of PyTorch, for those who train."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from . import move


class _Cost(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, twists: Any, poses: np.ndarray, session: Any) -> Any:
        at = move(poses, twists.detach().cpu().double().numpy(), session.centre)
        costs, gradients, _ = session.linearize(at)
        ctx.save_for_backward(torch.as_tensor(gradients, dtype=twists.dtype, device=twists.device))
        return torch.as_tensor(costs, dtype=twists.dtype, device=twists.device)

    @staticmethod
    def backward(ctx: Any, upstream: Any) -> Any:
        (gradients,) = ctx.saved_tensors
        return upstream[:, None] * gradients, None, None


def cost(twists: Any, poses: Any, session: Any) -> Any:
    """Costs (N,) at poses (N, 4, 4) moved by twists (N, 6; rad, mm in world about the volume's middle). The gradient is
    Session.linearize's, which is exact at twists of zero: after each step move the poses (raylign.move) and begin at zero again, as
    optimizers on SE(3) do."""
    return _Cost.apply(twists, np.asarray(poses, dtype=float).reshape(-1, 4, 4), session)
