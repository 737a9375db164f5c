#!/usr/bin/env python3
"""An odometry node that cannot be judged, in one of these ways: silent, dying, flooding, hung, string, frameless."""

import os
import signal
import sys

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from diff_encoder_sim.msg import EncoderPulse

MOST = 30  # messages before it fails


class Broken:
    def __init__(self, fault):
        self.fault, self.count = fault, 0
        self.odom = rospy.Publisher('/odom', String if fault == 'string' else Odometry, queue_size=1000)
        rospy.Subscriber('/encoder_pulse', EncoderPulse, self.on_pulses, queue_size=None)

    def on_pulses(self, message):
        self.count += 1
        if self.fault == 'silent' or (self.fault == 'stalling' and self.count > MOST):
            return
        if self.count > MOST and self.fault in ('dying', 'hung'):
            os.kill(os.getpid(), signal.SIGKILL if self.fault == 'dying' else signal.SIGSTOP)
        odometry = Odometry(header=message.header, child_frame_id='base_link')
        odometry.header.frame_id = 'odom'
        odometry.pose.pose.orientation.w = 1.0
        for _ in range(1000 if self.fault == 'flooding' else 1):
            self.odom.publish('{}' if self.fault == 'string' else odometry)


if __name__ == '__main__':
    fault = sys.argv[1]
    if fault == 'ending':
        sys.exit(3)
    rospy.init_node('broken')
    broken = Broken(fault)
    rospy.spin()
