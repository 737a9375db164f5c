"""The final pose minus the goal, by pose source, from a recording."""

from __future__ import annotations

import math
from typing import Dict

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, wrap_angle
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trial_definition import FinalErrors
from diff_encoder_sim.drives.trial_recording import TrialRecording


def poses_in_map(recording: TrialRecording) -> Dict[PoseSource, PoseSeries]:
    """Return the pose series in the map frame; odometry starts at the surveyed start pose of the test."""
    poses = {source: recording.poses[topic] for source, topic in TOPIC_OF_SOURCE.items() if topic in recording.poses}
    if PoseSource.ODOM in poses:
        poses[PoseSource.ODOM] = composed(recording.trial.test.start.pose(), poses[PoseSource.ODOM])
    return poses


def goal_errors(recording: TrialRecording) -> FinalErrors:
    """Return the last pose of each source minus the goal, as campaigns write it to trials.csv."""
    errors: FinalErrors = dict.fromkeys(PoseSource)
    goal = recording.trial.goal()
    for source, series in poses_in_map(recording).items():
        x_m, y_m, yaw_rad = series.x_y_yaw[-1].tolist()
        errors[source] = Pose2D(x_m - goal.x_m, y_m - goal.y_m, wrap_angle(yaw_rad - goal.yaw_rad))
    return errors


def composed(frame: Pose2D, series: PoseSeries) -> PoseSeries:
    """Transform poses from a frame into its parent, given the frame's pose; yaw in [-pi, pi)."""
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
