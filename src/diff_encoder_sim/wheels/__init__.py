"""Wheel encoders, their faults, the report link, and odometry with its covariance."""
