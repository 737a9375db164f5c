"""Calibration of a robot's wheels from its own drives, without ROS."""
