"""How far from its goal each source says that the robot ended."""

from __future__ import annotations

import math
from typing import Dict

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.trial_recording import PoseSeries, TrialRecording


def poses_in_map(recording: TrialRecording) -> Dict[str, PoseSeries]:
    """The pose series by topic; odometry begins at zero, where the robot was surveyed to stand."""
    start = recording.trial.test.start.pose()
    return {
        topic: composed(start, series) if topic == topics.ODOM else series for topic, series in recording.poses.items()
    }


def goal_errors(recording: TrialRecording) -> Dict[str, np.ndarray]:
    """The last pose of each topic minus the goal, as campaigns have it in trials.csv.

    (3,) x [m] and y [m] along the map's axes, yaw [rad] in [-pi, pi), by topic. Topics without a
    message are left out.
    """
    errors = {}
    for topic, series in poses_in_map(recording).items():
        error = series.x_y_yaw[-1] - np.array(recording.trial.goal())
        error[2] = wrap_angle(error[2])
        errors[topic] = error
    return errors


def composed(frame: Pose2D, series: PoseSeries) -> PoseSeries:
    """Poses that are given in a frame, in that frame's parent; yaw in [-pi, pi)."""
    cos_yaw, sin_yaw = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
    x_m, y_m, yaw_rad = series.x_y_yaw.T
    return PoseSeries(
        series.stamps_ns,
        np.column_stack(
            (
                frame.x_m + cos_yaw * x_m - sin_yaw * y_m,
                frame.y_m + sin_yaw * x_m + cos_yaw * y_m,
                wrap_angle(frame.yaw_rad + yaw_rad),
            )
        ),
    )
