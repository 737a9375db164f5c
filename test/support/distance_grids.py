"""Distances over all free cells of a grid."""

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.navigation.dwa_kernels import TO_PLAN, begin_waves, make_waves, whole_grid


def distances_from(points_m, costs, per_m=1.0, layer=TO_PLAN, nose_m=0.0):
    """Return the cells (rows, columns) from a plan (n, 2) in the grid's own frame, None if it is not on that."""
    plan, waves = np.column_stack([points_m, np.zeros(len(points_m))]), make_waves(costs.shape)
    has_begun = begin_waves(costs, per_m, IDENTITY, plan, IDENTITY, nose_m, waves)
    return whole_grid(waves, layer, *costs.shape) if has_begun else None
