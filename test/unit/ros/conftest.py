"""The nodes need ROS and the package's messages: without a sourced workspace there is nothing to collect."""

import importlib.util

HAS_ROS = importlib.util.find_spec('rospy') is not None and importlib.util.find_spec('diff_encoder_sim.msg') is not None
collect_ignore_glob = [] if HAS_ROS else ['test_*.py']
