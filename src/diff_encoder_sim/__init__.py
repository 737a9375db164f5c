"""Realistic wheel encoders and odometry for differential-drive robots on ROS 1."""
