"""Navigation without ROS, after upstream's ros-planning/navigation, with its names and, unless described, defaults."""
