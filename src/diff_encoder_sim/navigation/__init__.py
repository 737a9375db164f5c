"""Navigation without ROS: costmaps, global planner, DWA, recoveries and the navigator over them.

After upstream's ros-planning/navigation (costmap_2d, navfn, dwa_local_planner, move_base), with its
parameter names and, where not said otherwise, its defaults.
"""
