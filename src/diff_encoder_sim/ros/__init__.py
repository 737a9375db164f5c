"""The ROS shell: the only folder that imports rospy, tf2 or messages. Convert, call, publish."""
