"""Wheel odometry: from pulse counts to pose, twist and covariance."""
