"""Drives in bags and tables, without ROS: readers, writers, message types, re-encoding, and trajectory errors."""
