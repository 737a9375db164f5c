"""Navigation without ROS: costmaps, global planner, DWA, recovery behaviours and the navigator that uses them.

After upstream's ros-planning/navigation (costmap_2d, navfn, dwa_local_planner, move_base), with its parameter names
and, unless a parameter's description specifies otherwise, its defaults.
"""
