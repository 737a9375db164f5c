"""From how many counts on quantisation alone is within the tolerance, in closed form."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.analysis.closed_form import STRAIGHT_WITHIN, closed_form_std
from diff_encoder_sim.analysis.dataset import RobotGeometry
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.drives.trial_definition import Trial

stats = deferred('scipy.stats')


def closed_form_counts(requested: Trial, robot: RobotGeometry, requirement: Requirement) -> float:
    """Return the counts per revolution from which on odometry at the goal is within the tolerance.

    Across a straight line of length S the error is the difference of two phases that are uniform in a pulse d, times
    S / L: the share within tol is 1 - (1 - c)^2 with c = tol L / (S d). What is not across a straight line is taken as
    normal, with `closed_form_std`, and the axis that needs the most counts decides.
    """
    per_count = closed_form_std(requested, robot, 1.0)
    return float(np.max(per_count * _reach(requested, requirement.share) / requirement.tolerances))


def local_counts(robot: RobotGeometry, requirement: Requirement) -> float:
    """Return the counts from which on the heading alone is within the tolerance, wherever the wheels stand.

    That is what localization, which corrects all else, leaves of an encoder's steps: (d / L) sqrt(1/3), as normal.
    """
    m_per_turn = math.pi * robot.wheel_diameter_m
    sd_of_one_count_rad = m_per_turn / robot.wheel_separation_m / math.sqrt(3.0)
    return sd_of_one_count_rad * _normal_reach(requirement.share) / requirement.yaw_rad


def _reach(requested: Trial, share: float) -> np.ndarray:
    """Return (3,) what the share of errors does not exceed, in standard deviations."""
    to_goal = requested.goal().relative_to(requested.test.start.pose())
    normal = _normal_reach(share)
    if max(abs(to_goal.y_m), abs(to_goal.yaw_rad)) > STRAIGHT_WITHIN or to_goal.x_m == 0.0:
        return np.full(3, normal)
    # A triangle from -w to w has the standard deviation w / sqrt(6).
    triangular = math.sqrt(6.0) * (1.0 - math.sqrt(1.0 - share))
    return np.array([triangular, triangular, normal])


def _normal_reach(share: float) -> float:
    return float(stats.norm.ppf(0.5 + 0.5 * share))
