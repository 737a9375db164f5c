"""Drives in bags and tables, without ROS: readers, writers, message types, re-encoding, and trajectory errors.

The encoded bytes are those that the nodes publish (ros/messages.py), except for the seq of a header, which is 0
here because the publisher counts it.
"""
