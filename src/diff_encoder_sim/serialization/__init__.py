"""ROS messages and bag records as bytes: encoding beside decoding."""
