"""Grid SLAM: a map and the robot's path from odometry and laser scans, as gmapping makes them."""
