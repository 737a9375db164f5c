"""ROS messages and bag records as bytes, without ROS: each type is encoded and decoded in one module.

The bytes are those that the nodes publish (ros/conversions.py), but for the seq of a header, which is 0 here
because the publisher counts it. By hand it takes a fraction of rosbags' time (test/benchmark/recording.py).
"""
