"""The sources of the robot's pose that a trial compares with its goal."""

from __future__ import annotations

import enum


class PoseSource(enum.Enum):
    """A source of poses, in the order of trials.csv; the value is the prefix of its columns there."""

    ODOM = 'odom'  # wheel odometry alone, from the start pose on
    AMCL = 'amcl'  # the last localization update
    GLOBAL = 'global'  # the pose estimate: localization's map -> odom, and odometry since
    WORLD = 'world'  # ground truth

    # Members are compared by identity; Enum's own is a call in Python for each of millions of look-ups.
    __hash__ = object.__hash__
