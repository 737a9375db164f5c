"""Trajectories of constant velocity."""

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.dwa_kernels import roll_out, rollout_params, step_count


def rolled_out(params, pose, linear_mps, angular_radps):
    """Return the points (n, 5) of a DWA's trajectory."""
    rollout, twist = rollout_params(params), (linear_mps, angular_radps)
    steps = step_count(rollout, *twist)
    points = np.empty((steps, 5))
    roll_out(rollout, Pose2D(*map(float, pose)), twist, twist, steps, points)
    return points
