#!/usr/bin/env python3
"""Publishes messages with stamps that cannot be on the stamped topics of a trial, among the nodes' own."""

import time

from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
from ros_testing import connected_publisher, impossible_stamps_ns, stamp_from_ns, start_test_node, wait_for_listeners
from sensor_msgs.msg import JointState, LaserScan
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.msg import EncoderPulse

JOINTS = ['left_wheel_joint', 'right_wheel_joint']

# By topic: what is published, and who has to hear it.
MESSAGES = {
    '/joint_states': (lambda: JointState(name=JOINTS, position=[1.0, 2.0]), ['/gz_diff_encoder_node']),
    '/encoder_pulse': (lambda: EncoderPulse(name=JOINTS, pulses=[10, 20]), ['/gz_diff_odom_node']),
    '/scan': (lambda: LaserScan(angle_increment=1.0, range_max=3.5, ranges=[1.0, 1.0]), ['/amcl', '/move_base']),
    '/odom': (Odometry, ['/move_base']),
    '/world_pose': (PoseStamped, ['/navigation_trial_node']),
    '/global_pose': (PoseStamped, ['/navigation_trial_node']),
    '/tf': (TransformStamped, ['/amcl', '/move_base', '/global_pose_node']),
}


def main():
    start_test_node('publish_impossible_stamps')
    for topic, (build, listeners) in MESSAGES.items():
        publisher = connected_publisher(topic, TFMessage if topic == '/tf' else build().__class__)
        wait_for_listeners(publisher, listeners)
        for stamp_ns in impossible_stamps_ns():
            message = build()
            message.header.stamp = stamp_from_ns(stamp_ns)
            message.header.frame_id = 'laser' if topic == '/scan' else 'odom'
            if topic == '/tf':
                message.child_frame_id, message.transform.rotation.w = 'base_link', 1.0
                message = TFMessage([message])
            publisher.publish(message)
    time.sleep(0.5)  # not by /clock, which ends with the trial


if __name__ == '__main__':
    main()
