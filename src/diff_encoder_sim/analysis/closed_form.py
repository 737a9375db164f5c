"""The odometry's error at the goal: what quantisation alone explains (closed form), and what was measured."""

from __future__ import annotations

import math
from typing import Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import RobotGeometry, TrialData
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.odometry.odometry_covariance import quantisation_covariance
from diff_encoder_sim.trials.trial_definition import Trial


def closed_form_std(requested: Trial, robot: RobotGeometry, ppr: float) -> np.ndarray:
    """(3,) standard deviations at the goal due to quantisation alone, along the map's axes: [m], [m], [rad]."""
    start, m_per_pulse = requested.test.start.pose(), math.pi * robot.wheel_diameter_m / ppr
    covariance = quantisation_covariance(
        requested.goal().relative_to(start), m_per_pulse, m_per_pulse, robot.wheel_separation_m
    )
    turn = np.eye(3)
    turn[:2, :2] = _rotation(start)
    return np.sqrt(np.diag(turn @ covariance @ turn.T))


def odometry_minus_truth(trials: Sequence[TrialData], quantity: Quantity) -> np.ndarray:
    """(n,) final odometry minus true pose of the trials that have both, in the quantity's unit."""
    return quantity.scale * np.array(
        [trial.odometry_minus_truth[quantity.component] for trial in trials if trial.odometry_minus_truth is not None]
    )


def _rotation(pose: Pose2D) -> np.ndarray:
    cos_yaw, sin_yaw = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return np.array([[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]])
