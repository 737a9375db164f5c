"""Messages as genpy's objects, field by field: what the encoded ones must be equal to."""

import numpy as np
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, LaserScan

from diff_encoder_sim.drives.wire import UNKNOWN_VARIANCE
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.ros.conversions import PLANAR_AXES, pose_message, stamp_from_ns


def joint_state_message(joints):
    """Convert wheel angles and speeds; efforts are left out."""
    message = JointState(name=list(joints.names), position=list(joints.angles_rad), velocity=list(joints.speeds_radps))
    message.header.stamp = stamp_from_ns(joints.stamp_ns)
    return message


def scan_message(scan, frame, period_s):
    """Convert a scan whose rays were all taken at its stamp; `period_s` is the time between scans."""
    count = len(scan.ranges_m)
    message = LaserScan(
        angle_min=scan.angle_min_rad,
        angle_max=scan.angle_min_rad + (count - 1) * scan.angle_increment_rad,
        angle_increment=scan.angle_increment_rad,
        time_increment=0.0,
        scan_time=period_s,
        range_min=scan.range_min_m,
        range_max=scan.range_max_m,
        ranges=scan.ranges_m.tolist(),
    )
    message.header.stamp = stamp_from_ns(scan.stamp_ns)
    message.header.frame_id = frame
    return message


def encoder_pulse_message(sample, joints):
    """Convert both counters, left then right; `joints` are their names in that order."""
    message = EncoderPulse(name=list(joints), pulses=[sample.left_pulses, sample.right_pulses])
    message.header.stamp = stamp_from_ns(sample.stamp_ns)
    return message


def odometry_message(estimate, odom_frame, base_frame):
    """Convert a pose in the odom frame and a twist in the base frame, each with its covariance."""
    message = Odometry(child_frame_id=base_frame)
    message.header.stamp = stamp_from_ns(estimate.stamp_ns)
    message.header.frame_id = odom_frame
    message.pose.pose = pose_message(estimate.base_pose_in_odom)
    message.pose.covariance = _planar_covariance(estimate.pose_covariance, PLANAR_AXES)
    message.twist.twist = Twist(
        Vector3(estimate.linear_velocity_mps, estimate.lateral_velocity_mps, 0),
        Vector3(0, 0, estimate.angular_velocity_radps),
    )
    message.twist.covariance = _planar_covariance(estimate.twist_covariance, (0, 5))
    return message


def _planar_covariance(covariance, axes):
    """Return a 6x6 covariance, row by row, known only in `axes` of (x, y, z, roll, pitch, yaw)."""
    full = np.diag(np.full(6, UNKNOWN_VARIANCE))
    full[np.ix_(list(axes), list(axes))] = covariance
    return list(full.ravel())
