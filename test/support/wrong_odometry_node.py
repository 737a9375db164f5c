#!/usr/bin/env python3
"""The simple odometry of odometry_subjects.py as a node, right or with one fault: wrong_odometry_node.py [FAULT]."""

import queue
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Empty, EmptyResponse
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.conformance.mapping import Settings, Wheels
from diff_encoder_sim.msg import EncoderPulse
from odometry_subjects import SimpleOdometry


class WrongNode(SimpleOdometry):
    """Publishes what SimpleOdometry keeps; with the fault `keeps all messages` it does both."""

    def __init__(self, fault):
        super().__init__(SimpleNamespace(reads_counts=rospy.get_param('~reads_counts', True)), Wheels(), fault)
        self.kept, self.late = [], queue.Queue()
        threading.Thread(target=self.publish_late, daemon=True).start()
        self.start(Settings(int(rospy.get_param('~modulus')), rospy.get_param('~motion_noise')))
        self.odom = rospy.Publisher('/odom', Odometry, queue_size=1000, tcp_nodelay=True)
        self.tf = rospy.Publisher('/tf', TFMessage, queue_size=1000, tcp_nodelay=True)
        rospy.Service('~reset', Empty, lambda _: EmptyResponse() if self.reset() else None)
        rospy.Subscriber('/encoder_pulse', EncoderPulse, lambda message: self.on_sample(message, counts=message.pulses))
        rospy.Subscriber('/joint_states', JointState, lambda message: self.on_sample(message, angles=message.position))

    def on_sample(self, message, counts=(), angles=()):
        if self.wrong == 'keeps all messages':
            self.kept.append(message)
        stamp_ns = message.header.stamp.to_nsec()
        self.send(SimpleNamespace(stamp_ns=stamp_ns, counts=np.array(counts), angles_rad=np.array(angles)))
        if self.died:
            rospy.signal_shutdown(self.died)

    def publish(self, odometry, *transforms):
        if self.wrong == 'late by 0.1 s':
            self.late.put((time.monotonic() + 0.1, odometry, *transforms))
        else:
            self.publish_now(odometry, *transforms)

    def publish_late(self):
        while True:
            due_s, *messages = self.late.get()
            time.sleep(max(0.0, due_s - time.monotonic()))
            self.publish_now(*messages)

    def publish_now(self, odometry, *transforms):
        for transform in transforms:
            self.tf.publish(TFMessage().deserialize(transform))
        self.odom.publish(Odometry().deserialize(odometry))


if __name__ == '__main__':
    rospy.init_node('wrong_odometry')
    WrongNode(' '.join(rospy.myargv()[1:]))
    rospy.spin()
