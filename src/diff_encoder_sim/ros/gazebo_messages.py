"""gazebo_msgs/ModelStates, installed or not.

Debian's ROS lacks gazebo_msgs. Where it is missing, the class is built from its definition under
its real name, so its checksum is that of the original and any client that has the package can
subscribe.
"""
from __future__ import annotations

from typing import Type

_DEFINITION = '''\
# broadcast all model states in world frame
string[] name                 # model names
geometry_msgs/Pose[] pose     # desired pose in world frame
geometry_msgs/Twist[] twist   # desired twist in world frame
================================================================================
MSG: geometry_msgs/Pose
Point position
Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Twist
Vector3 linear
Vector3 angular
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
'''


def _model_states_class() -> Type:
    try:
        from gazebo_msgs.msg import ModelStates as installed
        return installed
    except ImportError:
        from genpy.dynamic import generate_dynamic
        return generate_dynamic('gazebo_msgs/ModelStates', _DEFINITION)['gazebo_msgs/ModelStates']


ModelStates = _model_states_class()
