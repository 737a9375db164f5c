"""How a laser is mounted: its pose, which side is up, and its tilt."""

from __future__ import annotations

import math
from typing import NamedTuple

from geometry_msgs.msg import TransformStamped

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_from_transform


class ScannerMount(NamedTuple):
    """A laser on the robot, projected to the floor."""

    laser_pose_in_base: Pose2D
    is_upside_down: bool
    lean_rad: float  # angle between the scanned plane and the floor

    def level(self, scan: Scan) -> Scan:
        """Return a scan with its rays counter-clockwise as seen from above."""
        if not self.is_upside_down:
            return scan
        return scan._replace(angle_min_rad=-scan.angle_min_rad, angle_increment_rad=-scan.angle_increment_rad)


def scanner_mount(transform: TransformStamped) -> ScannerMount:
    """Compute the mounting from the transform of the laser's frame to the base's.

    Raises:
        InputFault: the transform is no valid pose.
    """
    pose = pose_from_transform(transform)
    rotation = transform.transform.rotation
    aside = rotation.x**2 + rotation.y**2
    upright = rotation.z**2 + rotation.w**2
    # Component of the laser's z axis along the base's.
    up = (upright - aside) / (upright + aside)
    return ScannerMount(pose, up < 0.0, math.acos(min(abs(up), 1.0)))
