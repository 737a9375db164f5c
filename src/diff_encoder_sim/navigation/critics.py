"""Critics of dwa_local_planner: the costs that each gives a trajectory.

Fox, Burgard and Thrun 1997, section III-B, as upstream divides it into critics. Each critic gives a trajectory a
cost; the weighted sum decides, and a cost below zero rejects the trajectory:

======  ===========  =====================================================  ==========================================
column  critic       cost                                                   below zero
======  ===========  =====================================================  ==========================================
0       oscillation  0                                                      -5: reverses a direction that is locked
1       obstacle     highest cost under outline and centre                  -6 in collision, -7 off the map
2       goal front   cells from the nose to the point beyond the goal       -4 off the map
3       alignment    cells from the nose to the plan                        -4 off the map
4       path         cells from the centre to the plan                      -2 unreachable, -3 blocked, -4 off the map
5       goal         cells from the centre to the plan's end in the window  as path
6       twirling     turning speed [rad/s]
======  ===========  =====================================================  ==========================================

Distances are those of the trajectory's last point, but every point must be accepted. The kernels are in
trajectory_scoring.py.
"""

from __future__ import annotations

OSCILLATION, OBSTACLE, GOAL_FRONT, ALIGNMENT, PATH, GOAL, TWIRLING = range(7)
CRITICS = 7

NO_TRAJECTORY, UNREACHABLE, BLOCKED, OFF_MAP = -1.0, -2.0, -3.0, -4.0
OSCILLATES, COLLIDES, CENTRE_OFF_MAP = -5.0, -6.0, -7.0
