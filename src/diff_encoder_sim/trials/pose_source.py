"""The sources of the robot's pose that a trial compares with its goal."""

from __future__ import annotations

import enum
from typing import Dict, Optional

from diff_encoder_sim.base.se2 import Pose2D


class PoseSource(enum.Enum):
    """A source of poses, in the order of trials.csv; the value is the prefix of its columns there."""

    ODOM = 'odom'  # wheel odometry alone, from the start pose on
    AMCL = 'amcl'  # the last localization update
    GLOBAL = 'global'  # the pose estimate: localization's map -> odom, and odometry since
    WORLD = 'world'  # ground truth


# Final pose minus goal: x [m] and y [m] along the map's axes, yaw [rad] wrapped; None where the source had no pose.
FinalErrors = Dict[PoseSource, Optional[Pose2D]]
