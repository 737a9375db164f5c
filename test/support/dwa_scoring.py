"""Scores of all samples of a DWA cycle, where the planner stops at those that cannot win."""

from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.navigation import dwa_kernels
from diff_encoder_sim.navigation.dwa_kernels import begin_waves


class Scored(NamedTuple):
    """All samples of one cycle and their costs."""

    samples: np.ndarray  # (n, 2) linear [m/s], angular [rad/s]
    scores: np.ndarray  # (n, 7) by critic, see critics.py; incomplete where rejected
    totals: np.ndarray  # (n,) weighted sums, below zero where rejected
    best: int  # index of the cheapest, the first of equals; -1 for none


def score_all(planner, base_pose, linear_mps, angular_radps, costmap, plan):
    """Score each sample of `planner.find_best` on its own; None if the plan is off the costmap."""
    task = planner.scoring_task(base_pose, linear_mps, angular_radps, costmap, plan)
    scene, pose = task.scene, task.pose_in_grid
    if not begin_waves(scene.costs, scene.per_m, costmap.origin, plan, pose, scene.nose_m, scene.waves):
        return None
    samples, _, _, scores, totals = dwa_kernels.score_all(task)
    accepted = np.flatnonzero(totals >= 0.0)
    best = int(accepted[np.argmin(totals[accepted])]) if len(accepted) else -1
    return Scored(samples, scores, totals, best)


def scored(planner, costmap, plan, twist=(0.3, 0.0), pose=IDENTITY):
    """Score all samples of a robot at the origin."""
    return score_all(planner, pose, *twist, costmap, plan)
