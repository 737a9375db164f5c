#!/usr/bin/env python3
"""Ends when /clock has come to the given time [s]: lets a test outside of the graph know that it runs."""

import sys
import threading

import rospy
from rosgraph_msgs.msg import Clock

reached = threading.Event()
rospy.init_node('wait_for_clock', anonymous=True)
rospy.Subscriber('/clock', Clock, lambda message: message.clock.to_sec() >= float(sys.argv[1]) and reached.set())
sys.exit(0 if reached.wait(60.0) else f'no clock at {sys.argv[1]} s')
