"""How a laser is mounted: where, which way up, how far off level."""

from __future__ import annotations

import math
from typing import NamedTuple

from geometry_msgs.msg import TransformStamped

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_from_transform


class LaserMount(NamedTuple):
    """A laser on the robot, seen from above."""

    laser_pose_in_base: Pose2D
    is_upside_down: bool
    lean_rad: float  # of the scanned plane, from level

    def level(self, scan: Scan) -> Scan:
        """The same rays counter-clockwise as seen from above."""
        if not self.is_upside_down:
            return scan
        return scan._replace(angle_min_rad=-scan.angle_min_rad, angle_increment_rad=-scan.angle_increment_rad)


def laser_mount(transform: TransformStamped) -> LaserMount:
    """From the laser's transform in the base frame.

    Raises:
        InputFault: it is no pose.
    """
    pose = pose_from_transform(transform)
    rotation = transform.transform.rotation
    aside = rotation.x**2 + rotation.y**2
    upright = rotation.z**2 + rotation.w**2
    # Of the laser's z axis, the part along the base's.
    up = (upright - aside) / (upright + aside)
    return LaserMount(pose, up < 0.0, math.acos(min(abs(up), 1.0)))
